"""Interface of a physical effect that a model can have, by which users extend the package.

An effect states its parameters with units and a prior on a physical scale, the places where it can occur, the starting
points of a fit and the evidence that separates it from others, and overrides only the hooks that it needs. All hooks
are pure functions of JAX arrays, in which ``values`` are the parameters in the order of ``parameters`` and ``inner``
are the effect's inner states. Vectors are in base axes unless stated otherwise.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Protocol, Self

import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.recording.joint_motion import Motion
from bayesid.recording.recording import Recording
from bayesid.robot.body_prior import BodyPrior
from bayesid.robot.robot import Robot
from bayesid.simulation.effects.effect_parameters import Parameter, PhysicalBound, Quantity, bounds_of_priors
from bayesid.simulation.instant import Instant, Modes, Readings, Resonance, Wrench
from bayesid.simulation.joint_torques import TorqueSensor
from bayesid.simulation.orbit import Orbit
from bayesid.simulation.sensors import Sensor, SensorKind

__all__ = ["Effect", "Situation", "bounds_by_label"]


class Situation(Protocol):
    """Information for an effect on the `Model` that contains it, or would contain it."""

    @property
    def robot(self) -> Robot:
        """Robot."""

    @property
    def orbit(self) -> Orbit | None:
        """Orbit of the robot, None in a laboratory."""

    @property
    def bodies(self) -> Sequence[BodyPrior]:
        """Priors of the bodies to identify."""

    @property
    def torque(self) -> TorqueSensor | None:
        """Sensors of the joint torques."""

    def sensor(self, kind: SensorKind) -> Sensor | None:
        """Return the sensor of a kind, or None if none is declared."""


class Effect:
    """Physical effect. To add one, subclass it, set ``name`` and ``parameters``, override hooks, and `register` it.

    Attributes
    ----------
    name : str
        Name in study files; an effect that needs a place is written ``name:place``.
    summary : str
        One sentence of a report on what the effect is.
    separated_by : str
        One sentence of a report on what characterises the effect and which manoeuvre separates it from rivals.
    parameters : tuple of Parameter
        Parameters with their units and priors.
    per_recording : bool
        Whether the values differ between recordings.
    is_body : bool
        Whether the parameters are the log-Cholesky coordinates of a body relative to the one that the model has.
    needs_orbit : bool
        Whether the effect exists only in orbit.
    needs_latitude : bool
        Whether the effect can be computed only if the recordings state their argument of latitude, in any orbit.
    states : int
        Number of inner states, zero at time 0.
    modes_count : int
        Number of vibration modes that `modes` returns.
    cause_kind : str
        Kind of cause in a diagnosis (`bayesid.diagnosis.candidates.cause_kind`).
    is_added_body : bool
        Whether the amplitudes are the ten moments of a rigid body that the model lacks.
    instants : tuple of float
        Instants [s] at which an effect sets in, for all recordings or for each; infinite where it does not.
    """

    name: ClassVar[str] = ""
    summary: ClassVar[str] = ""
    separated_by: ClassVar[str] = ""
    parameters: tuple[Parameter, ...] = ()
    per_recording: ClassVar[bool] = False
    is_body: ClassVar[bool] = False
    needs_orbit: ClassVar[bool] = False
    needs_latitude: ClassVar[bool] = False
    states: ClassVar[int] = 0
    modes_count: ClassVar[int] = 0
    cause_kind: ClassVar[str] = "linear"
    is_added_body: ClassVar[bool] = False
    instants: tuple[float, ...] = ()

    @classmethod
    def lacks(cls, model: Situation) -> str | None:
        """Return what the effect requires and the model lacks, None if nothing is missing.

        By default that is the orbit, for an effect that exists only in orbit.
        """
        return "[orbit]" if cls.needs_orbit and model.orbit is None else None

    @classmethod
    def instances(cls, model: Situation) -> Sequence[Effect]:
        """Return the effect at every place of a model's robot where it can occur and affect the model's sensors.

        By default it occurs once; it does not occur if the model lacks what it needs, or if the class needs arguments,
        such as a place, which cannot be guessed.
        """
        if cls.lacks(model) is not None:
            return []
        try:
            return [cls().attach(model.robot)]
        except (InputError, TypeError):
            return []

    @classmethod
    def members(cls) -> Sequence[type[Effect]]:
        """Return the effects that the registration of the class makes known, by default itself."""
        return [cls]

    @classmethod
    def uses_latitude(cls, orbit: Orbit | None) -> bool:
        """Return whether the argument of latitude matters; in an eccentric orbit, to every effect that needs one."""
        return cls.needs_latitude or (cls.needs_orbit and orbit is not None and orbit.eccentricity > 0.0)

    @property
    def longest_step(self) -> float:
        """Longest integration step that the effect allows [s]."""
        return float("inf")

    @property
    def quantities(self) -> Sequence[Quantity]:
        """Reported quantities of the effect, by default its parameters."""
        return [Quantity(parameter.name, parameter.unit) for parameter in self.parameters]

    def report(self, values: Array) -> Array:
        """Return the reported quantities for values of the parameters, shape (n,) -> (m,)."""
        return values

    def attach(self, robot: Robot) -> Self:
        """Return the effect on a robot, and raise an `InputError` if the robot has no such link or joint."""
        return self

    def in_study(self, longest: float | None, records_wheels: bool) -> Self | None:
        """Return the effect as a candidate in a study, None where the recordings exclude it; by default itself.

        Parameters
        ----------
        longest : float or None
            Length of the longest recording [s], None if it is not known.
        records_wheels : bool
            Whether the momentum of the wheels is recorded.
        """
        return self

    def shows_in(self, recordings: Sequence[Recording], blocks_per_second: float = 0.0) -> bool:
        """Return whether recordings can resolve the effect, by default true.

        Parameters
        ----------
        recordings : sequence of Recording
        blocks_per_second : float
            Rate above which their samples are averaged [1/s]; 0 keeps every sample.
        """
        return True

    def at(self, instants: Sequence[float]) -> Self:
        """Return the effect with other instants."""
        changed = copy.copy(self)
        changed.instants = tuple(instants)
        return changed

    def in_recording(self, index: int) -> Self:
        """Return the effect with the `table` and `jumps` of the recording with that index, by default itself.

        An effect whose constants differ between recordings, such as an instant, overrides this.
        """
        return self

    def jumps(self, end: float) -> Sequence[float]:
        """Return the instants [s] just after each jump of `table` in a recording of length ``end``."""
        return ()

    @property
    def starts(self) -> Sequence[Floats]:
        """Starting points of a fit, in coordinates of standard-normal prior, by default zero."""
        return [np.zeros(len(self.parameters))]

    @property
    def absent(self) -> Floats:
        """Values at which the effect vanishes, by default zero amplitudes and all others at their centre, shape (n,).

        An effect whose size is not given by amplitudes overrides this. An effect without parameters cannot vanish.
        """
        return np.array([0.0 if parameter.is_amplitude else parameter.mean for parameter in self.parameters])

    def in_amplitudes(self) -> Effect:
        """Return the effect with amplitudes as parameters, which vanish with it, for linear tests; by default itself.

        An effect whose prior is not centred where it vanishes overrides this together with `amplitudes`.
        """
        return self

    def amplitudes(self, values: Array) -> Array:
        """Return the parameters of `in_amplitudes` for values of the parameters."""
        return values

    @property
    def amplitude_quantities(self) -> Sequence[Quantity]:
        """Amplitudes that vanish with the effect, in which it is linear where it is small.

        By default they are the parameters of `in_amplitudes` that are zero only where the effect is absent; the others
        are shapes, such as a frequency or a place.
        """
        return [Quantity(parameter.name, parameter.unit) for parameter in self._amplitudes]

    @property
    def amplitude_units(self) -> tuple[str, ...]:
        """Units of `amplitude_quantities`, each once; the amplitudes of one unit share a scale."""
        return tuple(dict.fromkeys(quantity.unit for quantity in self.amplitude_quantities))

    @property
    def amplitude_shapes(self) -> Sequence[Sequence[float]]:
        """Standard deviations of `amplitude_quantities` relative to their scales, in equally probable forms of a prior.

        By default there is one form, in which all are one.
        """
        return [[1.0] * len(self.amplitude_quantities)]

    @property
    def _amplitudes(self) -> list[Parameter]:
        linear = self.in_amplitudes()
        pairs = zip(linear.parameters, linear.absent, strict=True)
        return [parameter for parameter, absent in pairs if parameter.is_amplitude or absent != parameter.mean]

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return the largest size of the amplitudes that is plausible, one bound for each of `amplitude_units`.

        By default it is the size at three standard deviations of the priors. An effect overrides this where the robot's
        mass and size, the orbit or the class of instrument says more.
        """
        return bounds_of_priors(self._amplitudes)

    def starts_near(self, resonances: Sequence[Resonance], alone: bool) -> Sequence[Floats]:
        """Return the starting points of a fit of a vibration, by default `starts`.

        Parameters
        ----------
        resonances : sequence of Resonance
            Resonances that the residual suggests, the strongest first.
        alone : bool
            Whether the effect is fitted without others, so that the cost of more starting points is acceptable.
        """
        return self.starts

    @property
    def reach_of_swing(self) -> float | None:
        """Largest distance from the base origin along an axis of a mass on equal springs [m]; None for other modes."""
        return None

    def tuned(self, values: Floats) -> Self:
        """Return the effect with settings that suit the values of its parameters, such as `longest_step`."""
        return self

    @property
    def label(self) -> str:
        """Name of the effect with its place, as in study files."""
        return self.name

    @property
    def candidate(self) -> str:
        """Name of the candidate cause that the effect is a form of; several forms may share one."""
        return self.label

    @property
    def entry(self) -> str:
        """Text that makes the effect with its settings, though not its priors, in the ``effects`` of a study file."""
        return self.label

    @property
    def link(self) -> str | None:
        """Link to which `table` belongs; None if it changes several, for which joint torques are not computed."""
        return None

    constant_names: ClassVar[tuple[str, ...]] = ()
    """Names of attributes with numbers, or trees of arrays, that compiled code takes as arguments (`EffectKey`)."""

    @property
    def constants(self) -> tuple[Any, ...]:
        """Values of the attributes that ``constant_names`` lists."""
        return tuple(getattr(self, name) for name in self.constant_names)

    def bound(self, constants: tuple[Any, ...]) -> Self:
        """Return the effect with other constants, which may be traced."""
        if not self.constant_names:
            return self
        changed = copy.copy(self)
        changed.__dict__.update(zip(self.constant_names, constants, strict=True))
        return changed

    def momentum(self, values: Array, instant: Instant, inner: Array) -> tuple[Array, Array]:
        """Return the angular momentum relative to the base and its derivative, as a free couple [N m s, N m].

        Parameters
        ----------
        values : (p,) array
            Values of the parameters.
        instant : Instant
            Motion and environment at one instant.
        inner : (states,) array
            Inner states of the effect.
        """
        return jnp.zeros(3), jnp.zeros(3)

    def wrench(self, values: Array, instant: Instant, inner: Array) -> Wrench:
        """Return the external force and its torque about the base origin [N, N m].

        Parameters
        ----------
        values : (p,) array
            Values of the parameters.
        instant : Instant
            Motion and environment at one instant.
        inner : (states,) array
            Inner states of the effect.
        """
        return Wrench(jnp.zeros(3), jnp.zeros(3))

    def derivative(self, values: Array, instant: Instant, inner: Array) -> Array:
        """Return the derivative of the inner states, shape (states,).

        Parameters
        ----------
        values : (p,) array
            Values of the parameters.
        instant : Instant
            Motion and environment at one instant.
        inner : (states,) array
            Inner states of the effect.
        """
        return jnp.zeros(self.states)

    def specific_force(self, values: Array, instant: Instant, lever: Array) -> Array:
        """Return the specific force at ``lever`` from the centre of mass beyond that of wrench and motion [m/s2].

        Parameters
        ----------
        values : (p,) array
            Values of the parameters.
        instant : Instant
            Motion and environment at one instant.
        lever : (3,) array
            Position of the point from the centre of mass [m].
        """
        return jnp.zeros(3)

    def gravity_gradient_tensor(self, values: Array, instant: Instant) -> Array:
        """Return the gravitational acceleration per distance from the centre of mass, shape (3, 3) [1/s2].

        Parameters
        ----------
        values : (p,) array
            Values of the parameters.
        instant : Instant
            Motion and environment at one instant.
        """
        return jnp.zeros((3, 3))

    def modes(self, values: Array) -> Modes:
        """Return the vibration modes."""
        raise NotImplementedError

    def table(self, robot: Robot, motion: Motion, time: Floats) -> Floats:
        """Return the changes of the tables (`bayesid.robot.composite_tables`) per coefficient, shape (T, 28, m).

        Parameters
        ----------
        robot : Robot
        motion : Motion
            Motion of the joints.
        time : (T,) array
            Instants [s].
        """
        return np.zeros((len(time), 28, 0))

    def loads(self, values: Array) -> Array:
        """Return the coefficients that multiply the columns of `table`, shape (m,)."""
        return jnp.zeros(0)

    def body_tables(
        self, robot: Robot, unknown: Sequence[str], motion: Motion, time: Floats
    ) -> list[tuple[str | None, Floats]]:
        """Return `table` in parts (T, 28, n), each with the link to which it belongs, for given unknown links.

        Parameters
        ----------
        robot : Robot
        unknown : sequence of str
            Links whose parameters are unknown.
        motion : Motion
            Motion of the joints.
        time : (T,) array
            Instants [s].
        """
        return [(self.link, self.table(robot, motion, time))]

    def body_loads(self, values: Array, inertial: Array) -> Array:
        """Return the coefficients of the columns of `body_tables`, given ten parameters of each unknown link.

        Parameters
        ----------
        values : (p,) array
            Values of the parameters.
        inertial : (10 B,) array
            Ten linear parameters of each of B unknown links.
        """
        return self.loads(values)

    def read(self, values: Array, readings: Readings) -> Readings:
        """Return the readings of faulty sensors from the true readings, in sensor axes.

        Parameters
        ----------
        values : (p,) array
            Values of the parameters.
        readings : Readings
            True readings of one recording.
        """
        return readings

    def friction(self, values: Array, velocity: Array) -> Array:
        """Return the motor torques (T, n) in addition to those that move the bodies, at joint speeds (T, n).

        Parameters
        ----------
        values : (p,) array
            Values of the parameters.
        velocity : (T, n) array
            Speeds of all joints [rad/s or m/s].
        """
        return jnp.zeros_like(velocity)

    def uses(self, hook: str) -> bool:
        """Return whether the class overrides a hook."""
        return getattr(type(self), hook) is not getattr(Effect, hook)


def bounds_by_label(
    effects: Sequence[Effect], model: Situation, stated: Mapping[str, Sequence[PhysicalBound]] | None = None
) -> dict[str, tuple[PhysicalBound, ...]]:
    """Return the bounds of effects by their labels, in the order of `Effect.amplitude_units`.

    Parameters
    ----------
    effects : sequence of Effect
        Effects that are attached to the model's robot, such as those of `Effect.instances`.
    model : Situation
        Robot and orbit from which the bounds follow.
    stated : mapping of str to sequence of PhysicalBound, optional
        Bounds by label that the user states; each replaces the bound of its unit.

    Raises
    ------
    InputError
        If a stated bound belongs to no effect, or to none of the effect's units.
    """
    bounds = {effect.label: {bound.unit: bound for bound in effect.physical_bounds(model)} for effect in effects}
    for label, better in ({} if stated is None else stated).items():
        if label not in bounds:
            raise InputError(
                f"a bound is stated for {label!r}, which is not among the effects",
                remedy=f"Choose from {', '.join(bounds)}",
            )
        for bound in better:
            if bound.unit not in bounds[label]:
                raise InputError(
                    f"a bound of {label!r} is stated in {bound.unit!r}", remedy=f"Use one of {', '.join(bounds[label])}"
                )
            bounds[label][bound.unit] = bound
    return {label: tuple(units.values()) for label, units in bounds.items()}
