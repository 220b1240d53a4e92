"""Effects of joints that move differently from what the recording says."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import NamedTuple, Self, cast

import jax.numpy as jnp
import numpy as np
import pinocchio as pin
from jax import Array
from scipy.interpolate import make_interp_spline

from bayesid._math.arrays import Floats, Traceable, namespace
from bayesid.recording.joint_motion import MeasuredMotion, Motion
from bayesid.robot.composite_tables import composite_rows, link_table
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import Kinematics, configuration, kinematics
from bayesid.robot.robot import Robot
from bayesid.simulation.effects.effect import Effect, Situation
from bayesid.simulation.effects.effect_parameters import Parameter, PhysicalBound, Prior, Quantity
from bayesid.simulation.effects.placed import OnJoint
from bayesid.simulation.effects.register import register

__all__ = ["EncoderOffset", "JointBacklash", "JointFlexibility", "JointLatency"]

LARGEST_OFFSET, LARGEST_OFFSET_OF_SLIDE = 0.1, 0.05
"""Largest plausible error of a joint's zero [rad, m]; assumed, since the eye would see more."""

LARGEST_DELAY = 1.0
"""Largest plausible delay of a time stamp [s], a cycle of slow telemetry."""

SOFTEST, STRONGEST_DAMPING = 0.1, 0.2
"""Lowest plausible frequency of a joint with what hangs on it [Hz], and largest damping ratio; assumed."""

OFFSET_STEP = 0.02
"""Joint offset at which the tables are sampled for a quadratic [rad or m], with an error below 1e-5 at 0.03 rad."""


class _DisplacedMotion(Effect):
    """Effect that displaces links against the recorded motion.

    It changes the tables of all bodies that the links carry. The tables of bodies with unknown parameters change in
    proportion to those parameters and are therefore kept apart from those of the known bodies. The effect on joint
    torques is left out.
    """

    @classmethod
    def instances(cls, model: Situation) -> Sequence[Effect]:
        """Return the effect wherever it can occur, and nowhere in a model with torque sensors."""
        return [] if model.torque is not None else super().instances(model)

    def displaced(self, robot: Robot, motion: Motion, time: Floats) -> _Displaced:
        """Return the change of the links' motion at T instants, with the parameters of `table`."""
        raise NotImplementedError

    def table(self, robot: Robot, motion: Motion, time: Floats) -> Floats:
        """Return the change of the tables of all bodies with the robot's parameters, (T, 28, m)."""
        change = self.displaced(robot, motion, time)
        return change.weighted([composite_rows(robot, moved) for moved in change.motions])

    def body_tables(
        self, robot: Robot, unknown: Sequence[str], motion: Motion, time: Floats
    ) -> list[tuple[str | None, Floats]]:
        """Return the changes of the known bodies' table, (T, 28, m), and of each unknown body's, (T, 28, 10 m)."""
        change = self.displaced(robot, motion, time)
        known = change.weighted([composite_rows(robot, moved, leave_out=unknown) for moved in change.motions])
        tables: list[tuple[str | None, Floats]] = [(None, known)]
        for name in unknown:
            table = change.weighted([link_table(robot, name, moved) for moved in change.motions])
            tables.append((None, table.reshape(*table.shape[:2], -1)))
        return tables

    def body_loads(self, values: Array, inertial: Array) -> Array:
        """Return the coefficients, then for each unknown body their products with its ten parameters."""
        coefficients = self.loads(values)
        products = coefficients[None, :, None] * inertial.reshape(-1, 1, 10)
        return jnp.concatenate([coefficients, products.ravel()])


@register
class EncoderOffset(_DisplacedMotion, OnJoint):
    """Constant error of a joint's recorded position: recorded = true + offset.

    The prior of 0.02 rad is about one degree; that of a prismatic joint is 0.02 m.
    """

    name = "encoder-offset"
    summary = "The joint's encoder has a wrong zero: the posture of the arm differs from the recorded posture."
    separated_by = (
        "It acts like a wrong posture: move that joint through a different range with the others still; the offset "
        "remains constant, whereas an apparent mass error changes."
    )

    def __init__(self, place: str = "", sigma: float = 0.02) -> None:
        super().__init__(place)
        self.parameters = (Parameter("offset", "rad", sigma),)

    def attach(self, robot: Robot) -> Self:
        """Return the effect with the unit of its joint's position."""
        changed = copy.copy(self)
        unit = robot.joints[self.index_in(robot)].unit
        changed.parameters = tuple(parameter._replace(unit=unit) for parameter in self.parameters)
        return changed

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return a zero error that is visible to the eye."""
        if model.robot.joints[self.index_in(model.robot)].kind == "prismatic":
            reason = (
                f"On a prismatic joint, a zero error of more than {LARGEST_OFFSET_OF_SLIDE:g} m is visible to the eye."
            )
            return (PhysicalBound("m", LARGEST_OFFSET_OF_SLIDE, reason),)
        reason = f"On a joint, a zero error of more than {LARGEST_OFFSET:g} rad, six degrees, is visible to the eye."
        return (PhysicalBound("rad", LARGEST_OFFSET, reason),)

    def displaced(self, robot: Robot, motion: Motion, time: Floats) -> _Displaced:
        """Return the first and second differences in the position of the joint."""
        unit = np.eye(len(robot.joints))[self.index_in(robot)]
        state = motion.evaluate(time)
        motions = [
            kinematics(robot, state._replace(position=state.position + step * unit))
            for step in (-OFFSET_STEP, 0.0, OFFSET_STEP)
        ]
        first = np.array([-0.5, 0.0, 0.5]) / OFFSET_STEP
        second = np.array([0.5, -1.0, 0.5]) / OFFSET_STEP**2
        return _Displaced(motions, np.stack([first, second]))

    def loads(self, values: Array) -> Array:
        """Return the powers of the offset, with the sign of true less recorded position."""
        return jnp.stack([-values[0], values[0] ** 2])


LATENCY_STEP = 0.15
"""Distance in time of the samples to which a quartic in the delay is fitted [s]."""


@register
class JointLatency(_DisplacedMotion):
    """Delay of the recorded joint motion: the position stamped t is that of t - delay.

    The prior of 0.2 s is a few cycles of a slow data bus.
    """

    name = "joint-latency"
    summary = "The recorded joint motion is late: the arm is already ahead of its recorded position."
    separated_by = (
        "It grows with speed: repeat the same motion twice as fast; the effects of body errors remain proportional to "
        "the motion, whereas those of a delay grow with frequency."
    )

    @classmethod
    def instances(cls, model: Situation) -> Sequence[Effect]:
        """Return the effect if the robot has a moving joint."""
        return super().instances(model) if model.robot.joints else []

    def __init__(self, sigma: float = 0.2) -> None:
        self.parameters = (Parameter("delay", "s", sigma),)

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return a cycle of slow telemetry."""
        return (PhysicalBound("s", LARGEST_DELAY, "Slow telemetry stamps its samples once per second."),)

    def displaced(self, robot: Robot, motion: Motion, time: Floats) -> _Displaced:
        """Return the coefficients of the quartic through five samples in time."""
        shifts = LATENCY_STEP * np.arange(-2, 3)
        motions = [kinematics(robot, motion.evaluate(time + shift)) for shift in shifts]
        return _Displaced(motions, np.linalg.inv(np.vander(shifts, increasing=True))[1:])

    def loads(self, values: Array) -> Array:
        """Return the powers of the delay, by which the arm is ahead of its record."""
        return values[0] ** jnp.arange(1, 5)


@register
class JointFlexibility(_DisplacedMotion, OnJoint):
    """Compliance of a joint, whose link side follows the measured motor side on a damped spring.

    ``frequency`` is that of all bodies beyond the joint on the spring, with the base fixed and all joints at zero, so
    that one frequency is one stiffness in all recordings. The deflection follows the torque through the joint if the
    motion is slow compared with that frequency; it is computed to second order in the ratio of frequencies, which is
    accurate above about 0.2 Hz. The ringing of the spring after jumps of the joint acceleration is omitted: with
    trapezoidal speed profiles a residual remains in addition to the joint's compliance. The deflection and the
    displacement of the links are computed with the bodies of the robot, and with the centres of the priors for unknown
    ones: the displacement of a load far from its prior's centre is wrong.
    """

    name = "joint-flexibility"
    summary = (
        "The joint's gear is elastic: the bodies beyond the joint lag behind the encoder when the arm accelerates."
    )
    separated_by = "It grows with the joint's acceleration: repeat the motion of that joint at twice the speed."

    def __init__(self, place: str = "", frequency: float = 1.0, spread: float = 0.7) -> None:
        super().__init__(place)
        self.parameters = (
            Parameter("frequency", "Hz", spread, frequency, Prior.LOG_NORMAL),
            Parameter("damping", "1", 1.0, 0.03, Prior.LOG_NORMAL),
        )

    @property
    def starts(self) -> Sequence[Floats]:
        """Starting point of a stiff joint, where the fit is nearly linear in the compliance."""
        return [np.array([1.5, 0.0])]

    @property
    def absent(self) -> Floats:
        """Values of a rigid joint, which has an infinite frequency."""
        return np.array([np.inf, self.parameters[1].mean])

    def in_amplitudes(self) -> Effect:
        """Return the effect with its compliance and the lag of its damping as parameters."""
        return _JointCompliance(self)

    def amplitudes(self, values: Traceable) -> Traceable:
        """Return the compliance and the lag, each times the inertia beyond the joint at zero."""
        omega = 2.0 * np.pi * values[0]
        return namespace(values).stack([omega**-2, 2.0 * values[1] * omega**-3])

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return the compliance of the softest joints, and the lag of strong damping in them."""
        omega = 2.0 * float(np.pi) * SOFTEST
        soft = f"Only the longest arms with heavy payloads have frequencies as low as {SOFTEST:g} Hz"
        return (
            PhysicalBound("s2", omega**-2, f"{soft}."),
            PhysicalBound(
                "s3", 2.0 * STRONGEST_DAMPING * omega**-3, f"{soft}, with a damping ratio of {STRONGEST_DAMPING:g}."
            ),
        )

    def displaced(self, robot: Robot, motion: Motion, time: Floats) -> _Displaced:
        """Return the displacements by the deflection under the joint's torque, and by its derivatives."""
        index, state = self.index_in(robot), motion.evaluate(time)
        deflection = _Deflection(robot, motion, index, float(time.max()))
        motions = []
        for order in (0, 2, 1):
            for sign in (-1.0, 1.0):
                changed = [np.array(values) for values in state]
                for derivative in range(3):
                    changed[derivative][:, index] += sign * deflection.derivative(time, order + derivative)
                motions.append(kinematics(robot, JointState(*changed)))
        return _Displaced(motions, np.kron(np.eye(3), [-0.5, 0.5]))

    # on a floating base, changes in proportion to the parameters of unknown bodies would be far too large
    body_tables, body_loads = Effect.body_tables, Effect.body_loads

    def loads(self, values: Array) -> Array:
        """Return the coefficients of the oscillator's slow response, expanded in the inverse of its frequency."""
        omega, damping = 2.0 * jnp.pi * values[0], values[1]
        return jnp.stack([omega**-2, -(1.0 - 4.0 * damping**2) * omega**-4, -2.0 * damping * omega**-3])


class _JointCompliance(JointFlexibility):
    """Flexible joint with parameters in which it is linear to first order, on the scales of the prior's median."""

    def __init__(self, flexibility: JointFlexibility) -> None:
        super().__init__(flexibility.place)
        median = flexibility.amplitudes(np.array([parameter.mean for parameter in flexibility.parameters]))
        self.parameters = (
            Parameter("compliance", "s2", float(median[0])),
            Parameter("damping-lag", "s3", float(median[1])),
        )

    starts, absent = Effect.starts, Effect.absent
    in_amplitudes, amplitudes = Effect.in_amplitudes, Effect.amplitudes

    def loads(self, values: Array) -> Array:
        """Return the compliance and the lag as coefficients of the deflection and its speed."""
        return jnp.stack([values[0], jnp.zeros(()), -values[1]])


LARGEST_GAP, LARGEST_GAP_OF_SLIDE = 0.01, 1.0e-3
"""Largest plausible play of a joint [rad, m]; assumed, since the hand would feel more."""

TYPICAL_GAP = 1.0e-3
"""Play for which the time is computed that a link takes to cross it [rad or m]."""

QUICKEST, SLOWEST = 0.05, 5.0
"""Shortest and longest time of a crossing [s]."""

UNLOADED = 1.0e-3
"""Torque through a joint, or its speed, relative to the largest below which it presses to neither side."""

FINE = 20
"""Instants per interval between knots at which the sign of the torque is looked at."""


@register
class JointBacklash(_DisplacedMotion, OnJoint):
    """Play of a joint: the link is offset from the encoder, at one side of a gap, and occasionally crosses the gap.

    One of two mechanisms presses it to a side. Without friction it is the torque through the joint: the flank that
    drives the link pushes it from behind, so that it trails the encoder in the direction of its acceleration. When the
    torque changes its sign, the link coasts from one flank to the other; the duration follows from the slope of the
    torque and a gap of `TYPICAL_GAP`; the impact at the end is omitted. The torque is that of the robot's bodies, with
    the centres of the priors for unknown ones. With friction, such as that of its bearing and cables, the link trails
    in the direction of its motion. When the joint reverses, either the encoder moves on evenly and the link waits until
    the gap is crossed, or the link moves on evenly and the encoder leaps; the leap has the form that it has in the
    smoothed recording. In a gear with some friction, each mechanism contributes a part.
    """

    name = "joint-backlash"
    summary = (
        "The joint has play: the bodies beyond it shift by the gap when the torque through the joint reverses or, with "
        "friction, when the joint reverses its motion."
    )
    separated_by = (
        "It jumps when the joint's torque or motion reverses, by the same angle at any speed: accelerate and brake "
        "that joint slowly and fast."
    )

    def __init__(self, place: str = "", sigma: float = TYPICAL_GAP) -> None:
        super().__init__(place)
        self.parameters = tuple(Parameter(name, "rad", sigma) for name in ("coasting", "waiting", "leaping"))

    def attach(self, robot: Robot) -> Self:
        """Return the effect with the unit of its joint's position."""
        changed = copy.copy(self)
        unit = robot.joints[self.index_in(robot)].unit
        changed.parameters = tuple(parameter._replace(unit=unit) for parameter in self.parameters)
        return changed

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return a play that can be felt by hand."""
        if model.robot.joints[self.index_in(model.robot)].kind == "prismatic":
            reason = f"On a prismatic joint, more than {LARGEST_GAP_OF_SLIDE:g} m of play can be felt by hand."
            return (PhysicalBound("m", LARGEST_GAP_OF_SLIDE, reason),)
        reason = f"On a joint, more than {LARGEST_GAP:g} rad of play, half a degree, can be felt by hand."
        return (PhysicalBound("rad", LARGEST_GAP, reason),)

    @property
    def quantities(self) -> Sequence[Quantity]:
        """The gap, and its shares."""
        shares = super().quantities
        return [Quantity("gap", shares[0].unit), *shares]

    def report(self, values: Array) -> Array:
        """Return the gap, and its shares."""
        return jnp.concatenate([values.sum(keepdims=True), values])

    def displaced(self, robot: Robot, motion: Motion, time: Floats) -> _Displaced:
        """Return the displacements of the link per gap of each kind, as central differences."""
        index, state = self.index_in(robot), motion.evaluate(time)
        deflection = _Deflection(robot, motion, index, float(time.max()))
        first, turns = _reversals(
            fine := _finely(*deflection.span), np.asarray(motion.evaluate(fine).velocity)[:, index]
        )

        def leap(at: Floats) -> Floats:
            return _lagging(at, first, [(turn, QUICKEST) for turn in turns])

        smoothed = motion.joints[index].of_course(leap) if isinstance(motion, MeasuredMotion) else None
        # the link rests until the motor, which has this acceleration, has crossed the gap
        waits = [(turn, float(np.clip((2.0 * TYPICAL_GAP / turn.slope) ** 0.5, QUICKEST, SLOWEST))) for turn in turns]
        sides = (
            _side_by_torque(deflection, time),
            _lagging(time, first, waits),
            leap(time) if smoothed is None else smoothed.evaluate(time),
        )
        motions = []
        for side in sides:
            for sign in (-1.0, 1.0):
                changed = [np.array(values) for values in state]
                for derivative in range(3):
                    changed[derivative][:, index] += sign * TYPICAL_GAP * side[derivative]
                motions.append(kinematics(robot, JointState(*changed)))
        return _Displaced(motions, np.kron(np.eye(3), [-0.5, 0.5]) / TYPICAL_GAP)

    def loads(self, values: Array) -> Array:
        """Return the gaps."""
        return values


class _Reversal(NamedTuple):
    """Change of the sign of a course: when it is zero, its slope there, and the side that it takes, 1 or -1."""

    time: float
    slope: float
    side: float


def _reversals(times: Floats, course: Floats) -> tuple[float, list[_Reversal]]:
    """Return the first sign of a course (n,) at some times (n,), and its changes; where it is small it has none."""
    loaded = np.flatnonzero(np.abs(course) > UNLOADED * np.abs(course).max(initial=0.0))
    if not len(loaded):
        return 0.0, []
    signs = np.sign(course[loaded])
    after = loaded[1:][signs[1:] != signs[:-1]]
    slopes = np.abs(course[after] - course[after - 1]) / (times[after] - times[after - 1])
    zeros = times[after] - np.abs(course[after]) / slopes
    changes = [_Reversal(*map(float, each)) for each in zip(zeros, slopes, np.sign(course[after]), strict=True)]
    return float(signs[0]), changes


def _across(time: Floats, crossing: _Reversal, lasts: float, power: int) -> Floats:
    """Return the way across the gap, from 0 to 1 in some time, with two derivatives at the times (T,): shape (3, T)."""
    x = np.clip((time - crossing.time) / lasts, 0.0, 1.0)
    there = x < 1.0
    first = there * power * x ** (power - 1) / lasts
    second = (there & (x > 0.0)) * power * (power - 1) * x ** (power - 2) / lasts**2
    return crossing.side * np.stack([x**power, first, second])


def _side_by_torque(deflection: _Deflection, time: Floats) -> Floats:
    """Return where in the gap a link lies, from -1/2 to 1/2, with two derivatives at the times (T,): shape (3, T).

    Parameters
    ----------
    deflection : _Deflection
        Negative torque through the joint by the inertia beyond it.
    time : (T,) array
        Times [s].
    """
    fine = _finely(*deflection.span)
    first, reversals = _reversals(fine, deflection.derivative(fine, 0))
    side = np.zeros((3, len(time)))
    side[0] = 0.5 * first
    for crossing in reversals:
        # beside a motor that loses on it with this jerk, a coasting link crosses the gap in the third root of 6 g/j
        jerk = crossing.slope * np.interp(crossing.time, *deflection.mobility)
        side += _across(time, crossing, float(np.clip((6.0 * TYPICAL_GAP / jerk) ** (1.0 / 3.0), QUICKEST, SLOWEST)), 3)
    return side


def _lagging(time: Floats, first: float, turns: Sequence[tuple[_Reversal, float]]) -> Floats:
    """Return where in the gap a link lies that lags the motion of its joint, shape (3, T), as `_side_by_torque`.

    Parameters
    ----------
    time : (T,) array
        Times [s].
    first : float
        Sign of the joint's speed at first.
    turns : sequence of pairs
        Changes of that sign, each with the time that it takes to cross the gap [s].
    """
    side = np.zeros((3, len(time)))
    side[0] = -0.5 * first
    for turn, lasts in turns:
        side -= _across(time, turn, lasts, 2)
    return side


def _finely(begin: float, end: float) -> Floats:
    return np.linspace(begin, end, FINE * max(int((end - begin) / KNOTS), 1) + 1)


KNOTS = 0.5
"""Interval between the instants at which a joint's torque is computed [s]."""

DEGREE = 5
"""Of the spline through the torques, whose derivatives up to the fourth are taken."""


class _Deflection:
    """Negative torque through a joint divided by the inertia beyond it at zero [1/s2], as a function of time."""

    def __init__(self, robot: Robot, motion: Motion, index: int, end: float) -> None:
        knots = np.linspace(0.0, end, max(int(np.ceil(end / KNOTS)), DEGREE) + 1)
        model = _loaded(robot)
        data = model.createData()
        state = motion.evaluate(knots)
        beyond = pin.crba(model, data, configuration(robot, np.zeros(len(robot.joints))))[6 + index, 6 + index]
        places = [configuration(robot, position) for position in state.position]
        upper = np.triu(np.stack([np.array(pin.crba(model, data, q)) for q in places]))
        mass = upper + np.swapaxes(np.triu(upper, 1), 1, 2)
        # the base floats with zero momentum and without an external wrench
        speed, acceleration = state.velocity[..., None], state.acceleration[..., None]
        base_speed = -np.linalg.solve(mass[:, :6, :6], mass[:, :6, 6:] @ speed)
        speeds = np.concatenate([base_speed, speed], axis=1)[..., 0]
        drift = np.stack([pin.nonLinearEffects(model, data, q, v).copy() for q, v in zip(places, speeds, strict=True)])
        base = -np.linalg.solve(mass[:, :6, :6], mass[:, :6, 6:] @ acceleration + drift[:, :6, None])
        torque = mass[:, 6 + index, None] @ np.concatenate([base, acceleration], axis=1)
        ratio = -(torque[:, 0, 0] + drift[:, 6 + index]) / beyond
        self.spline = make_interp_spline(knots, ratio, k=DEGREE)
        # inertia beyond the joint over that which resists the joint's torque, with the base free and others driven
        free = np.ix_(range(len(knots)), [*range(6), 6 + index], [*range(6), 6 + index])
        self.mobility = knots, beyond * np.linalg.inv(mass[free])[:, 6, 6]
        self.span = (knots[0], knots[-1])

    def derivative(self, time: Floats, order: int) -> Floats:
        """Return the derivative of an order at the times (T,)."""
        return np.asarray(self.spline(np.clip(time, *self.span), nu=order))


def _loaded(robot: Robot) -> pin.Model:
    """Return Pinocchio's model with the links and loads that the robot has now."""
    model = robot.model.copy()
    for joint in range(1, model.njoints):
        model.inertias[joint] = pin.Inertia.Zero()
    for link in robot.links.values():
        if link.inertial.mass > 0.0:
            model.inertias[link.joint + 2] += pin.SE3(link.placement).act(
                pin.Inertia.FromDynamicParameters(link.inertial.vector)
            )
    return model


class _Displaced(NamedTuple):
    """Change of the motion of all links, as a weighted sum over motions with m coefficients.

    The change of any body's kinematic table is ``sum_k c_k sum_s weights[k, s] table(motions[s])``, where the c_k are
    the effect's coefficients (`Effect.loads`).

    Attributes
    ----------
    motions : (S,) sequence of Kinematics
        Motions of the joint frames.
    weights : (m, S) array
        Weights of the motions for each coefficient.
    """

    motions: Sequence[Kinematics]
    weights: Floats

    def weighted(self, tables: Sequence[Floats]) -> Floats:
        """Return the weighted sums (T, 28, m, ...) of tables along the motions, each (T, 28, ...)."""
        xp = namespace(tables[0])
        return cast("Floats", xp.einsum("ks,std...->tdk...", self.weights, xp.stack(list(tables))))
