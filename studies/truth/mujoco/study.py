"""Studies written from flights in MuJoCo: robot.urdf, manoeuvre-N.csv and study.toml in a folder."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from studies.truth import recordings as rec
from studies.truth.bodies import Body, Description, nearby, read_urdf, write_urdf, wrong_guess
from studies.truth.motions import Manoeuvres
from studies.truth.mujoco.model import TruthModel
from studies.truth.mujoco.parts import Appendage, Field, Flexibility, Mover, Rotor, Thrust
from studies.truth.numerics import Array
from studies.truth.orbit import Orbit
from studies.truth.recordings import Distortion, Sensors, Spoiling, Truth


@dataclass(frozen=True)
class Hidden:
    """What moves the robot besides its arm; the gravity gradient is there when the study has an orbit.

    Fields of the `environment` are made for each recording from its orbit. Links that are `changed` keep their URDF in
    the study; the stiffness of `flexible` joints belongs to the first recording's configuration at rest.
    """

    rotor: Rotor | None = None
    appendages: Sequence[Appendage] = ()
    thrusts: Sequence[Thrust] = ()
    fields: Sequence[Field] = ()
    environment: Sequence[Callable[[Orbit], Field]] = ()
    movers: Sequence[Mover] = ()
    changed: Mapping[str, Body] = field(default_factory=dict)
    flexible: Sequence[Flexibility] = ()


class Study(NamedTuple):
    """A written study: its TOML file, the true base body (all that is fixed on it included), the noise-free motions."""

    file: Path
    base: Body
    truths: tuple[Truth, ...]


_ORBIT, _HIDDEN, _SENSORS, _MANOEUVRES = Orbit(), Hidden(), Sensors(), Manoeuvres()


def write_study(
    folder: str | Path,
    urdf: str | Path,
    generator: np.random.Generator,
    *,
    orbit: Orbit | None = _ORBIT,
    hidden: Hidden = _HIDDEN,
    sensors: Sensors = _SENSORS,
    manoeuvres: Manoeuvres = _MANOEUVRES,
    effects: Sequence[str] | None = None,
    guess_spread: float = 0.1,
    declared_accel_position: ArrayLike | None = None,
    record_thrusts: bool = True,
    gaps: Mapping[str, Sequence[tuple[float, float]]] | None = None,
    distort: Distortion | None = None,
    spoil: Spoiling | None = None,
    declared: Sensors | None = None,
    link_spread: float = 0.0,
    initial_rate: str | None = None,
    latitudes: Sequence[float] | None = None,
    step: float = 0.05,
    flown: float | None = None,
    title: str = "MuJoCo truth",
) -> Study:
    """Write robot.urdf, manoeuvre-N.csv and study.toml into a folder.

    Parameters
    ----------
    folder : path; folder of the study, made where it does not exist
    urdf : path; the robot as it truly is; the study's copy has a wrong base
    generator : numpy.random.Generator; source of motions, initial values, guess and noise
    orbit : Orbit, optional; orbit of all recordings; with None there is no gravity gradient
    hidden : Hidden
        Wheel, appendages, thrust. Only thrust is told to the study, and only with `record_thrusts`.
    sensors : Sensors
    manoeuvres : Manoeuvres
    effects : sequence of str, optional
        Effects the study's model has; by default the gravity gradient where there is an orbit.
    guess_spread : float; how wrong the base of the study's URDF is, see `wrong_guess`; 0 leaves it true
    declared_accel_position : (3,) array_like, optional
        What the study says in place of the true `sensors.accel_position` [m].
    record_thrusts : bool
        Whether thrusts are written as base_force and base_torque; they must then start and stop at sample times.
    gaps : mapping, optional; channel ("accel", "position.joint2") -> intervals (start, stop) [s] with empty cells
    distort : callable, optional
        Changes the noise-free columns (in place) of each recording, given with the truth: a sensor's error.
    spoil : callable, optional
        Changes the noisy columns (in place), given with their times and the generator: outliers, quantisation.
    declared : Sensors, optional; what the study says in place of `sensors`; their delays are never told
    link_spread : float; relative width of the study's priors of the links, within which the true links are drawn
    initial_rate : str, optional; what the study says of the initial rate
    latitudes : sequence of float, optional; argument of latitude of each recording [rad] in place of the orbit's
    step : float; largest integration step [s]
    flown : float, optional
        Period at which a smooth motion is flown and between which it is interpolated [s]; by default every sample is
        flown.
    title : str

    Returns
    -------
    Study
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    robot = read_urdf(urdf)
    parts = ("rotor", "appendages", "thrusts", "movers", "flexible")
    options: dict[str, Any] = {part: getattr(hidden, part) for part in parts}
    options["accel_position"] = sensors.accel_position
    model = TruthModel(urdf, **options)
    write_urdf(urdf, folder / "robot.urdf", wrong_guess(model.base, generator, guess_spread))
    changed = _drawn_links(robot, generator, link_spread) | dict(hidden.changed)
    samples = rec.sample_times(manoeuvres.duration, sensors)
    times = np.unique(np.concatenate(list(samples.values())))
    taken = rec.delayed(times, sensors)
    truths: list[Truth] = []
    attitudes, orbits = [], []
    kinds = [joint.kind for joint in robot.moving]
    configuration: Array | None = None
    for index in range(1, manoeuvres.count + 1):
        attitude = generator.standard_normal(4)
        attitudes.append(attitude / np.linalg.norm(attitude))
        rate = manoeuvres.rate_spread * generator.standard_normal(3)
        motion = manoeuvres.draw(kinds, generator)
        configuration = motion(0.0)[0] if configuration is None else configuration
        place = orbit
        if orbit is not None and latitudes is not None:
            place = replace(orbit, argument_of_latitude=latitudes[index - 1])
        orbits.append(place)
        fields = [*hidden.fields, *([] if place is None else [make(place) for make in hidden.environment])]
        options["movers"] = [mover.in_recording(index - 1) for mover in hidden.movers]
        model = TruthModel(urdf, orbit=place, fields=fields, changed=changed, configuration=configuration, **options)
        instants = np.unique(np.concatenate(list(taken.values())))
        if flown is None:
            at = model.run(motion, instants, rate0=rate, attitude0=attitudes[-1], step=step).at
        else:
            few = np.arange(np.floor(instants[0] / flown), np.ceil(instants[-1] / flown) + 1.0) * flown
            at = model.run(motion, few, rate0=rate, attitude0=attitudes[-1], step=step).between
        truth = at(times)
        table = rec.columns(model.joints, {name: at(when) for name, when in taken.items()}, samples, times)
        if distort is not None:
            distort(table, truth)
        rec.add_noise(table, sensors, generator)
        if spoil is not None:
            spoil(table, times, generator)
        rec.cut_gaps(table, times, gaps or {})
        if hidden.thrusts and record_thrusts:
            rec.add_thrusts(table, truth, {edge for thrust in hidden.thrusts for edge in (thrust.start, thrust.stop)})
        rec.write_csv(folder / f"manoeuvre-{index}.csv", times, table)
        truths.append(truth)
    if effects is None:
        effects = () if orbit is None else ("gravity-gradient",)
    told = sensors if declared is None else declared
    if declared_accel_position is not None:
        x, y, z = np.asarray(declared_accel_position, dtype=float)
        told = replace(told, accel_position=(x, y, z))
    file = folder / "study.toml"
    model_told: dict[str, Any] = {"effects": effects, "link_spread": link_spread, "initial_rate": initial_rate}
    file.write_text(rec.study_toml(title, robot.base, told, attitudes, orbits=orbits, **model_told))
    return Study(file, model.base, tuple(truths))


def _drawn_links(robot: Description, generator: np.random.Generator, spread: float) -> dict[str, Body]:
    """Draw the links that joints move; what is fixed on them stays."""
    links = [joint.child for joint in robot.moving if joint.child in robot.bodies] if spread else []
    return {name: nearby(robot.bodies[name], generator, spread) for name in links}
