"""The unit of extension: a physical effect that a model can carry, and the register of those known by name.

An effect states its parameters with units and a prior on a physical scale, and overrides only the hooks it needs. All
hooks are pure functions of JAX arrays. ``values`` are the effect's parameters in the order of ``parameters``; ``inner``
are its own states. Vectors are in base axes unless said otherwise.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar, NamedTuple, TypeVar

import jax.numpy as jnp
from jax import Array

from bayesid.errors import InputError

__all__ = ["Composite", "Effect", "Environment", "Moment", "Parameter", "Readings", "Wrench", "create", "register"]


class Parameter(NamedTuple):
    """One parameter of an effect, with a normal prior.

    ``sigma`` is the prior's standard deviation; ``mean`` its centre.
    """

    name: str
    unit: str
    sigma: float
    mean: float = 0.0


class Composite(NamedTuple):
    """The whole system seen as one body, in base axes; derivatives are relative to the base.

    ``com`` is the centre of mass with two derivatives; inertia, second moment and spin (angular momentum relative to
    the base) are about it.
    """

    mass: Array
    com: Array
    com_rate: Array
    com_acceleration: Array
    inertia: Array
    inertia_rate: Array
    inverse: Array
    second_moment: Array
    spin: Array
    spin_rate: Array


class Environment(NamedTuple):
    """What is known of an instant beforehand. Orbit vectors are in orbit axes, zero away from orbit."""

    time: Array
    zenith: Array
    gradient: Array  # mu / r^3 [1/s2]
    velocity: Array
    sun: Array
    latitude: Array  # argument of latitude [rad]
    wheel_momentum: Array  # recorded [N m s]
    wheel_torque: Array  # its derivative


class Moment(NamedTuple):
    """One instant of a simulation, as an effect sees it.

    ``attitude`` rotates base axes to orbit axes. ``rate`` is zero while momenta are being summed:
    it follows from them.
    """

    environment: Environment
    body: Composite
    attitude: Array
    rate: Array

    def to_base(self, vector: Array) -> Array:
        """Rotate a vector from orbit axes to base axes."""
        return self.attitude.T @ vector


class Wrench(NamedTuple):
    """An external force and its torque about the base origin."""

    force: Array
    torque: Array


class Readings(NamedTuple):
    """What the sensors read at their sample times: rate (T, 3), accel (T, 3), attitude quaternion (T, 4), time (T,)."""

    time: Array
    rate: Array
    accel: Array
    attitude: Array


class Effect:
    """A physical effect. Subclass it, set ``name`` and ``parameters``, override the hooks that apply, and `register`.

    Attributes
    ----------
    name : str
        As used in study files; a class that needs a place is written ``name:place``.
    parameters : tuple of Parameter
    per_recording : bool
        Whether every recording has its own values.
    needs_orbit : bool
        Whether the effect exists only in orbit.
    states : int
        Number of inner states, zero at time 0.
    """

    name: ClassVar[str] = ""
    summary: ClassVar[str] = ""
    parameters: tuple[Parameter, ...] = ()
    per_recording: ClassVar[bool] = False
    needs_orbit: ClassVar[bool] = False
    states: ClassVar[int] = 0

    @property
    def label(self) -> str:
        """Name with the place, as in study files."""
        return self.name

    def momentum(self, values: Array, moment: Moment, inner: Array) -> tuple[Array, Array]:
        """Return angular momentum relative to the base and its derivative, as a free couple [N m s, N m]."""
        return jnp.zeros(3), jnp.zeros(3)

    def wrench(self, values: Array, moment: Moment, inner: Array) -> Wrench:
        """Return the external force and its torque about the base origin [N, N m]."""
        return Wrench(jnp.zeros(3), jnp.zeros(3))

    def derivative(self, values: Array, moment: Moment, inner: Array) -> Array:
        """Return the derivative of the inner states, shape (states,)."""
        return jnp.zeros(self.states)

    def field(self, values: Array, moment: Moment, lever: Array) -> Array:
        """Return what an accelerometer at ``lever`` from the centre of mass reads beyond wrench and motion [m/s2]."""
        return jnp.zeros(3)

    def read(self, values: Array, readings: Readings) -> Readings:
        """Return what faulty sensors make of the true readings, in sensor axes."""
        return readings

    def uses(self, hook: str) -> bool:
        """Whether the class overrides a hook."""
        return getattr(type(self), hook) is not getattr(Effect, hook)


_REGISTER: dict[str, Callable[..., Effect]] = {}

E = TypeVar("E", bound=type[Effect])


def register(effect: E) -> E:
    """Class decorator: make an effect known to study files by its name."""
    if not effect.name:
        raise InputError(f"effect {effect.__name__} has no name", remedy="Set the class attribute `name`")
    _REGISTER[effect.name] = effect
    return effect


def create(label: str, **options: Any) -> Effect:
    """Build an effect by the label used in study files, such as ``"gravity-gradient"``.

    Raises
    ------
    InputError
        If no effect of that name is registered.
    """
    name, _, place = label.partition(":")
    if name not in _REGISTER:
        raise InputError(
            f"unknown effect {label!r}",
            remedy=f"Choose from {', '.join(sorted(_REGISTER))}, or name your file under model.plugins",
        )
    return _REGISTER[name](place, **options) if place else _REGISTER[name](**options)
