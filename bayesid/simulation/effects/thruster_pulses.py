"""Effect of a thruster that fires in pulses of one length at regular intervals."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import NamedTuple, Self

import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._io.errors import InputError
from bayesid.robot.robot_size import RobotSize
from bayesid.simulation.effects.effect import Effect, Situation
from bayesid.simulation.effects.effect_parameters import Parameter, PhysicalBound, three_digits
from bayesid.simulation.effects.environment_effects import THRUST
from bayesid.simulation.effects.register import register
from bayesid.simulation.instant import Environment, Instant

__all__ = ["PulseTrain", "ThrusterPulses"]


class PulseTrain(NamedTuple):
    """When a thruster fires.

    Attributes
    ----------
    period, width : float
        From the beginning of a pulse to that of the next, and to its end [s]. With a width of a whole period the thrust
        is steady: the average of a train that is too fast for the readings.
    alternating : bool
        Whether every other pulse has the opposite sign, as in a limit cycle.
    first : tuple of float
        Beginning of the first pulse in each recording [s], infinite without any; one number serves all.
    """

    period: float
    width: float
    alternating: bool
    first: tuple[float, ...]


@register
class ThrusterPulses(Effect):
    """Force and torque about the base origin, base axes, of a thruster that fires in a regular train of pulses.

    The received angular momentum follows from the accumulated firing time, so that the simulation is exact even for
    pulses shorter than an integration step. The times of the pulses are constants of the effect; force and torque are
    its parameters.

    Parameters
    ----------
    place : str
        Period, width [s], 0 or 1 where the sign alternates, and the first pulse in each recording or one for all, with
        commas between.
    force, torque : float
        Standard deviations of the priors [N, N m].
    """

    name = "thruster-pulses"
    summary = "A thruster fires in pulses at regular intervals, with constant sign or alternating as in a limit cycle."
    separated_by = (
        "The rates rise in steps, not steadily as with a leak: sample at intervals shorter than a pulse, and record "
        "longer with the arm at rest; the steps follow the clock and not the motion."
    )
    # with A the accumulated firing time, signs included, the angular momentum about the common centre of mass is
    # x = A (T - c x F) + u, with u' = -w x x + A c' x F
    cause_kind = "pulses"
    constant_names = ("period", "width", "alternating", "first")
    states = 3

    def __init__(self, place: str = "", force: float = 1.0, torque: float = 1.0) -> None:
        try:
            period, width, sign, *first = map(float, place.split(",")) if place else (10.0, 3.0, 0.0, 5.0)
        except ValueError:
            period, width, sign, first = -1.0, 0.0, 0.0, []
        if not 0.0 < width <= period or not first or sign not in (0.0, 1.0):
            raise InputError(
                f"{self.name}: {place!r} is not a train of pulses",
                remedy=f"Give period, width, 0 or 1, and the first pulses: {self.name}:20,0.5,0,7 or with inf for none",
            )
        self.stated = bool(place)
        self._take(PulseTrain(period, width, bool(sign), tuple(first)))
        self.parameters = tuple(
            Parameter(f"{key}.{axis}", unit, sigma)
            for key, unit, sigma in (("force", "N", force), ("torque", "N m", torque))
            for axis in "xyz"
        )

    def _take(self, train: PulseTrain) -> None:
        self.period, self.width, self.alternating = train.period, train.width, float(train.alternating)
        self.first = np.array(train.first)

    @property
    def train(self) -> PulseTrain:
        """When it fires."""
        return PulseTrain(float(self.period), float(self.width), bool(self.alternating), tuple(self.first.tolist()))

    def with_train(self, train: PulseTrain) -> Self:
        """Return the effect with another train."""
        changed = copy.copy(self)
        changed.stated = True
        changed._take(train)
        return changed

    @property
    def label(self) -> str:
        """Name of the effect, followed by its train where it is given."""
        if not self.stated:
            return self.name
        numbers = (self.period, self.width, self.alternating, *self.first)
        return f"{self.name}:{','.join(f'{number:.7g}' for number in numbers)}"

    @property
    def candidate(self) -> str:
        """Name without the train, which the data give."""
        return self.name

    @classmethod
    def instances(cls, model: Situation) -> Sequence[Effect]:
        """Return one train, whose place the data give."""
        return [cls()]

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return the whole thrust of a thruster for a robot of this mass, and its torque at the edge of the base."""
        size = RobotSize.of(model.robot)
        force = THRUST * size.mass
        thrust = f"A thruster accelerates the robot by at most {THRUST:g} m/s2, with {three_digits(force)} N"
        torque = f"{thrust} at the base's radius of {three_digits(size.radius)} m."
        return PhysicalBound("N", force, f"{thrust}."), PhysicalBound("N m", force * size.radius, torque)

    def _on(self, environment: Environment) -> tuple[Array, Array]:
        """Return the sign while the thruster fires, else 0, and the time on so far with signs [s]."""
        first = jnp.asarray(self.first)
        index = jnp.minimum(jnp.asarray(environment.recording, dtype=int), len(self.first) - 1)
        since = environment.time - first[index]
        ever = since >= 0.0
        since = jnp.where(ever, since, 0.0)
        number = jnp.floor(since / self.period)
        within = since - number * self.period
        odd = jnp.mod(number, 2.0)
        sign = jnp.where(self.alternating > 0.5, 1.0 - 2.0 * odd, 1.0)
        before = jnp.where(self.alternating > 0.5, odd, number) * self.width
        total = before + sign * jnp.minimum(within, self.width)
        return jnp.where(ever & (within < self.width), sign, 0.0), jnp.where(ever, total, 0.0)

    def _received(self, values: Array, instant: Instant, inner: Array) -> tuple[Array, Array]:
        """Return torque about the common centre of mass while it fires, and angular momentum received so far."""
        torque = values[3:] - jnp.cross(instant.body.com, values[:3])
        return torque, self._on(instant.environment)[1] * torque + inner

    def momentum(self, values: Array, instant: Instant, inner: Array) -> tuple[Array, Array]:
        """Return what was received, with the opposite sign, and its derivative in base axes."""
        torque, received = self._received(values, instant, inner)
        return -received, jnp.cross(instant.rate, received) - self._on(instant.environment)[0] * torque

    def derivative(self, values: Array, instant: Instant, inner: Array) -> Array:
        """Return the change of what was received in base axes, with constant levers of the pulses."""
        _, received = self._received(values, instant, inner)
        lever = self._on(instant.environment)[1] * jnp.cross(instant.body.com_rate, values[:3])
        return lever - jnp.cross(instant.rate, received)

    def specific_force(self, values: Array, instant: Instant, lever: Array) -> Array:
        """Return the acceleration by the force while it fires."""
        return self._on(instant.environment)[0] * values[:3] / instant.body.mass
