"""True motion of a free-flying robot from MuJoCo, with hidden parts and actions.

The URDF is rebuilt as a MuJoCo model with a free base and no gravity. Kinematics, inertia matrix, velocity terms and
the accelerometer are MuJoCo's. The joints are driven exactly: at every stage of a classical Runge-Kutta step their
position and speed are set to the prescribed motion, and MuJoCo's equations are solved for the accelerations that are
left free (base, appendages) and for the joint torques. The recorded joint positions are thus those MuJoCo had, and no
servo error limits the accuracy. The gravity gradient is a wrench on every body. What else may act (drag, a leak,
pulses) is a field: a force and torque on the base given by time, attitude and rate.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import pairwise
from pathlib import Path

import mujoco
import numpy as np
from mujoco import rollout as mujoco_rollout
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from studies.truth.bodies import Body, Description, join, read_urdf
from studies.truth.motions import Motion
from studies.truth.mujoco.parts import Appendage, DrivenWheel, Field, Flexibility, Mover, Rotor, Thrust
from studies.truth.numerics import Array, cross, runge_kutta_step, substeps
from studies.truth.orbit import Orbit
from studies.truth.recordings import Truth

# inertia of a flexible joint's motor about its axis [kg m2]; the motor is driven, so that nothing else feels it
ARMATURE = 1.0

# MuJoCo's joint for each moving joint of a URDF
JOINT_TYPES = {
    "revolute": mujoco.mjtJoint.mjJNT_HINGE,
    "continuous": mujoco.mjtJoint.mjJNT_HINGE,
    "prismatic": mujoco.mjtJoint.mjJNT_SLIDE,
}


def _quaternion(rotation: Array) -> Array:
    """MuJoCo's quaternion (w, x, y, z) of a rotation matrix."""
    return np.asarray(Rotation.from_matrix(rotation).as_quat(scalar_first=True))


def _set_inertial(spec_body: mujoco.MjsBody, body: Body) -> None:
    moments, axes = np.linalg.eigh(body.inertia)
    axes[:, 2] *= np.linalg.det(axes)
    spec_body.explicitinertial = True
    spec_body.mass, spec_body.ipos = body.mass, body.com
    spec_body.inertia, spec_body.iquat = moments, _quaternion(axes)


def _add_links(
    spec_body: mujoco.MjsBody,
    name: str,
    robot: Description,
    changed: Mapping[str, Body],
    flexible: Mapping[str, Flexibility],
) -> None:
    """Add everything that hangs on link `name`."""
    bodies = robot.bodies | dict(changed)
    for joint in (joint for joint in robot.joints if joint.parent == name):
        added = spec_body.add_body(name=joint.child, pos=joint.offset, quat=_quaternion(joint.rotation))
        if joint.child in bodies:
            _set_inertial(added, bodies[joint.child])
        if joint.kind != "fixed":
            motor = added.add_joint(name=joint.name, type=JOINT_TYPES[joint.kind], axis=joint.axis)
            if joint.name in flexible:
                # two coaxial joints on one body: the motor needs some inertia to keep the matrix regular
                motor.armature = ARMATURE
                added.add_joint(name=f"{joint.name} spring", type=JOINT_TYPES[joint.kind], axis=joint.axis)
        _add_links(added, joint.child, robot, changed, flexible)


def _add_appendage(base: mujoco.MjsBody, name: str, appendage: Appendage) -> None:
    """Add the body with springs of the wanted frequency: stiffness = inertia about the axis x omega^2."""
    body, omega = appendage.body, 2.0 * np.pi * appendage.frequency
    added = base.add_body(name=name)
    _set_inertial(added, body)
    about_anchor = body.inertia_about(np.array(appendage.anchor))
    kinds = [(mujoco.mjtJoint.mjJNT_HINGE, a) for a in appendage.hinges]
    kinds += [(mujoco.mjtJoint.mjJNT_SLIDE, a) for a in appendage.slides]
    for index, (kind, direction) in enumerate(kinds):
        axis = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
        inertia = axis @ about_anchor @ axis if kind == mujoco.mjtJoint.mjJNT_HINGE else body.mass
        spring = added.add_joint(name=f"{name}_{index}", type=kind, axis=axis, pos=appendage.anchor)
        # MuJoCo 4 takes polynomials; the first coefficient is the linear one
        spring.stiffness = [inertia * omega**2, 0.0, 0.0]
        spring.damping = [2.0 * appendage.damping * inertia * omega, 0.0, 0.0]


STEPS = 40  # least number of steps within which a body moves within the base


class TruthModel:
    """A robot in MuJoCo with the given hidden parts; `run` moves it.

    Parameters
    ----------
    urdf : path
    orbit : Orbit, optional; left out, no gravity gradient acts
    rotor : Rotor, optional
    appendages : sequence of Appendage
    thrusts : sequence of Thrust
    accel_position : (3,) array_like; mounting point of the accelerometer, base frame [m]
    fields : sequence of Field; what else acts on the base
    movers : sequence of Mover
    changed : mapping; links -> what is really there in place of the URDF's
    flexible : sequence of Flexibility
    wheels : sequence of DrivenWheel
    configuration : (joints,) array_like, optional
        Joint positions at which the stiffness of flexible joints is set, in the order of the URDF; zero by default.
    """

    def __init__(
        self,
        urdf: str | Path,
        *,
        orbit: Orbit | None = None,
        rotor: Rotor | None = None,
        appendages: Sequence[Appendage] = (),
        thrusts: Sequence[Thrust] = (),
        accel_position: ArrayLike = (0.0, 0.0, 0.0),
        fields: Sequence[Field] = (),
        movers: Sequence[Mover] = (),
        changed: Mapping[str, Body] | None = None,
        flexible: Sequence[Flexibility] = (),
        wheels: Sequence[DrivenWheel] = (),
        configuration: ArrayLike | None = None,
    ) -> None:
        robot = read_urdf(urdf)
        self.joints = tuple(joint.name for joint in robot.moving)
        self.orbit, self.thrusts, self.rotor = orbit, tuple(thrusts), rotor
        self.fields, self.movers, self.wheels = tuple(fields), tuple(movers), tuple(wheels)
        changed, springs = dict(changed or {}), {f.joint: f for f in flexible}
        links = set(robot.links) - {robot.base}
        for kind, names, known in (("link", set(changed), links), ("joint", set(springs), set(self.joints))):
            if not names <= known:
                raise ValueError(f"no {kind} {sorted(names - known)} to change; there are {sorted(known)}")
        base = robot.bodies[robot.base]
        hidden: list[Appendage | Mover] = [*appendages, *movers]
        at_rest = ([] if rotor is None else [rotor.body]) + [part.body for part in (*hidden, *wheels)]
        self.base = join(base, *at_rest)
        """Base body with all that is fixed on it when nothing moves: what identification should return."""

        spec = mujoco.MjSpec()
        spec.option.gravity = np.zeros(3)
        spec_base = spec.worldbody.add_body(name=robot.base)
        spec_base.add_freejoint()
        _set_inertial(spec_base, base)
        spec_base.add_site(name="sensor", pos=np.asarray(accel_position, dtype=float))
        for kind in ("ACCELEROMETER", "GYRO"):
            sensor = spec.add_sensor(name=kind, type=getattr(mujoco.mjtSensor, f"mjSENS_{kind}"))
            sensor.objtype, sensor.objname = mujoco.mjtObj.mjOBJ_SITE, "sensor"
        if rotor is not None:
            added = spec_base.add_body(name="rotor")
            _set_inertial(added, rotor.body)
            added.add_joint(name="rotor", type=mujoco.mjtJoint.mjJNT_HINGE, axis=rotor.axis, pos=rotor.position)
        for index, wheel in enumerate(wheels):
            added = spec_base.add_body(name=f"wheel{index}")
            _set_inertial(added, wheel.body)
            added.add_joint(name=f"wheel{index}", type=JOINT_TYPES["revolute"], axis=wheel.axis, pos=wheel.position)
        for index, appendage in enumerate(appendages):
            _add_appendage(spec_base, f"appendage{index}", appendage)
        for index, mover in enumerate(movers):
            added = spec_base.add_body(name=f"mover{index}")
            _set_inertial(added, mover.body)
            added.add_joint(name=f"mover{index}", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=mover.direction)
        _add_links(spec_base, robot.base, robot, changed, springs)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self._index_degrees_of_freedom()
        self._stiffen(springs, np.zeros(len(self.joints)) if configuration is None else configuration)

    def _stiffen(self, springs: Mapping[str, Flexibility], configuration: ArrayLike) -> None:
        if not springs:
            return
        data, model = self.data, self.model
        data.qpos[self.driven_q[: len(self.joints)]] = configuration
        mujoco.mj_fwdPosition(model, data)
        mass = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, mass)
        for name, spring in springs.items():
            joint = model.joint(f"{name} spring")
            at, omega = joint.dofadr[0], 2.0 * np.pi * spring.frequency
            model.jnt_stiffness[joint.id] = mass[at, at] * omega**2
            model.dof_damping[at] = 2.0 * spring.damping * mass[at, at] * omega

    def _index_degrees_of_freedom(self) -> None:
        """Find where driven and free degrees of freedom stand in MuJoCo's vectors."""
        names = self.joints + (() if self.rotor is None else ("rotor",))
        names += tuple(f"mover{index}" for index in range(len(self.movers)))
        names += tuple(f"wheel{index}" for index in range(len(self.wheels)))
        joints = [self.model.joint(name) for name in names]
        self.driven_q = np.array([joint.qposadr[0] for joint in joints], dtype=int)
        self.driven_v = np.array([joint.dofadr[0] for joint in joints], dtype=int)
        self._free_v = np.setdiff1d(np.arange(self.model.nv), self.driven_v)
        self._free_free = np.ix_(self._free_v, self._free_v)
        self._free_driven = np.ix_(self._free_v, self.driven_v)
        # beyond the base's seven numbers a joint's address in qpos is that in qvel plus one
        self._spring_v = self._free_v[6:]

    def _prescribed(self, motion: Motion, time: float) -> tuple[Array, Array, Array]:
        arm = motion(time)
        extra = []
        if self.rotor is not None:
            spin = float(np.linalg.norm(self.rotor.momentum)) / self.rotor.spin_inertia
            extra.append((spin * time, spin, 0.0))
        extra += [mover.motion(time) for mover in self.movers]
        extra += [wheel.course(time) for wheel in self.wheels]
        if not extra:
            return arm
        position, speed, acceleration = (np.append(a, b) for a, b in zip(arm, zip(*extra, strict=True), strict=True))
        return position, speed, acceleration

    def thrust(self, time: float) -> tuple[Array, Array]:
        """Force and torque of the thrusts at the base origin [N, N m], base axes."""
        force, torque = np.zeros(3), np.zeros(3)
        for active in (thrust for thrust in self.thrusts if thrust.start <= time < thrust.stop):
            force, torque = force + active.force, torque + active.torque
        return force, torque

    @staticmethod
    def _gravity_gradient(up: Array, gradient: float, offset: Array) -> Array:
        """Acceleration of points off the centre of mass by the gravity gradient [m/s2]."""
        return gradient * (3.0 * (offset @ up)[..., None] * up - offset)

    def _apply_wrenches(self, time: float, action_time: float) -> None:
        """Give MuJoCo the gravity gradient on every body, and thrust and fields on the base."""
        data, model = self.data, self.model
        data.xfrc_applied[:] = 0.0
        if self.orbit is not None:
            up, gradient = self.orbit.zenith(time)
            offset = data.xipos[1:] - data.subtree_com[1]
            axes = data.ximat[1:].reshape(-1, 3, 3)
            inertia_up = np.einsum("bij,bj->bi", axes, model.body_inertia[1:] * (up @ axes))
            data.xfrc_applied[1:, :3] = model.body_mass[1:, None] * self._gravity_gradient(up, gradient, offset)
            data.xfrc_applied[1:, 3:] = 3.0 * gradient * cross(up, inertia_up)
        rotation = data.xmat[1].reshape(3, 3)
        if not self.thrusts and not self.fields:
            return
        force, torque = self.thrust(action_time)
        for act in self.fields:
            more = act(action_time, rotation, data.qvel[3:6])
            force, torque = force + more[0], torque + more[1]
        force, torque = rotation @ force, rotation @ torque
        data.xfrc_applied[1, :3] += force
        data.xfrc_applied[1, 3:] += torque + cross(data.xpos[1] - data.xipos[1], force)

    def _solve(self, motion: Motion, time: float, qpos: Array, qvel: Array, action_time: float) -> Array:
        """Accelerations of all degrees of freedom; MuJoCo's state is left at this time."""
        data, model = self.data, self.model
        position, speed, acceleration = self._prescribed(motion, time)
        data.qpos[:], data.qvel[:] = qpos, qvel
        data.qpos[3:7] /= np.linalg.norm(data.qpos[3:7])
        data.qpos[self.driven_q], data.qvel[self.driven_v] = position, speed
        mujoco.mj_fwdPosition(model, data)
        self._apply_wrenches(time, action_time)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_fwdActuation(model, data)
        mujoco.mj_fwdAcceleration(model, data)
        mass = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, mass)
        free, driven = self._free_v, self.driven_v
        result = np.zeros(model.nv)
        result[driven] = acceleration
        right = data.qfrc_smooth[free] - mass[self._free_driven] @ acceleration
        result[free] = np.linalg.solve(mass[self._free_free], right)
        self._torque = mass[driven] @ result - data.qfrc_smooth[driven] - model.dof_armature[driven] * acceleration
        return result

    def _derivative(self, motion: Motion, time: float, y: Array, action_time: float) -> Array:
        nq = self.model.nq
        qvel = y[nq:]
        acceleration = self._solve(motion, time, y[:nq], qvel, action_time)
        slope = np.zeros_like(y)
        slope[:3] = qvel[:3]
        # the free joint's rate is in body axes: dq/dt = q (0, w) / 2
        mujoco.mju_mulQuat(slope[3:7], y[3:7].copy(), 0.5 * np.array([0.0, *qvel[3:6]]))
        slope[1 + self._spring_v] = qvel[self._spring_v]
        slope[nq:] = acceleration
        return slope

    def _step(self, motion: Motion, time: float, y: Array, h: float) -> Array:
        y = runge_kutta_step(partial(self._derivative, motion), time, y, h)
        y[3:7] /= np.linalg.norm(y[3:7])
        return y

    def _read(self, motion: Motion, time: float, y: Array) -> tuple[Array, ...]:
        data, model, nq, count = self.data, self.model, self.model.nq, len(self.joints)
        data.qacc[:] = self._solve(motion, time, y[:nq], y[nq:], time)
        acceleration = data.qacc[self.driven_v[:count]].copy()
        mujoco.mj_rnePostConstraint(model, data)
        mujoco.mj_sensorVel(model, data)
        mujoco.mj_sensorAcc(model, data)
        accel, rate = data.sensordata[:3].copy(), data.sensordata[3:6].copy()
        if self.orbit is not None:
            offset = data.site_xpos[0] - data.subtree_com[1]
            accel -= data.xmat[1].reshape(3, 3).T @ self._gravity_gradient(*self.orbit.zenith(time), offset)
        position, speed = data.qpos[self.driven_q[:count]].copy(), data.qvel[self.driven_v[:count]].copy()
        attitude = data.qpos[[4, 5, 6, 3]].copy()
        torque = self._torque[:count].copy()
        return np.asarray(time), position, speed, acceleration, torque, rate, attitude, accel, *self.thrust(time)

    def run(
        self,
        motion: Motion,
        times: ArrayLike,
        *,
        rate0: ArrayLike = (0.0, 0.0, 0.0),
        attitude0: ArrayLike = (0.0, 0.0, 0.0, 1.0),
        step: float = 0.05,
    ) -> Truth:
        """Move the robot from time 0 and read it at `times`.

        Parameters
        ----------
        motion : callable
            Time -> positions, speeds, accelerations of the URDF's moving joints, in the order of the URDF.
        times : (n,) array_like; increasing [s]; those before 0 are reached backwards from the state at 0
        rate0 : (3,) array_like
            Initial angular velocity, base axes [rad/s]. Springs start at rest, and so does the base's origin (a gauge).
        attitude0 : (4,) array_like; initial quaternion x, y, z, w, base axes to orbit axes
        step : float; largest step [s]

        Returns
        -------
        Truth
        """
        x, y, z, w = np.asarray(attitude0, dtype=float) / np.linalg.norm(attitude0)
        state = np.zeros(self.model.nq + self.model.nv)
        state[3:7] = w, x, y, z
        state[self.model.nq + 3 : self.model.nq + 6] = rate0
        times = np.asarray(times, dtype=float)
        rows = self._march(motion, times[times < 0.0][::-1], state, step)[::-1]
        rows += self._march(motion, times[times >= 0.0], state, step)
        return Truth(*(np.array(column) for column in zip(*rows, strict=True)))

    def _moves(self, time: float, target: float) -> list[float]:
        """Return the steps that bodies need which move within the base between two times."""
        ends = sorted((time, target))
        return [m.duration / STEPS for m in self.movers if m.start < ends[1] and m.start + m.duration > ends[0]]

    def _legs(self, time: float, target: float) -> list[tuple[float, float]]:
        """Return the way between two times in legs within which no body sets off or stops in the base.

        A step across such an instant, at which the slope of the acceleration jumps, would give the base a false kick.
        """
        first, last = sorted((time, target))
        edges = {edge for m in self.movers for edge in (m.start, m.start + m.duration) if first < edge < last}
        return list(pairwise(sorted({time, *edges, target}, reverse=bool(target < time))))

    def _march(self, motion: Motion, times: Array, state: Array, step: float) -> list[tuple[Array, ...]]:
        """Read the robot at times that lead away from 0, where it has the given state."""
        time, rows = 0.0, []
        for target in times:
            for begin, end in self._legs(time, target):
                for now, size in substeps(begin, end, min([step, *self._moves(begin, end)])):
                    state = self._step(motion, now, state, size)
            time = target
            rows.append(self._read(motion, time, state))
        return rows


def rollout(exact: TruthModel, motion: Motion, count: int, step: float) -> Callable[[], Array]:
    """Prepare the rollout of a motion from time 0, its joints driven by the exact torques at mid-step.

    Parameters
    ----------
    exact : TruthModel; the robot, without gravity gradient; its integrator is changed
    motion : callable; Time -> positions, speeds, accelerations of the joints
    count : int; number of steps
    step : float; length of a step [s]

    Returns
    -------
    callable
        Rolls out and returns the rates of the base before each step, (count, 3) [rad/s].
    """
    model = exact.model
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    model.opt.timestep = step
    torque = np.zeros((1, count, model.nv))
    torque[0][:, exact.driven_v] = exact.run(motion, step * (np.arange(count) + 0.5), step=min(step, 0.1)).torque
    # a fresh state, since the exact flight leaves its last one behind
    data = mujoco.MjData(model)
    position, speed, _ = motion(0.0)
    data.qpos[exact.driven_q], data.qvel[exact.driven_v] = position, speed
    mujoco.mj_forward(model, data)
    initial = np.empty(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
    mujoco.mj_getState(model, data, initial, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    control = int(mujoco.mjtState.mjSTATE_QFRC_APPLIED)

    def roll() -> Array:
        sensed = mujoco_rollout.rollout(model, data, initial[None], torque, control_spec=control)[1][0]
        return np.asarray(sensed[:, 3:6])

    return roll
