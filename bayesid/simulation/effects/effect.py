"""The unit of extension: a physical effect that a model can carry.

An effect states its parameters with units and a prior on a physical scale, where it can occur, how a fit of it may
start and what separates it from others, and overrides only the hooks it needs. All hooks are pure functions of JAX
arrays. ``values`` are the effect's parameters in the order of ``parameters``; ``inner`` are its own states. Vectors are
in base axes unless said otherwise.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Self

import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.simulation.effects.effect_parameters import Parameter, Quantity
from bayesid.simulation.effects.instant import Instant, Modes, Readings, Resonance, Wrench

if TYPE_CHECKING:
    from bayesid.recording.joint_motion import Motion
    from bayesid.robot.robot import Robot
    from bayesid.simulation.model import Model

__all__ = ["Effect"]


class Effect:
    """A physical effect. Subclass it, set ``name`` and ``parameters``, override the hooks that apply, and `register`.

    Attributes
    ----------
    name : str
        As used in study files; a class that needs a place is written ``name:place``.
    summary : str
        What the effect is, in one sentence of a report.
    separated_by : str
        What the effect looks like and which manoeuvre or sensor separates it from rivals, in one sentence of a report.
    parameters : tuple of Parameter
    per_recording : bool
        Whether every recording has its own values.
    needs_orbit : bool
        Whether the effect exists only in orbit.
    needs_latitude : bool
        Whether it cannot be computed unless the recordings say where on the orbit they were made.
    states : int
        Number of inner states, zero at time 0.
    modes_count : int
        Number of vibration modes that `modes` returns.
    """

    name: ClassVar[str] = ""
    summary: ClassVar[str] = ""
    separated_by: ClassVar[str] = ""
    parameters: tuple[Parameter, ...] = ()
    per_recording: ClassVar[bool] = False
    needs_orbit: ClassVar[bool] = False
    needs_latitude: ClassVar[bool] = False
    states: ClassVar[int] = 0
    modes_count: ClassVar[int] = 0

    @classmethod
    def instances(cls, model: Model) -> Sequence[Effect]:
        """Return the effect at every place of a model's robot where it can occur and show in the model's sensors.

        By default once, without an orbit only if `needs_orbit` is not set, and nowhere if the class needs arguments or
        a place, which cannot be guessed.
        """
        if cls.needs_orbit and model.orbit is None:
            return []
        try:
            return [cls().attach(model.robot)]
        except (InputError, TypeError):
            return []

    @property
    def longest_step(self) -> float:
        """Longest integration step the effect allows [s]."""
        return float("inf")

    @property
    def quantities(self) -> Sequence[Quantity]:
        """What is reported of the effect; by default its parameters."""
        return [Quantity(parameter.name, parameter.unit) for parameter in self.parameters]

    def report(self, values: Array) -> Array:
        """Turn values of the parameters into those of `quantities`, shape (n,) -> (m,)."""
        return values

    def attach(self, robot: Robot) -> Self:
        """Return the effect as it is on a robot; an `InputError` where it has no such place."""
        return self

    @property
    def starts(self) -> Sequence[Floats]:
        """Coordinates, with a standard-normal prior, from which a fit of the effect is started; by default zero."""
        return [np.zeros(len(self.parameters))]

    @property
    def absent(self) -> Floats:
        """Values at which nothing is there, by default zero amplitudes and the others at their centre, (n,).

        An effect whose size is no amplitude overrides it; one without parameters is there or is not in the model.
        """
        return np.array([0.0 if parameter.is_amplitude else parameter.mean for parameter in self.parameters])

    def in_amplitudes(self) -> Effect:
        """Return the effect in amplitudes that are zero where it is absent, for linear tests; by default itself.

        An effect whose prior is not centred where it is absent overrides it, and `amplitudes` with it.
        """
        return self

    def amplitudes(self, values: Array) -> Array:
        """Turn values of the parameters into those of the parameters of `in_amplitudes`."""
        return values

    def starts_near(self, resonances: Sequence[Resonance], alone: bool) -> Sequence[Floats]:
        """Return the coordinates from which a fit of a vibration is started, by default `starts`.

        Parameters
        ----------
        resonances : sequence of Resonance
            What the residual asks for, the most wanted first.
        alone : bool
            Whether no other effect is fitted beside it, so that more starts can be afforded.
        """
        return self.starts

    def tuned(self, values: Floats) -> Self:
        """Return the effect with what depends on the size of its values, as `longest_step` may, chosen for them."""
        return self

    @property
    def label(self) -> str:
        """Name with the place, as in study files."""
        return self.name

    @property
    def link(self) -> str | None:
        """Link that `table` is a table of; None where it changes others too, which joint torques do not follow."""
        return None

    constant_names: ClassVar[tuple[str, ...]] = ()
    """Attributes that hold numbers, or trees of arrays, which compiled code takes as arguments (`EffectKey`)."""

    @property
    def constants(self) -> tuple[Any, ...]:
        """Values of the attributes in ``constant_names``."""
        return tuple(getattr(self, name) for name in self.constant_names)

    def bound(self, constants: tuple[Any, ...]) -> Self:
        """Return the effect with other constants, which may be traced."""
        if not self.constant_names:
            return self
        changed = copy.copy(self)
        changed.__dict__.update(zip(self.constant_names, constants, strict=True))
        return changed

    def momentum(self, values: Array, instant: Instant, inner: Array) -> tuple[Array, Array]:
        """Return angular momentum relative to the base and its derivative, as a free couple [N m s, N m]."""
        return jnp.zeros(3), jnp.zeros(3)

    def wrench(self, values: Array, instant: Instant, inner: Array) -> Wrench:
        """Return the external force and its torque about the base origin [N, N m]."""
        return Wrench(jnp.zeros(3), jnp.zeros(3))

    def derivative(self, values: Array, instant: Instant, inner: Array) -> Array:
        """Return the derivative of the inner states, shape (states,)."""
        return jnp.zeros(self.states)

    def specific_force(self, values: Array, instant: Instant, lever: Array) -> Array:
        """Return what an accelerometer at ``lever`` from the centre of mass reads beyond wrench and motion [m/s2]."""
        return jnp.zeros(3)

    def gravity_gradient_tensor(self, values: Array, instant: Instant) -> Array:
        """Return gravitational acceleration per distance from the centre of mass, shape (3, 3) [1/s2]."""
        return jnp.zeros((3, 3))

    def modes(self, values: Array) -> Modes:
        """Return the vibration modes."""
        raise NotImplementedError

    def table(self, robot: Robot, motion: Motion, time: Floats) -> Floats:
        """Return coefficients of changes of the tables (`bayesid.robot.composite_tables`), shape (T, 28, m)."""
        return np.zeros((len(time), 28, 0))

    def loads(self, values: Array) -> Array:
        """Return what multiplies the coefficients of `table`, shape (m,)."""
        return jnp.zeros(0)

    def body_tables(
        self, robot: Robot, unknown: Sequence[str], motion: Motion, time: Floats
    ) -> list[tuple[str | None, Floats]]:
        """Return `table` in parts (T, 28, n), each with the link it is a table of, where some links are unknown."""
        return [(self.link, self.table(robot, motion, time))]

    def body_loads(self, values: Array, inertial: Array) -> Array:
        """Return what multiplies all columns of `body_tables`, given all unknown links' parameters, ten each."""
        return self.loads(values)

    def read(self, values: Array, readings: Readings) -> Readings:
        """Return what faulty sensors make of the true readings, in sensor axes."""
        return readings

    def friction(self, values: Array, velocity: Array) -> Array:
        """Return torques of the joints' motors beyond those that move the bodies, (T, n), of joint speeds (T, n)."""
        return jnp.zeros_like(velocity)

    def uses(self, hook: str) -> bool:
        """Whether the class overrides a hook."""
        return getattr(type(self), hook) is not getattr(Effect, hook)
