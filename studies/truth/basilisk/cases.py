"""Studies written from flights in Basilisk, and the cases: the parts it has of its own, a pair of them, nothing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from studies.truth.basilisk.model import (
    STEP,
    BasiliskHidden,
    Leak,
    Panel,
    Slosh,
    Wheel,
    read_robot,
    simulate,
    true_base,
)
from studies.truth.bodies import SERVICER3, SERVICER4, write_urdf, wrong_guess
from studies.truth.hidden_causes.causes import Generator, direction, triple
from studies.truth.motions import Manoeuvres
from studies.truth.mujoco.study import Study
from studies.truth.numerics import Array
from studies.truth.recordings import Sensors, Table, Truth, by_axis, study_toml, write_csv

Build = Callable[[Generator, float], BasiliskHidden]  # source of random numbers and strength -> what is hidden
_NOTHING, _SENSORS, _MANOEUVRES = BasiliskHidden(), Sensors(), Manoeuvres()


def _recording(
    joints: Sequence[str], truth: Truth, sensors: Sensors, generator: np.random.Generator
) -> tuple[Array, Table]:
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
    folder : path; folder of the study, made where it does not exist
    seed : int; seed of motions, initial values, guess and noise
    hidden : BasiliskHidden; parts and actions that the study's model lacks
    urdf : path; the robot as it truly is, a serial arm on a base; the study's copy has a wrong base and the true arm
    sensors : Sensors; rate sensor, accelerometer and encoders with one common period
    manoeuvres : Manoeuvres; the joints' reference motions; the joints follow them badly
    guess_spread : float; the study's base is wrong by about twice this in mass and moments; 0 leaves it true
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
    joints = [link.joint.name for link in arm]
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


@dataclass(frozen=True)
class BasiliskCase:
    """A study that Basilisk flies, and the answer."""

    name: str
    causes: tuple[str, ...]  # the contract's names for what is hidden; empty where nothing is
    build: Build
    urdf: Path
    accept: tuple[str, ...] = ()  # names that are as right as one of the causes

    @property
    def status(self) -> str:
        """What a verdict should say: "effect" or "adequate"."""
        return "effect" if self.causes else "adequate"

    def write(self, folder: str | Path, seed: int, strength: float = 1.0) -> Study:
        """Write the study; circumstances, motions and noise follow from the seed and do not depend on the strength."""
        draw = np.random.default_rng([seed, 1])
        manoeuvres = Manoeuvres(count=3, duration=float(draw.choice([140.0, 150.0, 160.0])))
        sensors = Sensors(accel_position=triple(np.round(direction(draw, 0.4), 3)))
        hidden = self._hidden(seed, strength)
        told: dict[str, Any] = {"manoeuvres": manoeuvres, "guess_spread": 0.1, "title": "Free-flyer"}
        file = write_basilisk_study(folder, seed, hidden=hidden, urdf=self.urdf, sensors=sensors, **told)
        return Study(file, true_base(hidden, self.urdf), ())

    def make(self, folder: str | Path, seed: int, strength: float = 1.0) -> Path:
        """Write the study and return its file."""
        return self.write(folder, seed, strength).file

    def amplitudes(self, seed: int, strength: float = 1.0) -> dict[str, Array]:
        """Magnitudes of what is hidden, by cause, for causes that are a vector."""
        wheel = self._hidden(seed, strength).wheel
        return {} if wheel is None else {"wheel-momentum": np.array(wheel.momentum)}

    def _hidden(self, seed: int, strength: float) -> BasiliskHidden:
        return self.build(np.random.default_rng([seed, 2]), strength)


def _wheel(draw: Generator, strength: float) -> BasiliskHidden:
    return BasiliskHidden(wheel=Wheel(triple(direction(draw, 0.05 * strength))))


def _leak(draw: Generator, strength: float) -> BasiliskHidden:
    force, torque = direction(draw, 2e-4 * strength), direction(draw, 1e-4 * strength)
    return BasiliskHidden(leak=Leak(triple(force), triple(torque)))


def _slosh(draw: Generator, strength: float) -> BasiliskHidden:
    position, frequency = direction(draw, 0.7), float(draw.uniform(0.24, 0.3))
    return BasiliskHidden(slosh=Slosh(6.0 * strength, triple(position), frequency))


def _panel(draw: Generator, strength: float) -> BasiliskHidden:
    mass, frequency = 4.5 * strength, float(draw.uniform(0.28, 0.34))
    x, y, z = (np.array(Panel().inertia) * mass / Panel().mass).tolist()
    return BasiliskHidden(panel=Panel(mass=mass, inertia=(x, y, z), frequency=frequency))


def _all(*builds: Build) -> Build:
    def build(draw: Generator, strength: float) -> BasiliskHidden:
        parts = [vars(one(draw, strength)) for one in builds]
        return BasiliskHidden(**{key: part for of_build in parts for key, part in of_build.items() if part is not None})

    return build


# causes of the catalogue of which Basilisk has its own models, a pair of them, and nothing hidden on two robots
BASILISK_CASES = (
    BasiliskCase("wheel-momentum in Basilisk", ("wheel-momentum",), _wheel, SERVICER3),
    BasiliskCase("null, three joints in Basilisk", (), _all(), SERVICER3),
    BasiliskCase("thruster-leak in Basilisk", ("thruster-leak",), _leak, SERVICER4),
    BasiliskCase("null, four joints in Basilisk", (), _all(), SERVICER4),
    BasiliskCase("fuel-slosh in Basilisk", ("fuel-slosh",), _slosh, SERVICER4),
    BasiliskCase("flexible-appendage in Basilisk", ("flexible-appendage",), _panel, SERVICER3),
    BasiliskCase(
        "wheel-momentum, thruster-leak in Basilisk", ("wheel-momentum", "thruster-leak"), _all(_wheel, _leak), SERVICER4
    ),
)
