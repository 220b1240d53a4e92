"""Step-by-step integration of a free-flying robot with Pinocchio, in the plainest way: the reference for the package.

At every evaluation Pinocchio's joint-space inertia (CRBA) and bias (RNEA) of the whole robot are formed, the gravity
gradient acts body by body as in (12)-(16) of Lampariello and Hirzinger (IDETC 2005), and the six rows of the base are
solved for its acceleration; the joints are rheonomic. Classical Runge-Kutta integrates pose and twist of the base.

The point about which gravity is expanded is the composite centre of mass, so that the gradient has no resultant. Base
position and velocity are then free (they are an exact gauge of rate and accelerometer): the base starts at the
origin, and the centre of mass at rest.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from studies.truth.bodies import moving_joints
from studies.truth.motions import Motion
from studies.truth.numerics import Array, runge_kutta_step, substeps

Zenith = Callable[[float], tuple[Array, float]]  # time [s] -> unit vector in orbit axes and mu / R^3 [1/s2]
Wrench = Callable[[float], ArrayLike]  # time [s] -> force or torque at the base origin, base axes [N or N m]

# time [s] -> momentum of the wheels relative to the base [N m s] and its derivative, base axes
Wheel = Callable[[float], tuple[ArrayLike, ArrayLike]]


class Response(NamedTuple):
    """What the reference robot does at the n requested times."""

    times: Array  # (n,)
    rate: Array  # (n, 3): angular velocity of the base relative to inertial space, base axes [rad/s]
    attitude: Array  # (n, 3, 3): rotation from base axes to orbit axes
    accel: Array  # (n, 3): non-gravitational acceleration of the accelerometer's mounting point, base axes [m/s2]
    # (n, 3): composite centre of mass in orbit axes [m, m/s]
    com: Array
    com_velocity: Array
    angular_momentum: Array  # (n, 3): about the composite centre of mass, wheel included, orbit axes [N m s]


class Reference:
    """Equations of motion of one robot under given actions; `simulate` documents the parameters."""

    def __init__(
        self,
        urdf: str | Path,
        motion: Motion,
        *,
        zenith: Zenith | None,
        wheel: ArrayLike | Wheel,
        base_force: Wrench | None,
        base_torque: Wrench | None,
    ) -> None:
        self.model = pin.buildModelFromUrdf(str(urdf), pin.JointModelFreeFlyer())
        self.model.gravity.setZero()
        self.data = self.model.createData()
        self.joints = [self.model.joints[self.model.getJointId(name)] for name in moving_joints(urdf)]
        self.motion = motion
        self.zenith = zenith
        self.wheel = wheel if callable(wheel) else lambda _: (np.asarray(wheel, dtype=float), np.zeros(3))
        self.base_force = base_force
        self.base_torque = base_torque

    def configuration(self, time: float, state: Array) -> tuple[Array, Array, Array]:
        """Pinocchio's q, v and the joints' part of dv/dt.

        The state is base position, quaternion (x, y, z, w) and twist in base axes.
        """
        q, v, dv = pin.neutral(self.model), np.zeros(self.model.nv), np.zeros(self.model.nv)
        q[:7], v[:6] = state[:7], state[7:]
        q[3:7] /= np.linalg.norm(q[3:7])
        for joint, position, speed, acceleration in zip(self.joints, *self.motion(time), strict=True):
            # a continuous joint is a cosine and a sine in Pinocchio
            circle = joint.nq == 2
            q[joint.idx_q : joint.idx_q + joint.nq] = [np.cos(position), np.sin(position)] if circle else [position]
            v[joint.idx_v], dv[joint.idx_v] = speed, acceleration
        return q, v, dv

    def gradient_wrench(self, time: float, q: Array) -> Array:
        """Gravity gradient of all bodies, as one force and torque about the base origin, base axes."""
        wrench = np.zeros(6)
        if self.zenith is None:
            return wrench
        up, gradient = self.zenith(time)
        pin.forwardKinematics(self.model, self.data, q)
        com = pin.centerOfMass(self.model, self.data, q).copy()
        base = self.data.oMi[1]
        for placement, body in list(zip(self.data.oMi, self.model.inertias, strict=True))[1:]:
            position = placement.act(body.lever)
            inertia = placement.rotation @ body.inertia @ placement.rotation.T
            force = body.mass * gradient * (3.0 * up * (up @ (position - com)) - (position - com))
            torque = 3.0 * gradient * np.cross(up, inertia @ up)
            wrench[:3] += base.rotation.T @ force
            wrench[3:] += base.rotation.T @ (torque + np.cross(position - base.translation, force))
        return wrench

    def applied_wrench(self, time: float, rate: Array) -> Array:
        """Wheel and external actions on the base, about its origin, base axes."""
        momentum, change = self.wheel(time)
        wrench = np.concatenate([np.zeros(3), -np.cross(rate, np.asarray(momentum)) - np.asarray(change)])
        if self.base_force is not None:
            wrench[:3] += self.base_force(time)
        if self.base_torque is not None:
            wrench[3:] += self.base_torque(time)
        return wrench

    def acceleration(self, time: float, state: Array, action_time: float) -> Array:
        """Spatial acceleration of the base, base axes, shape (6,)."""
        q, v, dv = self.configuration(time, state)
        mass = pin.crba(self.model, self.data, q)
        mass = np.triu(mass) + np.triu(mass, 1).T
        bias = pin.rnea(self.model, self.data, q, v, np.zeros_like(v))
        wrench = self.gradient_wrench(time, q) + self.applied_wrench(action_time, v[3:6])
        return np.linalg.solve(mass[:6, :6], wrench - bias[:6] - mass[:6, 6:] @ dv[6:])

    def derivative(self, time: float, state: Array, action_time: float) -> Array:
        """Time derivative of the 13 states."""
        rotation = pin.Quaternion(state[3:7] / np.linalg.norm(state[3:7])).toRotationMatrix()
        rate = state[10:]
        vector, scalar = state[3:6], state[6]
        quaternion = 0.5 * np.concatenate([scalar * rate + np.cross(vector, rate), [-vector @ rate]])
        return np.concatenate([rotation @ state[7:10], quaternion, self.acceleration(time, state, action_time)])

    def advance(self, time: float, state: Array, step: float) -> Array:
        """One classical Runge-Kutta step."""
        return runge_kutta_step(self.derivative, time, state, step)

    def initial_state(self, rate: ArrayLike, attitude: Array) -> Array:
        """State with the base at the origin, turning with `rate`, and the centre of mass at rest."""
        state = np.concatenate(
            [np.zeros(3), pin.Quaternion(attitude).coeffs(), np.zeros(3), np.asarray(rate, dtype=float)]
        )
        q, v, _ = self.configuration(0.0, state)
        pin.centerOfMass(self.model, self.data, q, v)
        state[7:10] = -attitude.T @ self.data.vcom[0]
        return state

    def accelerometer(self, time: float, state: Array, position: Array) -> Array:
        """Accelerometer's reading at `position`: inertial acceleration less the gravity gradient's, base axes."""
        q, _, _ = self.configuration(time, state)
        rate, spatial = state[10:], self.acceleration(time, state, time)
        reading = spatial[:3] + np.cross(rate, state[7:10])
        reading += np.cross(spatial[3:], position) + np.cross(rate, np.cross(rate, position))
        if self.zenith is not None:
            up, gradient = self.zenith(time)
            com = pin.centerOfMass(self.model, self.data, q)
            base = self.data.oMi[1]
            offset, zenith = base.rotation.T @ (base.act(position) - com), base.rotation.T @ up
            reading -= gradient * (3.0 * zenith * (zenith @ offset) - offset)
        return reading

    def momentum(self, time: float, state: Array) -> tuple[Array, Array, Array]:
        """Centre of mass, its velocity and the angular momentum about it, orbit axes."""
        q, v, _ = self.configuration(time, state)
        com = pin.centerOfMass(self.model, self.data, q, v).copy()
        angular = pin.computeCentroidalMomentum(self.model, self.data, q, v).angular.copy()
        return com, self.data.vcom[0].copy(), angular + self.data.oMi[1].rotation @ self.wheel(time)[0]


def simulate(
    urdf: str | Path,
    motion: Motion,
    times_out: ArrayLike,
    step: float,
    *,
    gradient: bool = True,
    wheel: ArrayLike | Wheel = (0.0, 0.0, 0.0),
    rate0: ArrayLike = (0.0, 0.0, 0.0),
    attitude0: ArrayLike = (0.0, 0.0, 0.0, 1.0),
    accel_position: ArrayLike = (0.0, 0.0, 0.0),
    base_force: Wrench | None = None,
    base_torque: Wrench | None = None,
    zenith: Zenith | None = None,
) -> Response:
    """Simulate a robot from time 0.

    Parameters
    ----------
    urdf : path; the robot; its root link is the base
    motion : callable; Time -> positions, speeds, accelerations of the joints `moving_joints(urdf)`
    times_out : (n,) array_like; increasing times of the output, the first not before 0 [s]
    step : float; largest integration step [s]; a whole number of equal steps leads from one output to the next
    gradient : bool; whether the gravity gradient acts; it then needs `zenith`
    wheel : (3,) array_like or callable
        Momentum of the wheels relative to the base, base axes [N m s]: constant, or time -> (momentum, its derivative).
    rate0 : (3,) array_like; angular velocity of the base at time 0, base axes [rad/s]
    attitude0 : (4,) array_like; quaternion x, y, z, w, base axes to orbit axes, at time 0
    accel_position : (3,) array_like; mounting point of the accelerometer, base frame [m]
    base_force, base_torque : callable, optional
        Time -> external action at the base origin, base axes [N, N m]; it may jump at output times.
    zenith : callable, optional, Time -> (unit vector in orbit axes, mu / R^3), as `studies.truth.orbit.Orbit.zenith`

    Returns
    -------
    Response
    """
    if gradient and zenith is None:
        raise ValueError("the gravity gradient needs zenith; give it, or gradient=False")
    reference = Reference(
        urdf, motion, zenith=zenith if gradient else None, wheel=wheel, base_force=base_force, base_torque=base_torque
    )
    quaternion = np.asarray(attitude0, dtype=float)
    rotation = pin.Quaternion(quaternion / np.linalg.norm(quaternion)).toRotationMatrix()
    state, time = reference.initial_state(rate0, rotation), 0.0
    position, rows = np.asarray(accel_position, dtype=float), []
    for target in np.asarray(times_out, dtype=float):
        for now, size in substeps(time, target, step):
            state = reference.advance(now, state, size)
        state[3:7] /= np.linalg.norm(state[3:7])
        time = target
        attitude = pin.Quaternion(state[3:7].copy()).toRotationMatrix()
        rows.append(
            (
                time,
                state[10:].copy(),
                attitude,
                reference.accelerometer(time, state, position),
                *reference.momentum(time, state),
            )
        )
    return Response(*(np.array(column) for column in zip(*rows, strict=True)))
