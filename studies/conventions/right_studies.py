"""Right studies with anything hidden, of unusual robots too, each looked at in many circumstances.

A flight of MuJoCo takes a second and a look a tenth of one. So each flight is looked at again and again with other
noise, mountings (which the study states rightly), guesses of the base, sensors and recordings.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from bayesid import BodyPrior, InertialParameters, Recording
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.sensors import Sensor
from studies.truth.bodies import BRANCHED, SERVICER3, SERVICER4, Body, read_urdf, write_urdf
from studies.truth.mujoco import Hidden, Manoeuvres, Rotor, write_study
from studies.truth.recordings import Sensors
from studies.truth.wheels import write_slews

__all__ = ["UNUSUAL", "circumstances"]

LOUDEST = 10.0  # noise relative to the declared one
TURNED = np.radians(30.0)  # largest angle of a mounting
GUESS = 3.0  # factor by which the base is guessed too heavy or too light
LIGHT = 0.01  # mass of a light base relative to that of its arm
SPIN = 20.0  # momentum of a fast wheel, many times that of the base [N m s]

SENSORS = Sensors(attitude_period=2.0)


def _light_base(folder: Path, seed: int) -> Path:
    robot = read_urdf(SERVICER3)
    base, arm = robot.bodies[robot.base], sum(robot.bodies[name].mass for name in robot.bodies if name != robot.base)
    share = LIGHT * arm / base.mass
    light = folder / "light.urdf"
    write_urdf(SERVICER3, light, Body(share * base.mass, base.com, share * base.inertia))
    manoeuvres = Manoeuvres(count=3, duration=60.0)
    study = write_study(
        folder / "study", light, np.random.default_rng(seed), sensors=SENSORS, manoeuvres=manoeuvres, step=0.1
    )
    return study.file


def _fast_wheel(folder: Path, seed: int) -> Path:
    draw = np.random.default_rng(seed)
    axis = draw.standard_normal(3)
    x, y, z = SPIN * axis / np.linalg.norm(axis)
    manoeuvres = Manoeuvres(count=3, duration=60.0)
    hidden = Hidden(rotor=Rotor((float(x), float(y), float(z))))
    return write_study(folder, SERVICER4, draw, hidden=hidden, sensors=SENSORS, manoeuvres=manoeuvres, step=0.1).file


def _branched(folder: Path, seed: int) -> Path:
    draw, manoeuvres = np.random.default_rng(seed), Manoeuvres(count=3, duration=60.0)
    return write_study(folder, BRANCHED, draw, sensors=SENSORS, manoeuvres=manoeuvres, step=0.1).file


def _satellite(folder: Path, seed: int) -> Path:
    return write_slews(folder, np.random.default_rng(seed)).file


UNUSUAL: dict[str, Callable[[Path, int], Path]] = {
    "light base": _light_base,
    "fast wheel": _fast_wheel,
    "two arms and a slide": _branched,
    "satellite of wheels": _satellite,
}
"""Right studies of unusual robots, written into a folder from a seed."""


def circumstances(
    model: Model, manoeuvres: Sequence[Manoeuvre], generator: np.random.Generator, count: int
) -> Iterator[tuple[Model, list[Manoeuvre]]]:
    """Yield a study as it is, and then as it would be in other circumstances.

    Parameters
    ----------
    model : Model
    manoeuvres : sequence of Manoeuvre
    generator : numpy.random.Generator
    count : int
        Number of studies.
    """
    yield model, list(manoeuvres)
    for _ in range(count - 1):
        order = generator.permutation(len(manoeuvres))[: generator.integers(1, len(manoeuvres) + 1)]
        used = [sensor for sensor in model.sensors if generator.random() < 0.8] or list(model.sensors)
        sensors = {sensor: _mounted(sensor, generator) for sensor in used}
        loudness = LOUDEST ** generator.random()
        yield (
            replace(model, sensors=tuple(sensors.values()), priors=tuple(_guessed(p, generator) for p in model.priors)),
            [_recorded(manoeuvres[index], sensors, loudness, generator) for index in order],
        )


def _mounted(sensor: Sensor, generator: np.random.Generator) -> Sensor:
    if not sensor.kind.mounted or generator.random() < 0.5:
        return sensor
    axis = generator.standard_normal(3)
    turn = Rotation.from_rotvec(TURNED * generator.random() * axis / np.linalg.norm(axis))
    return replace(sensor, mounting=(turn * Rotation.from_matrix(sensor.rotation)).as_quat())


def _guessed(prior: BodyPrior, generator: np.random.Generator) -> BodyPrior:
    factor, body = GUESS ** generator.uniform(-1.0, 1.0), prior.centre
    return replace(prior, centre=InertialParameters(factor * body.mass, body.com, factor * body.inertia))


def _recorded(
    manoeuvre: Manoeuvre, sensors: dict[Sensor, Sensor], loudness: float, generator: np.random.Generator
) -> Manoeuvre:
    """Return a manoeuvre as other sensors would read it, with more noise."""
    recording, channels = manoeuvre.recording, dict(manoeuvre.recording.channels)
    for before, after in sensors.items():
        names = before.kind.columns
        values = np.stack([channels[name] for name in names], axis=1)
        present = np.isfinite(values).all(axis=1)
        interval = float(np.median(np.diff(recording.time[present])))
        noise = np.sqrt(loudness**2 - 1.0) * before.noise.sigma(interval) * generator.standard_normal((len(values), 3))
        if before.kind.mounted:
            values = values @ (after.rotation.T @ before.rotation).T + noise
        else:
            turned = Rotation.from_quat(values[present]) * Rotation.from_rotvec(noise[present])
            values[present] = turned.as_quat()
        channels |= dict(zip(names, values.T, strict=True))
    return replace(manoeuvre, recording=Recording(recording.name, recording.file, recording.time, channels))
