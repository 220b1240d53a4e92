"""True motion of a free-flying robot from MuJoCo, with hidden parts and actions.

The URDF is rebuilt as a MuJoCo model with a free base and no gravity. Kinematics, inertia matrix, velocity terms and
the accelerometer are MuJoCo's. The joints are driven exactly: at every stage of a classical Runge-Kutta step their
position and speed are set to the prescribed motion, and MuJoCo's equations are solved for the accelerations that are
left free (base, appendages) and for the joint torques. The recorded joint positions are thus those MuJoCo had, and no
servo error limits the accuracy. The gravity gradient is a wrench on every body. What else may act (drag, a leak,
pulses) is a field: a force and torque on the base given by time, attitude and rate.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from studies.truth.bodies import Body, join
from studies.truth.motions import Motion
from studies.truth.mujoco.build import add_appendage, add_links, add_mover, add_rotor, set_inertial
from studies.truth.mujoco.fields import Field
from studies.truth.mujoco.parts import Appendage, Flexibility, Mover, Rotor, Thrust
from studies.truth.numerics import Array, cross, runge_kutta_step, substeps
from studies.truth.orbit import Orbit
from studies.truth.readings import Truth
from studies.truth.urdf import attribute, link_bodies, moving, root_link

__all__ = ["TruthModel"]

STEPS = 40
"""Least number of steps within which a body moves within the base."""


class TruthModel:
    """A robot in MuJoCo with the given hidden parts; `run` moves it.

    Parameters
    ----------
    urdf : path
    orbit : Orbit, optional
        Left out, no gravity gradient acts.
    rotor : Rotor, optional
    appendages : sequence of Appendage
    thrusts : sequence of Thrust
    accel_position : (3,) array_like
        Mounting point of the accelerometer, base frame [m].
    fields : sequence of Field
        What else acts on the base.
    movers : sequence of Mover
    changed : mapping
        Links -> what is really there in place of the URDF's.
    flexible : sequence of Flexibility
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
        configuration: ArrayLike | None = None,
    ) -> None:
        tree = ElementTree.parse(urdf).getroot()
        root = root_link(tree)
        self.joints = tuple(attribute(joint, "name") for joint in moving(tree))
        self.orbit, self.thrusts, self.rotor = orbit, tuple(thrusts), rotor
        self.fields, self.movers = tuple(fields), tuple(movers)
        changed, springs = dict(changed or {}), {f.joint: f for f in flexible}
        self._check_names(tree, root, changed, springs)
        base = link_bodies(tree)[root]
        hidden: list[Appendage | Mover] = [*appendages, *movers]
        at_rest = ([] if rotor is None else [rotor.body]) + [part.body for part in hidden]
        self.base = join(base, *at_rest)
        """Base body with all that is fixed on it when nothing moves: what identification should return."""

        spec = mujoco.MjSpec()
        spec.option.gravity = np.zeros(3)
        spec_base = spec.worldbody.add_body(name=root)
        spec_base.add_freejoint()
        set_inertial(spec_base, base)
        spec_base.add_site(name="sensor", pos=np.asarray(accel_position, dtype=float))
        for kind in ("ACCELEROMETER", "GYRO"):
            sensor = spec.add_sensor(name=kind, type=getattr(mujoco.mjtSensor, f"mjSENS_{kind}"))
            sensor.objtype, sensor.objname = mujoco.mjtObj.mjOBJ_SITE, "sensor"
        if rotor is not None:
            add_rotor(spec_base, rotor)
        for index, appendage in enumerate(appendages):
            add_appendage(spec_base, f"appendage{index}", appendage)
        for index, mover in enumerate(movers):
            add_mover(spec_base, f"mover{index}", mover)
        add_links(spec_base, root, tree, changed, springs)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self._index_degrees_of_freedom()
        self._stiffen(springs, np.zeros(len(self.joints)) if configuration is None else configuration)

    def _check_names(
        self, tree: ElementTree.Element, root: str, changed: Mapping[str, Body], springs: Mapping[str, Flexibility]
    ) -> None:
        links = {attribute(link, "name") for link in tree.iterfind("link")} - {root}
        for kind, names, known in (("link", set(changed), links), ("joint", set(springs), set(self.joints))):
            if not names <= known:
                raise ValueError(f"no {kind} {sorted(names - known)} to change; there are {sorted(known)}")

    def _stiffen(self, springs: Mapping[str, Flexibility], configuration: ArrayLike) -> None:
        """Give flexible joints their stiffness and damping."""
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
        joints = [self.model.joint(name) for name in names]
        self.driven_q = np.array([joint.qposadr[0] for joint in joints], dtype=int)
        self.driven_v = np.array([joint.dofadr[0] for joint in joints], dtype=int)
        self._free_v = np.setdiff1d(np.arange(self.model.nv), self.driven_v)
        self._free_free = np.ix_(self._free_v, self._free_v)
        self._free_driven = np.ix_(self._free_v, self.driven_v)
        # beyond the base's seven numbers a joint's address in qpos is that in qvel plus one
        self._spring_v = self._free_v[6:]

    def _prescribed(self, motion: Motion, time: float) -> tuple[Array, Array, Array]:
        """Positions, speeds and accelerations of all that is driven."""
        arm = motion(time)
        extra = []
        if self.rotor is not None:
            spin = float(np.linalg.norm(self.rotor.momentum)) / self.rotor.spin_inertia
            extra.append((spin * time, spin, 0.0))
        extra += [mover.motion(time) for mover in self.movers]
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
        """Time derivative of positions and speeds."""
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
        """State one step later, its quaternion normalised."""
        y = runge_kutta_step(partial(self._derivative, motion), time, y, h)
        y[3:7] /= np.linalg.norm(y[3:7])
        return y

    def _read(self, motion: Motion, time: float, y: Array) -> tuple[Array, ...]:
        """Row of `Truth` at a time."""
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
        times : (n,) array_like
            Increasing [s]; those before 0 are reached backwards from the state at 0.
        rate0 : (3,) array_like
            Initial angular velocity, base axes [rad/s]. Springs start at rest, and so does the base's origin (a gauge).
        attitude0 : (4,) array_like
            Initial quaternion x, y, z, w, base axes to orbit axes.
        step : float
            Largest step [s].

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

    def _march(self, motion: Motion, times: Array, state: Array, step: float) -> list[tuple[Array, ...]]:
        """Read the robot at times that lead away from 0, where it has the given state."""
        time, rows = 0.0, []
        for target in times:
            for now, size in substeps(time, target, min([step, *self._moves(time, target)])):
                state = self._step(motion, now, state, size)
            time = target
            rows.append(self._read(motion, time, state))
        return rows
