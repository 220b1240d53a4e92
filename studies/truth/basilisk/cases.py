"""Cases of hidden causes that Basilisk flies: the parts it has of its own, a pair of them, and nothing hidden."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from studies.truth.basilisk.arm import true_base
from studies.truth.basilisk.parts import BasiliskHidden, Leak, Panel, Slosh, Wheel
from studies.truth.basilisk.study import write_basilisk_study
from studies.truth.hidden_causes.case import Generator, direction
from studies.truth.motions import Manoeuvres
from studies.truth.mujoco.study import Study
from studies.truth.numerics import Array
from studies.truth.recordings import Sensors
from studies.truth.urdf import SERVICER3, SERVICER4

__all__ = ["BASILISK_CASES", "BasiliskCase"]

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class BasiliskCase:
    """A study that Basilisk flies, and the answer.

    Parameters
    ----------
    name : str
    causes : tuple of str
        The contract's names for what is hidden; empty where nothing is.
    build : callable
        (draw, strength) -> what is hidden.
    urdf : path
    accept : tuple of str
        Names that are as right as one of the causes.
    """

    name: str
    causes: tuple[str, ...]
    build: Callable[[Generator, float], BasiliskHidden]
    urdf: Path
    accept: tuple[str, ...] = ()

    @property
    def status(self) -> str:
        """What a verdict should say: "effect" or "adequate"."""
        return "effect" if self.causes else "adequate"

    def write(self, folder: str | Path, seed: int, strength: float = 1.0) -> Study:
        """Write the study; circumstances, motions and noise follow from the seed and do not depend on the strength."""
        draw = np.random.default_rng([seed, 1])
        manoeuvres = Manoeuvres(count=3, duration=float(draw.choice([140.0, 150.0, 160.0])))
        sensors = Sensors(accel_position=_vector(np.round(direction(draw, 0.4), 3)))
        hidden = self._hidden(seed, strength)
        file = write_basilisk_study(
            folder,
            seed,
            hidden=hidden,
            urdf=self.urdf,
            sensors=sensors,
            manoeuvres=manoeuvres,
            guess_spread=0.1,
            title="Free-flyer",
        )
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


def _vector(values: Array) -> Vector:
    x, y, z = values.tolist()
    return x, y, z


def _nothing(draw: Generator, strength: float) -> BasiliskHidden:
    return BasiliskHidden()


def _wheel(draw: Generator, strength: float) -> BasiliskHidden:
    return BasiliskHidden(wheel=Wheel(_vector(direction(draw, 0.05 * strength))))


def _leak(draw: Generator, strength: float) -> BasiliskHidden:
    force, torque = direction(draw, 2e-4 * strength), direction(draw, 1e-4 * strength)
    return BasiliskHidden(leak=Leak(_vector(force), _vector(torque)))


def _wheel_and_leak(draw: Generator, strength: float) -> BasiliskHidden:
    return BasiliskHidden(wheel=_wheel(draw, strength).wheel, leak=_leak(draw, strength).leak)


def _slosh(draw: Generator, strength: float) -> BasiliskHidden:
    position, frequency = direction(draw, 0.7), float(draw.uniform(0.24, 0.3))
    return BasiliskHidden(slosh=Slosh(6.0 * strength, _vector(position), frequency))


def _panel(draw: Generator, strength: float) -> BasiliskHidden:
    mass, frequency = 4.5 * strength, float(draw.uniform(0.28, 0.34))
    x, y, z = (np.array(Panel().inertia) * mass / Panel().mass).tolist()
    return BasiliskHidden(panel=Panel(mass=mass, inertia=(x, y, z), frequency=frequency))


BASILISK_CASES = (
    BasiliskCase("wheel-momentum in Basilisk", ("wheel-momentum",), _wheel, SERVICER3),
    BasiliskCase("null, three joints in Basilisk", (), _nothing, SERVICER3),
    BasiliskCase("thruster-leak in Basilisk", ("thruster-leak",), _leak, SERVICER4),
    BasiliskCase("null, four joints in Basilisk", (), _nothing, SERVICER4),
    BasiliskCase("fuel-slosh in Basilisk", ("fuel-slosh",), _slosh, SERVICER4),
    BasiliskCase("flexible-appendage in Basilisk", ("flexible-appendage",), _panel, SERVICER3),
    BasiliskCase(
        "wheel-momentum, thruster-leak in Basilisk", ("wheel-momentum", "thruster-leak"), _wheel_and_leak, SERVICER4
    ),
)
"""Causes of the catalogue of which Basilisk has its own models, a pair of them, and nothing hidden on two robots."""
