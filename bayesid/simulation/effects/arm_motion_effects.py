"""Effects of joints that move differently from what the recording says."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Self

import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._math.arrays import Floats, Traceable, namespace
from bayesid.recording.joint_motion import Motion
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import kinematics
from bayesid.robot.robot import Robot
from bayesid.simulation.effects.displaced_motion import Deflection, Displaced, DisplacedMotion
from bayesid.simulation.effects.effect import Effect, Situation
from bayesid.simulation.effects.effect_parameters import Parameter, PhysicalBound, Prior
from bayesid.simulation.effects.placed import OnJoint
from bayesid.simulation.effects.register import register

__all__ = ["EncoderOffset", "JointFlexibility", "JointLatency"]

LARGEST_OFFSET, LARGEST_OFFSET_OF_SLIDE = 0.1, 0.05
"""Largest plausible error of a joint's zero [rad, m]; assumed, since the eye would see more."""

LARGEST_DELAY = 1.0
"""Largest plausible delay of a time stamp [s], a cycle of slow telemetry."""

SOFTEST, STRONGEST_DAMPING = 0.1, 0.2
"""Lowest plausible frequency of a joint with what hangs on it [Hz], and largest damping ratio; assumed."""

OFFSET_STEP = 0.02
"""Joint offset at which the tables are sampled for a quadratic [rad or m], with an error below 1e-5 at 0.03 rad."""


@register
class EncoderOffset(DisplacedMotion, OnJoint):
    """Constant error of a joint's recorded position: recorded = true + offset.

    The prior of 0.02 rad is about one degree; that of a prismatic joint is 0.02 m.
    """

    name = "encoder-offset"
    summary = "The joint's encoder has a wrong zero: the posture of the arm differs from the recorded posture."
    separated_by = (
        "The links are not where the recording places them: move that joint through a different range with the others "
        "still; the offset remains constant, whereas an apparent mass error changes."
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

    def displaced(self, robot: Robot, motion: Motion, time: Floats) -> Displaced:
        """Return the first and second differences in the position of the joint."""
        unit = np.eye(len(robot.joints))[self.index_in(robot)]
        state = motion.evaluate(time)
        motions = [
            kinematics(robot, state._replace(position=state.position + step * unit))
            for step in (-OFFSET_STEP, 0.0, OFFSET_STEP)
        ]
        first = np.array([-0.5, 0.0, 0.5]) / OFFSET_STEP
        second = np.array([0.5, -1.0, 0.5]) / OFFSET_STEP**2
        return Displaced(motions, np.stack([first, second]))

    def loads(self, values: Array) -> Array:
        """Return the powers of the offset, with the sign of true less recorded position."""
        return jnp.stack([-values[0], values[0] ** 2])


LATENCY_STEP = 0.15
"""Distance in time of the samples to which a quartic in the delay is fitted [s]."""


@register
class JointLatency(DisplacedMotion):
    """Delay of the recorded joint motion: the position stamped t is that of t - delay.

    The prior of 0.2 s is a few cycles of a slow data bus.
    """

    name = "joint-latency"
    summary = "The recorded joint motion is late: the arm is already ahead of its recorded position."
    separated_by = (
        "The error grows with speed: repeat the same motion twice as fast; the effects of body errors remain "
        "proportional to the motion, whereas those of a delay grow with frequency."
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

    def displaced(self, robot: Robot, motion: Motion, time: Floats) -> Displaced:
        """Return the coefficients of the quartic through five samples in time."""
        shifts = LATENCY_STEP * np.arange(-2, 3)
        motions = [kinematics(robot, motion.evaluate(time + shift)) for shift in shifts]
        return Displaced(motions, np.linalg.inv(np.vander(shifts, increasing=True))[1:])

    def loads(self, values: Array) -> Array:
        """Return the powers of the delay, by which the arm is ahead of its record."""
        return values[0] ** jnp.arange(1, 5)


@register
class JointFlexibility(DisplacedMotion, OnJoint):
    """Compliance of a joint, whose link side follows the measured motor side on a damped spring.

    ``frequency`` is that of all bodies beyond the joint on the spring, with the base fixed and all joints at zero, so
    that one frequency is one stiffness in all recordings. The deflection follows the torque through the joint if the
    motion is slow compared with that frequency; it is computed to second order in the ratio of frequencies, which is
    accurate above about 0.2 Hz. The ringing of the spring after jumps of the joint acceleration is omitted: with
    trapezoidal speed profiles a residual remains in addition to the joint's compliance. The deflection and the
    displacement of the links are computed with the bodies of the robot, and with the centres of the priors for unknown
    ones: the displacement of a load far from its prior's centre is wrong. A diagnosis weighs two amplitudes: the
    compliance 1 / omega^2 and the damping lag 2 damping / omega^3, with omega = 2 pi frequency.
    """

    name = "joint-flexibility"
    summary = (
        "The joint's gear is elastic: the bodies beyond the joint lag behind the encoder when the arm accelerates."
    )
    separated_by = (
        "The deflection grows with the joint's acceleration: repeat the motion of that joint at twice the speed."
    )

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

    def displaced(self, robot: Robot, motion: Motion, time: Floats) -> Displaced:
        """Return the displacements by the deflection under the joint's torque, and by its derivatives."""
        index, state = self.index_in(robot), motion.evaluate(time)
        deflection = Deflection(robot, motion, index, float(time.max()))
        motions = []
        for order in (0, 2, 1):
            for sign in (-1.0, 1.0):
                changed = [np.array(values) for values in state]
                for derivative in range(3):
                    changed[derivative][:, index] += sign * deflection.derivative(time, order + derivative)
                motions.append(kinematics(robot, JointState(*changed)))
        return Displaced(motions, np.kron(np.eye(3), [-0.5, 0.5]))

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
