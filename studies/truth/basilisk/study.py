"""Studies written from flights in Basilisk: robot.urdf, manoeuvre-N.csv and study.toml in a folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from studies.truth.basilisk.arm import read_robot, true_base
from studies.truth.basilisk.model import STEP, simulate
from studies.truth.basilisk.parts import BasiliskHidden
from studies.truth.bodies import wrong_guess
from studies.truth.motions import Manoeuvres
from studies.truth.numerics import Array
from studies.truth.readings import Truth
from studies.truth.recordings import Sensors, Table, by_axis, write_csv
from studies.truth.study_file import study_toml
from studies.truth.urdf import SERVICER4, write_urdf

__all__ = ["write_basilisk_study"]

_NOTHING, _SENSORS, _MANOEUVRES = BasiliskHidden(), Sensors(), Manoeuvres()


def _recording(
    joints: Sequence[str], truth: Truth, sensors: Sensors, generator: np.random.Generator
) -> tuple[Array, Table]:
    """Sample times and noisy columns of a recording."""
    period = sensors.encoder_period
    stride = round(period / STEP)
    if stride < 1 or abs(stride * STEP - period) > 1e-9 or (sensors.rate_period, sensors.accel_period) != (period,) * 2:
        raise ValueError(f"the sensors' periods must be one multiple of {STEP} s; got {sensors}")
    sampled = truth.at(truth.times[::stride])
    table: Table = {}
    channels: list[tuple[str, Sequence[str], Array, float]] = [
        ("rate", "xyz", sampled.rate, sensors.rate_sigma),
        ("accel", "xyz", sampled.accel, sensors.accel_sigma),
        ("position", joints, sampled.position, sensors.encoder_sigma),
    ]
    for channel, names, values, sigma in channels:
        table |= by_axis(channel, names, values + sigma * generator.standard_normal(values.shape))
    return sampled.times, table


def write_basilisk_study(
    folder: str | Path,
    seed: int,
    *,
    hidden: BasiliskHidden = _NOTHING,
    urdf: str | Path = SERVICER4,
    sensors: Sensors = _SENSORS,
    manoeuvres: Manoeuvres = _MANOEUVRES,
    guess_spread: float = 0.15,
    title: str = "Basilisk truth",
) -> Path:
    """Write robot.urdf, manoeuvre-N.csv and study.toml into a folder.

    Parameters
    ----------
    folder : path
        Folder of the study, made where it does not exist.
    seed : int
        Seed of motions, initial values, guess and noise.
    hidden : BasiliskHidden
        Parts and actions that the study's model lacks.
    urdf : path
        The robot as it truly is, a serial arm on a base; the study's copy has a wrong base and the true arm.
    sensors : Sensors
        Rate sensor, accelerometer and encoders with one common period.
    manoeuvres : Manoeuvres
        The joints' reference motions; the joints follow them badly.
    guess_spread : float
        The study's base is wrong by about twice this in mass and moments; 0 leaves it true.
    title : str

    Returns
    -------
    Path
        TOML file of the study. What identification should return is `true_base(hidden, urdf)`.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    generator = np.random.default_rng(seed)
    base, _, arm = read_robot(urdf)
    joints = [link.joint for link in arm]
    write_urdf(urdf, folder / "robot.urdf", wrong_guess(true_base(hidden, urdf), generator, guess_spread))
    attitudes = []
    for index in range(1, manoeuvres.count + 1):
        motion = manoeuvres.draw(["revolute"] * len(arm), generator)
        truth = simulate(
            motion,
            manoeuvres.duration,
            hidden=hidden,
            urdf=urdf,
            rate0=manoeuvres.rate_spread * generator.standard_normal(3),
            sigma0=0.5 * generator.standard_normal(3),
            accel_position=sensors.accel_position,
        ).truth
        attitudes.append(truth.attitude[0])
        write_csv(folder / f"manoeuvre-{index}.csv", *_recording(joints, truth, sensors, generator))
    file = folder / "study.toml"
    file.write_text(study_toml(title, base, sensors, attitudes))
    return file
