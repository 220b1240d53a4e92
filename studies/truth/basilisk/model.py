"""True motion of a free-floating robot from Basilisk.

A serial arm of revolute joints hangs on a Basilisk hub (`SpinningBodyNDOFStateEffector`). Each joint is held by a
spring and a damper of Basilisk's, and a motor torque moves their rest position along a smooth reference: a servo that
follows it badly. The recorded angles are those that result. The motor torque is held over each step at its value in the
middle of the step, which leaves a ripple in the speeds that is gone at the steps in angles and attitude. Rates and
accelerations are therefore those of the smooth motion through the steps: central differences of sixth order of
attitude, position and angles. They agree with another simulator to 1e-9 rad/s and 1e-9 m/s2; Basilisk's rates at the
steps are off that motion by up to 1e-6 rad/s.

There is no gravity and no orbit: Basilisk's gravity is uniform over the craft and its gravity gradient a torque on the
whole of it, computed from the composite inertia, so that links and accelerometer would not feel it.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from Basilisk.architecture import messaging, sysModel
from Basilisk.simulation import extForceTorque, spacecraft
from Basilisk.utilities import SimulationBaseClass, macros
from scipy.spatial.transform import Rotation

from studies.truth.basilisk.arm import joint_inertias, read_robot
from studies.truth.basilisk.effectors import arm_effector, column, panel_effector, slosh_effectors, wheel_effector
from studies.truth.basilisk.parts import BasiliskHidden, Leak
from studies.truth.motions import Motion
from studies.truth.numerics import Array
from studies.truth.readings import Truth
from studies.truth.urdf import SERVICER4

__all__ = ["LEAD", "STEP", "Run", "simulate"]

STEP = 0.01
"""Integration step [s] of the classical Runge-Kutta method; angular momentum then drifts by less than 1e-6 N m s."""

LEAD = 5
"""Steps before time 0 and after the end, for central differences there."""

_NOTHING = BasiliskHidden()


class _Motors(sysModel.SysModel):
    """Motors of the joints, which write the torques of each step."""

    def __init__(self, torques: Array) -> None:
        super().__init__()
        self.ModelTag = "motors"
        self.torques = torques.tolist()
        self.out = messaging.ArrayMotorTorqueMsg()
        self.payload = messaging.ArrayMotorTorqueMsgPayload()

    def Reset(self, nanoseconds: int) -> None:  # noqa: N802
        """Write the first torques."""
        self.UpdateState(nanoseconds)

    def UpdateState(self, nanoseconds: int) -> None:  # noqa: N802
        """Write the torques of a step."""
        step = min(round(nanoseconds * 1e-9 / STEP), len(self.torques) - 1)
        self.payload.motorTorque = self.torques[step]
        self.out.write(self.payload, nanoseconds, self.moduleID)


def _derivatives(values: Array) -> tuple[Array, Array]:
    """First and second derivative of values at steps by central differences; zero in three rows at either end."""
    first, second = np.zeros_like(values), np.zeros_like(values)
    centre = values[3:-3]
    for k, slope, bend in ((1, 0.75, 1.5), (2, -0.15, -0.15), (3, 1.0 / 60.0, 1.0 / 90.0)):
        ahead, behind = values[3 + k : len(values) - 3 + k], values[3 - k : -3 - k]
        first[3:-3] += slope * (ahead - behind) / STEP
        second[3:-3] += bend * ((ahead - centre) - (centre - behind)) / STEP**2
    return first, second


class Run(NamedTuple):
    """Noise-free motion at the steps from time 0 on, and the angular momentum about the centre of mass.

    Fields
    ------
    truth : Truth
    momentum : (n, 3) array
        Angular momentum of all parts, inertial axes [N m s].
    """

    truth: Truth
    momentum: Array


def simulate(
    motion: Motion,
    duration: float,
    *,
    hidden: BasiliskHidden = _NOTHING,
    urdf: str | Path = SERVICER4,
    rate0: Sequence[float] | Array = (0.0, 0.0, 0.0),
    sigma0: Sequence[float] | Array = (0.0, 0.0, 0.0),
    accel_position: Sequence[float] = (0.0, 0.0, 0.0),
    frequency: float = 0.2,
    damping: float = 0.7,
) -> Run:
    """Let the joints follow a reference with a soft servo and read the robot at every step.

    Parameters
    ----------
    motion : callable
        Time -> reference positions, speeds, accelerations of the joints; at rest up to time 0.
    duration : float
        Length of the recording [s], a multiple of the step.
    hidden : BasiliskHidden
    urdf : path
    rate0, sigma0 : (3,) array_like
        Angular velocity in base axes [rad/s] and modified Rodrigues parameters of the base, `LEAD` steps before
        time 0.
    accel_position : (3,) sequence
        Mounting point of the accelerometer, base frame [m].
    frequency, damping : float
        Natural frequency [Hz] and damping relative to critical of each joint's servo, with the other joints locked and
        the base held.

    Returns
    -------
    Run
    """
    _, hub, arm = read_robot(urdf)
    steps = round(duration / STEP) + 2 * LEAD
    reference = np.array([motion((step - LEAD - 0.5) * STEP)[:2] for step in range(steps + 1)])
    omega = 2.0 * np.pi * frequency
    inertias = joint_inertias(arm, reference[0, 0])
    stiffness, damper = inertias * omega**2, 2.0 * damping * inertias * omega

    base = SimulationBaseClass.SimBaseClass()
    base.CreateNewProcess("process").addTask(base.CreateNewTask("task", macros.sec2nano(STEP)))
    craft = spacecraft.Spacecraft()
    craft.ModelTag = "craft"
    craft.hub.mHub, craft.hub.r_BcB_B = hub.mass, column(hub.com)
    craft.hub.IHubPntBc_B = hub.inertia.tolist()
    craft.hub.r_CN_NInit, craft.hub.v_CN_NInit = column(np.zeros(3)), column(np.zeros(3))
    craft.hub.sigma_BNInit, craft.hub.omega_BN_BInit = column(sigma0), column(rate0)

    # in the order of the task: the torque written at a step acts over the step that ends there
    motors = _Motors(reference[:, 0] * stiffness + reference[:, 1] * damper)
    joints = arm_effector(arm, reference[0, 0], stiffness, damper)
    joints.motorTorqueInMsg.subscribeTo(motors.out)
    craft.addStateEffector(joints)
    models = [motors, joints]
    if hidden.panel is not None:
        models.append(panel_effector(hidden.panel))
        craft.addStateEffector(models[-1])
    particles = [] if hidden.slosh is None else slosh_effectors(hidden.slosh)
    for particle in particles:
        craft.addStateEffector(particle)
    if hidden.wheel is not None:
        models.append(wheel_effector(hidden.wheel, craft))
    leak = Leak((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)) if hidden.leak is None else hidden.leak
    if hidden.leak is not None:
        action = extForceTorque.ExtForceTorque()
        action.ModelTag = "leak"
        action.extForce_B, action.extTorquePntB_B = column(leak.force), column(leak.torque)
        craft.addDynamicEffector(action)
        models.append(action)
    state = craft.scStateOutMsg.recorder()
    angles = [message.recorder() for message in joints.spinningBodyOutMsgs]
    momentum = craft.logger(["totRotAngMomPntC_N"])
    for model in (*models, craft, state, *angles, momentum):
        base.AddModelToTask("task", model)
    base.InitializeSimulation()
    base.ConfigureStopTime(macros.sec2nano(steps * STEP))
    base.ExecuteSimulation()

    attitude = Rotation.from_mrp(np.array(state.sigma_BN))
    quaternion, rotation = attitude.as_quat(), attitude.as_matrix()
    turning = np.einsum("nji,njk->nik", rotation, _derivatives(rotation)[0])
    rate = np.stack([turning[:, 2, 1], turning[:, 0, 2], turning[:, 1, 0]], axis=1)
    acceleration = _derivatives(np.array(state.r_BN_N) + rotation @ np.array(accel_position))[1]
    position = np.array([angle.theta for angle in angles]).T
    speed, joint_acceleration = _derivatives(position)
    kept = slice(LEAD, steps + 1 - LEAD)
    times = np.round(np.arange(steps + 1 - 2 * LEAD) * STEP, 9)
    goal = np.array([motion(time)[:2] for time in times])
    truth = Truth(
        times=times,
        position=position[kept],
        speed=speed[kept],
        acceleration=joint_acceleration[kept],
        torque=stiffness * (goal[:, 0] - position[kept]) + damper * (goal[:, 1] - speed[kept]),
        rate=rate[kept],
        attitude=quaternion[kept],
        accel=np.einsum("nji,nj->ni", rotation[kept], acceleration[kept]),
        force=np.tile(leak.force, (len(times), 1)),
        external_torque=np.tile(leak.torque, (len(times), 1)),
    )
    return Run(truth, np.array(momentum.totRotAngMomPntC_N)[kept])
