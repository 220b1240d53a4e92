"""True motion of a free-floating robot from Basilisk, with a panel, fuel slosh, a wheel or a leak hidden in it.

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
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from Basilisk.architecture import messaging, sysModel
from Basilisk.simulation import (
    extForceTorque,
    hingedRigidBodyStateEffector,
    linearSpringMassDamper,
    reactionWheelStateEffector,
    spacecraft,
    spinningBodyNDOFStateEffector,
)
from Basilisk.utilities import SimulationBaseClass, macros, simIncludeRW
from scipy.spatial.transform import Rotation

from studies.truth.bodies import SERVICER4, Body, Joint, join, read_urdf, rotation_from_rpy
from studies.truth.motions import Motion
from studies.truth.numerics import Array
from studies.truth.recordings import Truth


@dataclass(frozen=True)
class Panel:
    """A rigid panel hinged on the base and held by a spring; at rest at time 0."""

    mass: float = 3.0  # mass [kg]
    hinge: tuple[float, float, float] = (-0.5, 0.1, 0.2)  # a point of the hinge line, base frame [m]
    # roll, pitch, yaw of the panel's axes at rest relative to the base; y is the hinge line
    rpy: tuple[float, float, float] = (0.5, 0.3, -0.4)
    reach: float = 0.7  # distance of the centre of mass from the hinge, along the panel's -x [m]
    # moments about the centre of mass in the panel's axes [kg m2]
    inertia: tuple[float, float, float] = (0.31, 0.51, 0.8)
    frequency: float = 0.25  # with the base held [Hz]
    damping: float = 0.01  # relative to critical

    @property
    def body(self) -> Body:
        """The panel at rest, base axes."""
        axes = rotation_from_rpy(self.rpy)
        return Body(self.mass, np.array(self.hinge) - self.reach * axes[:, 0], axes @ np.diag(self.inertia) @ axes.T)


@dataclass(frozen=True)
class Slosh:
    """Three particles on springs at one point of the base, each free along one base axis; at rest at time 0.

    `mass` is that of each particle, which is the mass that sloshes along any direction: the `mass` of the contract's
    fuel-slosh. The two other particles move with the base along that direction, so that 3 `mass` is on board at rest.
    Against one particle free in all directions this differs by products of displacement and rate, both small.
    """

    mass: float = 2.0
    position: tuple[float, float, float] = (-0.2, 0.3, -0.4)
    frequency: float = 0.2
    damping: float = 0.01

    @property
    def body(self) -> Body:
        """The three particles at rest, base axes."""
        return Body(3.0 * self.mass, np.array(self.position), np.zeros((3, 3)))


@dataclass(frozen=True)
class Wheel:
    """A balanced wheel that spins freely, without motor torque.

    Its spin momentum relative to inertial space is constant; that relative to the base changes by `spin_inertia` times
    the change of the base's rate, hence the small default.
    """

    momentum: tuple[float, float, float] = (0.02, -0.03, 0.015)
    spin_inertia: float = 1e-4


@dataclass(frozen=True)
class Leak:
    """A constant force and torque at the base origin, base axes."""

    force: tuple[float, float, float] = (4e-4, -3e-4, 5e-4)
    torque: tuple[float, float, float] = (4e-5, 6e-5, -5e-5)


@dataclass(frozen=True)
class BasiliskHidden:
    """What the study's model does not know."""

    panel: Panel | None = None
    slosh: Slosh | None = None
    wheel: Wheel | None = None
    leak: Leak | None = None


_NOTHING = BasiliskHidden()


class Link(NamedTuple):
    """A link of the arm and the joint that carries it."""

    joint: Joint
    body: Body


class Robot(NamedTuple):
    """Name of the base link, the base body, the arm from the base outwards."""

    name: str
    base: Body
    arm: list[Link]


def read_robot(urdf: str | Path) -> Robot:
    """Read a serial arm of revolute joints on a base; a fixed massless tip is left out."""
    robot = read_urdf(urdf)
    joints = {joint.parent: joint for joint in robot.joints}
    parent, arm = robot.base, []
    while parent in joints and joints[parent].child in robot.bodies:
        joint = joints[parent]
        if joint.kind not in ("revolute", "continuous"):
            raise ValueError(f"joint {joint.name} is {joint.kind}; only revolute joints are simulated")
        parent = joint.child
        axis = joint.axis / np.linalg.norm(joint.axis)
        arm.append(Link(joint._replace(axis=axis), robot.bodies[parent]))
    return Robot(robot.base, robot.bodies[robot.base], arm)


def true_base(hidden: BasiliskHidden = _NOTHING, urdf: str | Path = SERVICER4) -> Body:
    """Inertial parameters of the base with all that is fixed on it when nothing moves, the goal of identification."""
    extra = [hidden_part.body for hidden_part in (hidden.panel, hidden.slosh) if hidden_part is not None]
    return join(read_robot(urdf).base, *extra)


def joint_inertias(arm: Sequence[Link], position: Array) -> Array:
    """Inertia of all that a joint carries about its axis [kg m2], (joints,)."""
    rotation, origin = np.eye(3), np.zeros(3)
    axes, origins, bodies = [], [], []
    for link, angle in zip(arm, position, strict=True):
        origin = origin + rotation @ link.joint.offset
        # the arm is mirrored, every joint turned the other way; it sets the stiffness of the servos and nothing else
        rotation = rotation @ link.joint.rotation @ Rotation.from_rotvec(-angle * link.joint.axis).as_matrix()
        axes.append(rotation @ link.joint.axis)
        origins.append(origin)
        tensor = rotation @ link.body.inertia @ rotation.T
        bodies.append(Body(link.body.mass, origin + rotation @ link.body.com, tensor))
    carried = [join(*bodies[index:]) for index in range(len(bodies))]
    return np.array(
        [axis @ body.inertia_about(point) @ axis for axis, point, body in zip(axes, origins, carried, strict=True)]
    )


def column(vector: Sequence[float] | Array) -> list[list[float]]:
    """Vector as a column, which is how Basilisk takes it."""
    return [[float(value)] for value in vector]


def arm_effector(
    arm: Sequence[Link], position: Array, stiffness: Array, damping: Array
) -> spinningBodyNDOFStateEffector.SpinningBodyNDOFStateEffector:
    """Arm whose joints are held by springs and dampers."""
    effector = spinningBodyNDOFStateEffector.SpinningBodyNDOFStateEffector()
    effector.ModelTag = "arm"
    for index, link in enumerate(arm):
        part = spinningBodyNDOFStateEffector.SpinningBody()
        part.setMass(link.body.mass)
        part.setISPntSc_S(link.body.inertia.tolist())
        part.setR_ScS_S(column(link.body.com))
        part.setR_SP_P(column(link.joint.offset))
        part.setDCM_S0P(link.joint.rotation.T.tolist())
        part.setSHat_S(column(link.joint.axis))
        part.setThetaInit(float(position[index]))
        part.setK(float(stiffness[index]))
        part.setC(float(damping[index]))
        effector.addSpinningBody(part)
    return effector


def panel_effector(panel: Panel) -> hingedRigidBodyStateEffector.HingedRigidBodyStateEffector:
    """Panel on its spring."""
    effector = hingedRigidBodyStateEffector.HingedRigidBodyStateEffector()
    effector.ModelTag = "panel"
    omega, about_hinge = 2.0 * np.pi * panel.frequency, panel.inertia[1] + panel.mass * panel.reach**2
    effector.mass, effector.d = panel.mass, panel.reach
    effector.IPntS_S = np.diag(panel.inertia).tolist()
    effector.r_HB_B = column(panel.hinge)
    effector.dcm_HB = rotation_from_rpy(panel.rpy).T.tolist()
    effector.k, effector.c = about_hinge * omega**2, 2.0 * panel.damping * about_hinge * omega
    return effector


def slosh_effectors(slosh: Slosh) -> list[linearSpringMassDamper.LinearSpringMassDamper]:
    """Particles of fuel, one free along each base axis."""
    effectors, omega = [], 2.0 * np.pi * slosh.frequency
    for axis in np.eye(3):
        effector = linearSpringMassDamper.LinearSpringMassDamper()
        effector.massInit = slosh.mass
        effector.k, effector.c = slosh.mass * omega**2, 2.0 * slosh.damping * slosh.mass * omega
        effector.r_PB_B, effector.pHat_B = column(slosh.position), column(axis)
        effectors.append(effector)
    return effectors


def wheel_effector(wheel: Wheel, craft: spacecraft.Spacecraft) -> reactionWheelStateEffector.ReactionWheelStateEffector:
    """Wheel that spins freely on the craft."""
    effector, factory = reactionWheelStateEffector.ReactionWheelStateEffector(), simIncludeRW.rwFactory()
    size = float(np.linalg.norm(wheel.momentum))
    factory.create(
        "custom",
        [value / size for value in wheel.momentum],
        Js=wheel.spin_inertia,
        Omega=size / wheel.spin_inertia / macros.RPM,
        RWModel=messaging.BalancedWheels,
        useMaxTorque=False,
    )
    factory.addToSpacecraft("wheel", effector, craft)
    return effector


# integration step [s] of the classical Runge-Kutta method; angular momentum then drifts by less than 1e-6 N m s
STEP = 0.01

LEAD = 5  # steps before time 0 and after the end, for central differences there


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
    """Noise-free motion at the steps from time 0 on, and the angular momentum about the centre of mass."""

    truth: Truth
    momentum: Array  # (n, 3): angular momentum of all parts, inertial axes [N m s]


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
    motion : callable; Time -> reference positions, speeds, accelerations of the joints; at rest up to time 0
    duration : float; length of the recording [s], a multiple of the step
    hidden : BasiliskHidden
    urdf : path
    rate0, sigma0 : (3,) array_like
        Angular velocity in base axes [rad/s] and modified Rodrigues parameters of the base, `LEAD` steps before
        time 0.
    accel_position : (3,) sequence; mounting point of the accelerometer, base frame [m]
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
