"""Effect of the play of a joint."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple, Self

import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.polynomial import Polynomial

from bayesid._math.arrays import Floats
from bayesid.recording.joint_motion import MeasuredMotion, Motion
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import kinematics
from bayesid.robot.robot import Robot
from bayesid.simulation.effects.displaced_motion import KNOTS, Deflection, Displaced, DisplacedMotion
from bayesid.simulation.effects.effect import Situation
from bayesid.simulation.effects.effect_parameters import Parameter, PhysicalBound, Quantity
from bayesid.simulation.effects.placed import OnJoint
from bayesid.simulation.effects.register import register

__all__ = ["JointBacklash"]

LARGEST_GAP, LARGEST_GAP_OF_SLIDE = 0.01, 1.0e-3
"""Largest plausible play of a joint [rad, m]; assumed, since the hand would feel more."""

TYPICAL_GAP = 1.0e-3
"""Play for which the time is computed that a link takes to cross it [rad or m]."""

QUICKEST, SLOWEST = 0.05, 5.0
"""Shortest and longest time of a crossing [s]."""

CREEPING = {"sharp": 3.0e-4, "even": 1.0e-3, "soft": 3.0e-3}
"""Speeds below which friction does not press a link fully to one side, half a decade apart [rad/s or m/s]."""

BRIDGED, NEARBY = 0.4, 2.0
"""Time before and after a reversal in which the smoothed record holds what the encoder leaps, and time within which its
speed is that of the motion again [s]."""

ROUNDING = 1.0e-9
"""Imaginary part of a root that is real [s]."""

CUBIC = 3
"""Degree of the polynomial by which the speed passes through zero."""

UNLOADED, SLOW = 1.0e-3, 1.0e-2
"""Torque through a joint, and its speed, relative to the largest below which they move the link to no other side."""

FINE = 20
"""Instants per interval between knots at which the sign of the torque is looked at."""


@register
class JointBacklash(DisplacedMotion, OnJoint):
    """Play of a joint: the link is offset from the encoder, at one side of a gap, and occasionally crosses the gap.

    Its parameters are the offsets of three mechanisms.

    Coasting, without friction: the flank that drives the link pushes it from behind, so that the link trails the
    encoder in the direction of its acceleration. When the torque through the joint changes its sign, the link coasts
    to the other flank; the duration follows from the slope of the torque and a gap of 1 mrad (or 1 mm). The impact at
    the end is omitted. The torque is that of the robot's bodies, with the centres of the priors for unknown ones.

    Waiting, with the friction of a bearing or cables: the link trails the encoder in the direction of its motion.
    When the joint reverses, the link stands still until the gap is crossed.

    Leaping, also with friction: when the motor reverses, the link continues to move at an even rate while the motor
    side crosses the gap and the friction changes its sign; the slower the motion, the longer this takes. Three shapes,
    sharp, even and soft, stand for three speeds of crossing and together approximate any friction. They are shapes
    after the smoothing of the recording.
    """

    name = "joint-backlash"
    summary = (
        "The joint has play: the bodies beyond it shift by the gap when the torque through the joint reverses or, with "
        "friction, when the joint reverses its motion."
    )
    separated_by = (
        "The offset jumps when the joint's torque or motion reverses, by the same angle at any speed: accelerate and "
        "brake that joint slowly and fast."
    )

    _kinds = ("coasting", "waiting", *(f"leaping.{name}" for name in CREEPING))

    def __init__(self, place: str = "", sigma: float = TYPICAL_GAP) -> None:
        super().__init__(place)
        self.parameters = tuple(Parameter(name, "rad", sigma) for name in self._kinds)

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

    def displaced(self, robot: Robot, motion: Motion, time: Floats) -> Displaced:
        """Return the displacements of the link per gap of each kind, as central differences."""
        index, state = self.index_in(robot), motion.evaluate(time)
        deflection = Deflection(robot, motion, index, float(time.max()))
        speed = _Speed.of(motion, index, *deflection.span)
        # the link rests until the motor, which has this acceleration, has crossed the gap
        times = [(2.0 * TYPICAL_GAP / turn.slope) ** 0.5 for turn in speed.turns]
        waits = [(turn, float(np.clip(one, QUICKEST, SLOWEST))) for turn, one in zip(speed.turns, times, strict=True)]
        sides = (
            _side_by_torque(deflection, time),
            _lagging(time, speed.first, waits),
            *(speed.leap(time, creeping) for creeping in CREEPING.values()),
        )
        motions = []
        for side in sides:
            for sign in (-1.0, 1.0):
                changed = [np.array(values) for values in state]
                for derivative in range(3):
                    changed[derivative][:, index] += sign * TYPICAL_GAP * side[derivative]
                motions.append(kinematics(robot, JointState(*changed)))
        return Displaced(motions, np.kron(np.eye(len(sides)), [-0.5, 0.5]) / TYPICAL_GAP)

    def loads(self, values: Array) -> Array:
        """Return the gaps."""
        return values


class _Reversal(NamedTuple):
    """Change of the sign of a course: when it is zero, its slope there, and the side that it takes, 1 or -1."""

    time: float
    slope: float
    side: float


def _reversals(times: Floats, course: Floats, least: float) -> tuple[float, list[_Reversal]]:
    """Return the first sign of a course (n,) at some times (n,), and its changes; below a share of it, it has none."""
    loaded = np.flatnonzero(np.abs(course) > least * np.abs(course).max(initial=0.0))
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


def _side_by_torque(deflection: Deflection, time: Floats) -> Floats:
    """Return where in the gap a link lies, from -1/2 to 1/2, with two derivatives at the times (T,): shape (3, T).

    Parameters
    ----------
    deflection : Deflection
        Negative torque through the joint by the inertia beyond it.
    time : (T,) array
        Times [s].
    """
    fine = _finely(*deflection.span)
    first, reversals = _reversals(fine, deflection.derivative(fine, 0), UNLOADED)
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


@dataclass(frozen=True)
class _Speed:
    """Speed of a joint's motion, without what its encoder leaps when it reverses.

    While a leap lasts, the recorded speed is mostly its own: it changes its sign before the motion does, too steeply,
    and again where the smoothing rings. The speeds before and after are those of the motion, and a cubic through them
    passes through zero when the motion reverses.

    Attributes
    ----------
    motion : Motion
    index : int
        Number of the joint.
    first : float
        Sign of the speed at first.
    turns : tuple of _Reversal
    """

    motion: Motion
    index: int
    first: float
    turns: tuple[_Reversal, ...]

    @classmethod
    def of(cls, motion: Motion, index: int, begin: float, end: float) -> _Speed:
        """Return the speed of a joint between two times [s]."""
        fine = _finely(begin, end)
        speed = np.asarray(motion.evaluate(fine).velocity)[:, index]
        first, changes = _reversals(fine, speed, SLOW)
        if not changes:
            return cls(motion, index, first, ())
        times = np.array([change.time for change in changes])
        groups = np.split(np.arange(len(times)), np.flatnonzero(np.diff(times) > BRIDGED) + 1)
        middles = [0.5 * float(times[group[0]] + times[group[-1]]) for group in groups]
        borders = [-np.inf, *(0.5 * (one + other) for one, other in pairwise(middles)), np.inf]
        turns = []
        for group, middle, (left, right) in zip(groups, middles, pairwise(borders), strict=True):
            if len(group) % 2 == 0:  # the motion goes on as before
                continue
            away = np.abs(fine - middle)
            used = (away > BRIDGED) & (away < NEARBY) & (fine > left) & (fine < right)
            turns.append(_through_zero(fine[used], speed[used], middle, changes[group[-1]]))
        return cls(motion, index, first, tuple(turns))

    def leap(self, time: Floats, creeping: float) -> Floats:
        """Return where in the gap a link lies whose encoder leaps while it is slow, as its record shows it, (3, T).

        Parameters
        ----------
        time : (T,) array
            Times [s].
        creeping : float
            Speed below which the link is slow.
        """
        lasts = [np.clip(2.0 * creeping / turn.slope, QUICKEST, SLOWEST) for turn in self.turns]

        def course(at: Floats) -> Floats:
            side = np.zeros((3, len(at)))
            side[0] = -0.5 * self.first
            for turn, one in zip(self.turns, lasts, strict=True):
                side -= _about(at, turn, float(one))
            return side

        if not isinstance(self.motion, MeasuredMotion):
            return course(time)
        return self.motion.joints[self.index].of_course(course).evaluate(time)


def _about(time: Floats, crossing: _Reversal, lasts: float) -> Floats:
    """Return the way across the gap in some time about a reversal, as `_across`: a quintic step."""
    x = np.clip((time - crossing.time) / lasts + 0.5, 0.0, 1.0)
    first = 30.0 * x**2 * (1.0 - x) ** 2 / lasts
    second = 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) / lasts**2
    return crossing.side * np.stack([x**3 * (10.0 - 15.0 * x + 6.0 * x**2), first, second])


def _through_zero(times: Floats, speed: Floats, middle: float, otherwise: _Reversal) -> _Reversal:
    """Return the reversal near a time by the cubic through speeds (n,) before and after it, or another without one."""
    if not (times < middle).sum() > CUBIC < (times > middle).sum():
        return otherwise
    cubic = Polynomial.fit(times, speed, CUBIC)
    roots = cubic.roots()
    near = roots.real[(np.abs(roots.imag) < ROUNDING) & (np.abs(roots.real - middle) < BRIDGED)]
    if not len(near):
        return otherwise
    time = float(near[np.argmin(np.abs(near - middle))])
    return otherwise._replace(time=time, slope=float(abs(cubic.deriv()(time))))


def _finely(begin: float, end: float) -> Floats:
    return np.linspace(begin, end, FINE * max(int((end - begin) / KNOTS), 1) + 1)
