"""Families of joint motions to design: the paper's (27), finite Fourier series, B-splines, or a user's class.

A family is one small class with the names of its parameters, its duration, and the joint positions at one instant as a
function that JAX can differentiate. Velocities and accelerations follow from that function. Families that are linear
in their parameters, such as the three below, provide matrices instead. The joints that the paper's excitation does not
move take the posture in which the outer arm is extended.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from scipy.interpolate import BSpline
from scipy.linalg import null_space
from scipy.optimize import minimize

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats, Integers
from bayesid._math.double_precision import in_double_precision
from bayesid.recording.joint_motion import Excitation, Motion
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import Tip, kinematics
from bayesid.robot.robot import Robot

__all__ = [
    "BSplines",
    "Fourier",
    "Linear",
    "PaperExcitation",
    "ParameterisedMotion",
    "TrajectoryFamily",
    "extended_posture",
]

FITTED = 400  # number of instants at which a motion is fitted to another one
STARTS = 12  # number of random starts of the search, since the distance has several local maxima
PULL = 1e-6  # penalty on the squared distance from the start [m/rad2, 1/m], so that joints without influence stay there


class TrajectoryFamily:
    """Family of joint motions; a subclass sets the attributes and overrides `position`.

    Attributes
    ----------
    name : str
        Name of the family in reports and file names.
    names : tuple of str
        Names of the n parameters.
    duration : float
        Duration of the whole manoeuvre [s].
    scale : (n,) array
        Typical size of each parameter, for random starts and for the optimiser's steps.
    centre : (n,) array
        Parameters about which random starts are drawn; the motion with these parameters should be slow.
    imitates : bool
        Whether the family has `nearest` and `moving_joints`, so that a search may start from swings of another one.
    """

    name: str
    names: tuple[str, ...]
    duration: float
    scale: Floats
    centre: Floats
    imitates: bool = False

    def position(self, parameters: Array, time: Array) -> Array:
        """Return the positions of all joints at one instant, shape (joints,) [rad or m], computed in JAX.

        Parameters
        ----------
        parameters : (n,) array
            Parameters of the motion.
        time : scalar array
            Instant [s].
        """
        raise NotImplementedError

    def state(self, parameters: Array, time: Floats) -> JointState:
        """Return positions, velocities and accelerations, each (T, joints), differentiable in the parameters.

        Parameters
        ----------
        parameters : (n,) array
            Parameters of the motion.
        time : (T,) array
            Instants [s].
        """

        def speed(t: Array) -> Array:
            return jax.jvp(lambda s: self.position(parameters, s), (t,), (jnp.ones(()),))[1]

        def change(t: Array) -> Array:
            return jax.jvp(speed, (t,), (jnp.ones(()),))[1]

        instants = jnp.asarray(time, dtype=float)
        parts = [jax.vmap(part)(instants) for part in (lambda t: self.position(parameters, t), speed, change)]
        return JointState(*cast("list[Floats]", parts))

    def slopes(self, parameters: Array, time: Floats) -> Array:
        """Return the derivatives of position, velocity and acceleration, shape (3, T, joints, n).

        Parameters
        ----------
        parameters : (n,) array
            Parameters of the motion.
        time : (T,) array
            Instants [s].
        """
        return jnp.stack(jax.jacfwd(lambda p: tuple(self.state(p, time)))(jnp.asarray(parameters)))

    @property
    def size(self) -> int:
        """Number of parameters."""
        return len(self.names)

    @property
    def groups(self) -> Integers:
        """Number of the group of each parameter, shape (n,); a search exchanges whole groups between motions."""
        return np.arange(self.size)

    @property
    def posture_at_rest(self) -> Floats:
        """Positions of all joints at the start of the motion with the parameters `centre`, (joints,) [rad or m]."""
        return self.motion(self.centre).evaluate(np.zeros(1)).position[0]

    @property
    def moving_joints(self) -> Integers:
        """Indices of the joints that some parameter moves."""
        raise NotImplementedError

    def nearest(self, motion: Motion) -> Floats:
        """Return the parameters (n,) of the motion closest to another one."""
        raise NotImplementedError

    def motion(self, parameters: Floats | Array) -> ParameterisedMotion:
        """Return the motion with given parameters, shape (n,)."""
        return ParameterisedMotion(self, parameters)


@dataclass(frozen=True)
class ParameterisedMotion:
    """One motion of a family, a `bayesid.recording.joint_motion.Motion` whose parameters JAX may trace.

    Parameters
    ----------
    family : TrajectoryFamily
        Family of the motion.
    parameters : (n,) array
        Parameters of the motion.
    """

    family: TrajectoryFamily
    parameters: Floats | Array

    @in_double_precision
    def evaluate(self, time: Floats) -> JointState:
        """Return the joint state at the times, shape (T,), as NumPy arrays unless the parameters are traced."""
        state = self.family.state(jnp.asarray(self.parameters), np.asarray(time, dtype=float))
        traced = isinstance(self.parameters, jax.core.Tracer)
        return state if traced else JointState(*(np.array(part) for part in state))


class Linear(TrajectoryFamily):
    """Family of motions linear in its parameters, ``rest(t) + basis(t) parameters``."""

    imitates = True

    def matrices(self, time: Floats) -> tuple[Floats, Floats]:
        """Return rest (3, T, joints) and basis (3, T, joints, n), each for position, velocity and acceleration."""
        raise NotImplementedError

    @property
    def moving_joints(self) -> Integers:
        """Indices of the joints that some parameter moves."""
        basis = self.matrices(np.linspace(0.0, self.duration, 64))[1][0]
        return np.flatnonzero(np.abs(basis).max(axis=(0, 2)) > 0.0)

    def nearest(self, motion: Motion) -> Floats:
        """Return the parameters of the motion closest to another one's excursion from its start, by least squares.

        A motion of a family that this one contains is met exactly.
        """
        time = np.linspace(0.0, self.duration, FITTED)
        basis = self.matrices(time)[1][0].reshape(-1, self.size)
        position = np.asarray(motion.evaluate(time).position)
        excursion = position - position[0] + self.posture_at_rest - self.matrices(time)[0][0]
        return np.asarray(np.linalg.lstsq(basis, excursion.ravel(), rcond=None)[0])

    def slopes(self, parameters: Array, time: Floats) -> Array:
        """Return the derivatives of position, velocity and acceleration, shape (3, T, joints, n)."""
        return jnp.asarray(self.matrices(np.asarray(time, dtype=float))[1])

    def state(self, parameters: Array, time: Floats) -> JointState:
        """Return positions, velocities and accelerations, each (T, joints)."""
        rest, basis = self.matrices(np.asarray(time, dtype=float))
        position, velocity, acceleration = jnp.asarray(rest) + jnp.asarray(basis) @ parameters
        return JointState(*cast("tuple[Floats, Floats, Floats]", (position, velocity, acceleration)))


class _PerJoint(Linear):
    """Family with the same basis functions for every moving joint, zero with two derivatives at both ends."""

    def __init__(self, start: Sequence[float] | Floats, moving: Sequence[int], duration: float, labels: Sequence[str]):
        self.start = np.array(start, dtype=float)
        self.moving = tuple(moving)
        self.duration = float(duration)
        if not self.moving:
            raise InputError("no joint is selected to move", remedy="Name at least one joint under design.joints")
        self.names = tuple(f"joint{joint + 1}.{label}" for joint in self.moving for label in labels)
        self.scale = np.full(len(self.names), 0.5)
        self.centre = np.zeros(len(self.names))

    @property
    def groups(self) -> Integers:
        """Number of the joint that each parameter moves, shape (n,)."""
        return np.repeat(np.arange(len(self.moving)), self.size // len(self.moving))

    def functions(self, time: Floats) -> Floats:
        """Return the m basis functions and their first two derivatives, shape (3, T, m)."""
        raise NotImplementedError

    def matrices(self, time: Floats) -> tuple[Floats, Floats]:
        """Return rest (3, T, joints) and basis (3, T, joints, n)."""
        functions = self.functions(time)
        count, joints = functions.shape[2], len(self.start)
        basis = np.zeros((3, len(time), joints, count * len(self.moving)))
        for slot, joint in enumerate(self.moving):
            basis[:, :, joint, slot * count : (slot + 1) * count] = functions
        rest = np.zeros((3, len(time), joints))
        rest[0] = self.start
        return rest, basis


class Fourier(_PerJoint):
    """Finite Fourier series (Swevers et al. 1997), at rest at both ends.

    The basis functions of a joint are those combinations of a constant, sines and cosines that have zero position,
    velocity and acceleration at both ends.

    Parameters
    ----------
    start : (joints,) array_like
        Positions of the joints before and after the manoeuvre [rad or m].
    moving : sequence of int
        Indices of the joints that move.
    duration : float
        Duration of the manoeuvre, which is one period of the series [s].
    harmonics : int
        Number of harmonics of every joint, at least 2.
    """

    name = "fourier"

    def __init__(
        self, start: Sequence[float] | Floats, moving: Sequence[int], duration: float, harmonics: int = 5
    ) -> None:
        if harmonics < 2:
            raise InputError(f"{harmonics} harmonics cannot start at rest", remedy="Give at least 2")
        self.orders = np.arange(1, harmonics + 1)
        ones, none = np.ones(harmonics), np.zeros(harmonics)
        # position, velocity and acceleration at the ends; columns are constant, sines, cosines
        ends = np.array([[1.0, *none, *ones], [0.0, *self.orders, *none], [0.0, *none, *self.orders**2]])
        self.combinations = null_space(ends)
        super().__init__(start, moving, duration, [f"c{k + 1}" for k in range(self.combinations.shape[1])])

    def functions(self, time: Floats) -> Floats:
        """Return the m combinations and their first two derivatives, shape (3, T, m)."""
        inside = np.clip(time, 0.0, self.duration)
        w = 2.0 * np.pi / self.duration * self.orders
        sine, cosine = np.sin(w * inside[:, None]), np.cos(w * inside[:, None])
        ones, none = np.ones((len(time), 1)), np.zeros((len(time), 1))
        series = np.stack(
            [
                np.hstack([ones, sine, cosine]),
                np.hstack([none, w * cosine, -w * sine]),
                np.hstack([none, -(w**2) * sine, -(w**2) * cosine]),
            ]
        )
        return series @ self.combinations


class BSplines(_PerJoint):
    """Quintic B-splines on even knots whose first and last three control points are the start position.

    Parameters
    ----------
    start, moving, duration
        Parameters of `Fourier`.
    points : int
        Number of free control points of every joint.
    """

    name = "b-splines"
    DEGREE = 5
    """Degree of the splines, for which the accelerations are twice continuously differentiable."""

    def __init__(
        self, start: Sequence[float] | Floats, moving: Sequence[int], duration: float, points: int = 8
    ) -> None:
        if points < 1:
            raise InputError(f"{points} control points cannot move a joint", remedy="Give at least 1")
        super().__init__(start, moving, duration, [f"p{k + 1}" for k in range(points)])
        inner = points + 6 - self.DEGREE + 1
        ends = [0.0] * self.DEGREE, [float(duration)] * self.DEGREE
        self.knots = np.concatenate([ends[0], np.linspace(0.0, duration, inner), ends[1]])
        self.points = points

    def functions(self, time: Floats) -> Floats:
        """Return the m free splines and their first two derivatives, shape (3, T, m)."""
        inside = np.clip(time, 0.0, self.duration)
        values = np.zeros((3, len(time), self.points))
        for k in range(self.points):
            control = np.zeros(self.points + 6)
            control[3 + k] = 1.0
            spline = BSpline(self.knots, control, self.DEGREE)
            for order in range(3):
                values[order, :, k] = spline(inside, nu=order)
        return values


class PaperExcitation(Linear):
    """Family of the paper's (27) with its connecting splines (`bayesid.recording.joint_motion.Excitation`).

    Three joints oscillate as ``q1 + q2 cos(omega t)``; the others rest with the arm extended.

    Parameters
    ----------
    posture : (joints,) array_like
        Positions of the joints before and after; joints that do not oscillate stay there [rad or m].
    duration : float
        Duration of the whole manoeuvre [s].
    moving : sequence of int, optional
        Indices of the joints that oscillate, by default the first three.
    periods : int
        Number of periods of the oscillation, which the paper does not state.
    ramp : float
        Fraction of the duration that each connecting spline takes.
    """

    name = "paper"
    imitates = False

    def __init__(
        self,
        posture: Sequence[float] | Floats,
        duration: float,
        moving: Sequence[int] | None = None,
        periods: int = 2,
        ramp: float = 0.25,
    ) -> None:
        self.posture = np.array(posture, dtype=float)
        self.duration, self.periods, self.ramp = float(duration), periods, float(ramp) * float(duration)
        self.moving = tuple(range(min(3, len(self.posture)))) if moving is None else tuple(moving)
        self.names = tuple(f"joint{joint + 1}.{key}" for joint in self.moving for key in ("q1", "q2"))
        self.scale = np.full(len(self.names), 0.5)
        self.centre = np.ravel([(self.posture[joint], 0.0) for joint in self.moving])  # the arm at rest

    @property
    def frequency(self) -> float:
        """Angular frequency omega of the oscillation [rad/s]."""
        return 2.0 * np.pi * self.periods / (self.duration - 2.0 * self.ramp)

    def excitation(self, parameters: Floats) -> Excitation:
        """Return the excitation with the parameters q1 and q2 of the first moving joint, then of the next ones."""
        offset, amplitude = self.posture.copy(), np.zeros(len(self.posture))
        offset[list(self.moving)], amplitude[list(self.moving)] = parameters[0::2], parameters[1::2]
        return Excitation(offset, amplitude, self.frequency, self.periods, self.ramp, self.posture)

    def matrices(self, time: Floats) -> tuple[Floats, Floats]:
        """Return rest (3, T, joints) and basis (3, T, joints, n)."""
        rest = np.stack(self.excitation(np.zeros(self.size)).evaluate(time))
        basis = [np.stack(self.excitation(unit).evaluate(time)) - rest for unit in np.eye(self.size)]
        return rest, np.stack(basis, axis=-1)


def extended_posture(robot: Robot, start: Sequence[float] | Floats, free: Sequence[int], last: int, tip: Tip) -> Floats:
    """Return joint positions in which the tip is farthest from a joint.

    Parameters
    ----------
    robot : Robot
        Robot with its joint ranges.
    start : (joints,) array_like
        Positions of all joints at the start [rad or m].
    free : sequence of int
        Indices of the joints that may move; only those between ``last`` and the tip do.
    last : int
        Index of the joint from whose origin the distance is measured.
    tip : Tip
        End-effector.

    Returns
    -------
    (joints,) array
        Positions of all joints [rad or m].
    """
    start = np.array(start, dtype=float)
    between = [joint for joint in robot.chain(tip.joint) if joint in free and joint > last]
    if last not in robot.chain(tip.joint) or not between:
        return start
    bounds = [_range(robot, joint) for joint in between]
    low, high = np.transpose(bounds)

    def posture(x: Floats) -> Floats:
        q = start.copy()
        q[between] = x
        return q

    def shortness(x: Floats) -> float:
        q = posture(x)[None]
        state = JointState(q, 0.0 * q, 0.0 * q)
        poses = kinematics(robot, state)
        end = tip.motion(robot, state)[0][0]
        away = x - start[between]
        return -float(np.linalg.norm(end[:3, 3] - poses.pose[0, last, :3, 3])) + PULL * float(away @ away)

    rng = np.random.default_rng(0)  # a fixed seed, so that the posture repeats
    begins = [start[between], *(low + (high - low) * rng.uniform(size=(STARTS, len(between))))]
    ends = [minimize(shortness, begin, method="L-BFGS-B", bounds=bounds) for begin in begins]
    return posture(min(ends, key=lambda end: end.fun).x)


def _range(robot: Robot, index: int) -> tuple[float, float]:
    """Return a joint's range; ends that it lacks are half a turn or a metre away from zero."""
    joint = robot.joints[index]
    reach = 1.0 if joint.kind == "prismatic" else np.pi
    low = joint.lower if np.isfinite(joint.lower) else -reach
    return low, joint.upper if np.isfinite(joint.upper) else max(low, 0.0) + reach
