"""Which effects of the catalogue could be at work in a study, and where."""

from __future__ import annotations

from bayesid._io.errors import InputError
from bayesid.simulation.effects.effect import Effect, create, known_effects
from bayesid.simulation.effects.sensor_faults import SensorFault
from bayesid.simulation.model import Model

__all__ = ["candidates"]

ON_LINKS = ("payload", "link-inertia")
ON_JOINTS = ("encoder-offset", "joint-flexibility")


def candidates(model: Model, *, knows_latitude: bool = True) -> list[Effect]:
    """Return every effect that the model does not have and that could exist in its situation.

    Parameters
    ----------
    model : Model
    knows_latitude : bool
        Whether the recordings say where on the orbit they were made.

    Notes
    -----
    Left out, because nothing could be said of them: environment effects away from orbit, the Sun's pressure where no
    Sun is given, the magnetic field without inclination and argument of latitude, faults of sensors that do not exist,
    changes of links that are unknown anyway.
    """
    present = {effect.label for effect in model.effects}
    kinds = {sensor.kind for sensor in model.sensors}
    orbit = model.orbit
    found = []
    for name, build in known_effects().items():
        if name in ON_LINKS:
            labels = [f"{name}:{link}" for link in _changeable_links(model)]
        elif name in ON_JOINTS:
            labels = [f"{name}:{joint.name}" for joint in model.robot.joints]
        else:
            labels = [name]
        for label in labels:
            if label in present:
                continue
            try:
                effect = create(label).attach(model.robot)
            except (InputError, TypeError):  # a user's effect that needs a place of its own cannot be guessed
                continue
            if effect.needs_orbit and orbit is None:
                continue
            if isinstance(effect, SensorFault) and effect.sensor not in kinds:
                continue
            if name == "solar-pressure" and (orbit is None or orbit.sun is None or not knows_latitude):
                continue
            if name == "magnetic-dipole" and (orbit is None or orbit.inclination is None or not knows_latitude):
                continue
            if name == "joint-latency" and not model.robot.joints:
                continue
            found.append(effect)
        del build
    return found


def _changeable_links(model: Model) -> list[str]:
    unknown = {prior.name for prior in model.bodies}
    return [name for name, link in model.robot.links.items() if name not in unknown and link.inertial.is_extended]
