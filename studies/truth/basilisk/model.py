"""True motion of a free-floating robot from Basilisk, and studies written from it; shares no code with the package.

A serial arm of revolute joints is read from a URDF and hung on a Basilisk hub (`SpinningBodyNDOFStateEffector`). Each
joint is held by a spring and a damper of Basilisk's, and a motor torque moves their rest position along a smooth
reference: a servo that follows it badly. The recorded angles are those that result. The motor torque is held over each
step at its value in the middle of the step, which leaves a ripple in the speeds that is gone at the steps in angles and
attitude. Rates and accelerations are therefore those of the smooth motion through the steps: central differences of
sixth order of attitude, position and angles. They agree with another simulator to 1e-9 rad/s and 1e-9 m/s2; Basilisk's
own rates at the steps are off that motion by up to 1e-6 rad/s.

There is no gravity and no orbit: Basilisk's gravity is uniform over the craft and its gravity gradient a torque on the
whole of it, computed from the composite inertia, so that links and accelerometer would not feel the tide.

Hidden parts are Basilisk's too: a hinged panel, fuel slosh, a balanced reaction wheel, a constant force and torque.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

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
from mujoco_truth import (
    Array,
    Body,
    Manoeuvres,
    Motion,
    Truth,
    join,
    read_body,
    rotation_from_rpy,
    smooth_motion,
    write_urdf,
    wrong_guess,
)

ROBOT = Path(__file__).parent / "robots" / "servicer4.urdf"
STEP = 0.01
"""Integration step [s] of the classical Runge-Kutta method; angular momentum then drifts by less than 1e-6 N m s."""
LEAD = 5
"""Steps before time 0 and after the end, for central differences there."""


# Hidden parts ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Panel:
    """A rigid panel hinged on the base and held by a spring; at rest at time 0.

    Parameters
    ----------
    mass : float
        [kg].
    hinge : (3,) tuple
        A point of the hinge line, base frame [m].
    rpy : (3,) tuple
        Roll, pitch, yaw of the panel's axes at rest relative to the base; y is the hinge line.
    reach : float
        Distance of the centre of mass from the hinge, along the panel's -x [m].
    inertia : (3,) tuple
        Moments about the centre of mass in the panel's axes [kg m2].
    frequency : float
        With the base held [Hz].
    damping : float
        Relative to critical.
    """

    mass: float = 3.0
    hinge: tuple[float, float, float] = (-0.5, 0.1, 0.2)
    rpy: tuple[float, float, float] = (0.5, 0.3, -0.4)
    reach: float = 0.7
    inertia: tuple[float, float, float] = (0.31, 0.51, 0.8)
    frequency: float = 0.25
    damping: float = 0.01

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
_MANOEUVRES = Manoeuvres()


# The robot ------------------------------------------------------------------------------------------------------------


class Link(NamedTuple):
    """A link of the arm and the joint that carries it; offset and rotation place the joint in its parent's axes."""

    joint: str
    body: Body
    offset: Array
    rotation: Array
    axis: Array


def _numbers(element: ElementTree.Element, attribute: str) -> Array:
    return np.array([float(word) for word in element.get(attribute).split()])


class Robot(NamedTuple):
    """Name of the base link, the base body, the arm from the base outwards."""

    name: str
    base: Body
    arm: list[Link]


def read_robot(urdf: str | Path) -> Robot:
    """Read a serial arm of revolute joints on a base; a fixed massless tip is left out."""
    tree = ElementTree.parse(urdf).getroot()
    links = {link.get("name"): link for link in tree.iterfind("link")}
    children = {joint.find("child").get("link") for joint in tree.iterfind("joint")}
    parent = next(name for name in links if name not in children)
    root, arm = parent, []
    while joint := next((j for j in tree.iterfind("joint") if j.find("parent").get("link") == parent), None):
        parent = joint.find("child").get("link")
        body = read_body(links[parent])
        if body is None:
            break
        if joint.get("type") not in ("revolute", "continuous"):
            raise ValueError(f"joint {joint.get('name')} is {joint.get('type')}; only revolute joints are simulated")
        rotation = rotation_from_rpy(_numbers(joint.find("origin"), "rpy"))
        offset, axis = _numbers(joint.find("origin"), "xyz"), _numbers(joint.find("axis"), "xyz")
        arm.append(Link(joint.get("name"), body, offset, rotation, axis / np.linalg.norm(axis)))
    return Robot(root, read_body(links[root]), arm)


def true_base(hidden: BasiliskHidden = _NOTHING, urdf: str | Path = ROBOT) -> Body:
    """Return the base body with all that is fixed on it when nothing moves: what identification should find."""
    parts = [part.body for part in (hidden.panel, hidden.slosh) if part is not None]
    return join(read_robot(urdf).base, *parts)


def _turn(axis: Array, angle: float) -> Array:
    cross = np.cross(np.eye(3), axis).T
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


def _joint_inertias(arm: Sequence[Link], position: Array) -> Array:
    """Inertia of all that a joint carries about its axis [kg m2], (joints,)."""
    rotation, origin, axes, origins, bodies = np.eye(3), np.zeros(3), [], [], []
    for link, angle in zip(arm, position, strict=True):
        origin = origin + rotation @ link.offset
        rotation = rotation @ link.rotation @ _turn(link.axis, angle)
        axes.append(rotation @ link.axis)
        origins.append(origin)
        tensor = rotation @ link.body.inertia @ rotation.T
        bodies.append(Body(link.body.mass, origin + rotation @ link.body.com, tensor))
    result = []
    for index, (axis, point) in enumerate(zip(axes, origins, strict=True)):
        carried = join(*bodies[index:])
        arm_length = np.cross(axis, carried.com - point)
        result.append(axis @ carried.inertia @ axis + carried.mass * arm_length @ arm_length)
    return np.array(result)


# Simulation -----------------------------------------------------------------------------------------------------------


class _Motors(sysModel.SysModel):
    """Write the torques of each step."""

    def __init__(self, torques: Array) -> None:
        super().__init__()
        self.ModelTag = "motors"
        self.torques = torques.tolist()
        self.out = messaging.ArrayMotorTorqueMsg()
        self.payload = messaging.ArrayMotorTorqueMsgPayload()

    def Reset(self, nanoseconds: int) -> None:
        self.UpdateState(nanoseconds)

    def UpdateState(self, nanoseconds: int) -> None:
        step = min(round(nanoseconds * 1e-9 / STEP), len(self.torques) - 1)
        self.payload.motorTorque = self.torques[step]
        self.out.write(self.payload, nanoseconds, self.moduleID)


def _column(vector: Sequence[float] | Array) -> list[list[float]]:
    return [[float(value)] for value in vector]


def _arm_effector(
    arm: Sequence[Link], position: Array, stiffness: Array, damping: Array
) -> spinningBodyNDOFStateEffector.SpinningBodyNDOFStateEffector:
    effector = spinningBodyNDOFStateEffector.SpinningBodyNDOFStateEffector()
    effector.ModelTag = "arm"
    for index, link in enumerate(arm):
        part = spinningBodyNDOFStateEffector.SpinningBody()
        part.setMass(link.body.mass)
        part.setISPntSc_S(link.body.inertia.tolist())
        part.setR_ScS_S(_column(link.body.com))
        part.setR_SP_P(_column(link.offset))
        part.setDCM_S0P(link.rotation.T.tolist())
        part.setSHat_S(_column(link.axis))
        part.setThetaInit(float(position[index]))
        part.setK(float(stiffness[index]))
        part.setC(float(damping[index]))
        effector.addSpinningBody(part)
    return effector


def _panel_effector(panel: Panel) -> hingedRigidBodyStateEffector.HingedRigidBodyStateEffector:
    effector = hingedRigidBodyStateEffector.HingedRigidBodyStateEffector()
    effector.ModelTag = "panel"
    omega, about_hinge = 2.0 * np.pi * panel.frequency, panel.inertia[1] + panel.mass * panel.reach**2
    effector.mass, effector.d = panel.mass, panel.reach
    effector.IPntS_S = np.diag(panel.inertia).tolist()
    effector.r_HB_B = _column(panel.hinge)
    effector.dcm_HB = rotation_from_rpy(panel.rpy).T.tolist()
    effector.k, effector.c = about_hinge * omega**2, 2.0 * panel.damping * about_hinge * omega
    return effector


def _slosh_effectors(slosh: Slosh) -> list[linearSpringMassDamper.LinearSpringMassDamper]:
    effectors, omega = [], 2.0 * np.pi * slosh.frequency
    for axis in np.eye(3):
        effector = linearSpringMassDamper.LinearSpringMassDamper()
        effector.massInit = slosh.mass
        effector.k, effector.c = slosh.mass * omega**2, 2.0 * slosh.damping * slosh.mass * omega
        effector.r_PB_B, effector.pHat_B = _column(slosh.position), _column(axis)
        effectors.append(effector)
    return effectors


def _wheel_effector(
    wheel: Wheel, craft: spacecraft.Spacecraft
) -> reactionWheelStateEffector.ReactionWheelStateEffector:
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


def _derivatives(values: Array) -> tuple[Array, Array]:
    """First and second derivative of values at steps by central differences; zero in three rows at either end."""
    first, second = np.zeros_like(values), np.zeros_like(values)
    centre = values[3:-3]
    for k, slope, bend in ((1, 0.75, 1.5), (2, -0.15, -0.15), (3, 1.0 / 60.0, 1.0 / 90.0)):
        ahead, behind = values[3 + k : len(values) - 3 + k], values[3 - k : -3 - k]
        first[3:-3] += slope * (ahead - behind) / STEP
        second[3:-3] += bend * ((ahead - centre) - (centre - behind)) / STEP**2
    return first, second


def _rotations(sigma: Array) -> tuple[Array, Array]:
    """Quaternions x, y, z, w and matrices, base axes to inertial axes, of modified Rodrigues parameters (n, 3)."""
    square = (sigma**2).sum(axis=1)[:, None]
    quaternion = np.hstack([2.0 * sigma, 1.0 - square]) / (1.0 + square)
    x, y, z, w = quaternion.T
    matrix = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return quaternion, np.moveaxis(np.array(matrix), 2, 0)


class Run(NamedTuple):
    """Noise-free motion at the steps from time 0 on, and the angular momentum about the centre of mass.

    Fields
    ------
    truth : Truth
    momentum : (n, 3) array
        Of all parts, inertial axes [N m s].
    """

    truth: Truth
    momentum: Array


def simulate(
    motion: Motion,
    duration: float,
    *,
    hidden: BasiliskHidden = _NOTHING,
    urdf: str | Path = ROBOT,
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
        [s], a multiple of the step.
    hidden : BasiliskHidden
    urdf : path
    rate0, sigma0 : (3,) array_like
        Angular velocity in base axes [rad/s] and modified Rodrigues parameters of the base, `LEAD` steps before
        time 0.
    accel_position : (3,) sequence
        Mounting point of the accelerometer, base frame [m].
    frequency, damping : float
        Of the servo of each joint with the others locked and the base held [Hz, relative to critical].

    Returns
    -------
    Run
    """
    _, hub, arm = read_robot(urdf)
    steps = round(duration / STEP) + 2 * LEAD
    reference = np.array([motion((step - LEAD - 0.5) * STEP)[:2] for step in range(steps + 1)])
    omega = 2.0 * np.pi * frequency
    inertias = _joint_inertias(arm, reference[0, 0])
    stiffness, damper = inertias * omega**2, 2.0 * damping * inertias * omega

    base = SimulationBaseClass.SimBaseClass()
    base.CreateNewProcess("process").addTask(base.CreateNewTask("task", macros.sec2nano(STEP)))
    craft = spacecraft.Spacecraft()
    craft.ModelTag = "craft"
    craft.hub.mHub, craft.hub.r_BcB_B = hub.mass, _column(hub.com)
    craft.hub.IHubPntBc_B = hub.inertia.tolist()
    craft.hub.r_CN_NInit, craft.hub.v_CN_NInit = _column(np.zeros(3)), _column(np.zeros(3))
    craft.hub.sigma_BNInit, craft.hub.omega_BN_BInit = _column(sigma0), _column(rate0)

    # in the order of the task: the torque written at a step acts over the step that ends there
    motors = _Motors(reference[:, 0] * stiffness + reference[:, 1] * damper)
    joints = _arm_effector(arm, reference[0, 0], stiffness, damper)
    joints.motorTorqueInMsg.subscribeTo(motors.out)
    craft.addStateEffector(joints)
    models = [motors, joints]
    if hidden.panel is not None:
        models.append(_panel_effector(hidden.panel))
        craft.addStateEffector(models[-1])
    particles = [] if hidden.slosh is None else _slosh_effectors(hidden.slosh)
    for particle in particles:
        craft.addStateEffector(particle)
    if hidden.wheel is not None:
        models.append(_wheel_effector(hidden.wheel, craft))
    leak = Leak((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)) if hidden.leak is None else hidden.leak
    if hidden.leak is not None:
        action = extForceTorque.ExtForceTorque()
        action.ModelTag = "leak"
        action.extForce_B, action.extTorquePntB_B = _column(leak.force), _column(leak.torque)
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

    quaternion, rotation = _rotations(np.array(state.sigma_BN))
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


# Studies --------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Instruments:
    """White noise per sample and the common period of rate sensor, accelerometer and encoders, a multiple of `STEP`."""

    period: float = 0.5
    rate_sigma: float = 1e-5
    accel_sigma: float = 1e-5
    encoder_sigma: float = 1e-6
    accel_position: tuple[float, float, float] = (0.1, -0.15, 0.3)


_INSTRUMENTS, _MANOEUVRES = Instruments(), Manoeuvres()


def _recording(
    joints: Sequence[str], truth: Truth, instruments: Instruments, generator: np.random.Generator
) -> dict[str, Array]:
    """Columns of a recording, noisy, at the instruments' times."""
    stride = round(instruments.period / STEP)
    if stride < 1 or abs(stride * STEP - instruments.period) > 1e-9:
        raise ValueError(f"the period is {instruments.period} s; it must be a multiple of {STEP} s")
    table = {"time": truth.times[::stride]}
    channels = (
        ("rate", "xyz", truth.rate, instruments.rate_sigma),
        ("accel", "xyz", truth.accel, instruments.accel_sigma),
        ("position", joints, truth.position, instruments.encoder_sigma),
    )
    for channel, names, values, sigma in channels:
        noisy = values[::stride] + sigma * generator.standard_normal(values[::stride].shape)
        table |= {f"{channel}.{name}": noisy[:, index] for index, name in enumerate(names)}
    return table


def _study_toml(title: str, base: str, instruments: Instruments, attitudes: Sequence[Array]) -> str:
    lines = [
        f'title = "{title}"',
        "[robot]",
        'urdf = "robot.urdf"',
        "[sensors.rate]",
        f"sigma = {instruments.rate_sigma!r}",
        "[sensors.accel]",
        f"sigma = {instruments.accel_sigma!r}",
        f"position = {list(instruments.accel_position)}",
        "[sensors.encoder]",
        f"sigma = {instruments.encoder_sigma!r}",
    ]
    for index, attitude in enumerate(attitudes, start=1):
        lines += ["[[recordings]]", f'file = "manoeuvre-{index}.csv"', f"attitude = {attitude.tolist()}"]
    return "\n".join([*lines, "[unknowns]", f'bodies = ["{base}"]', ""])


def write_basilisk_study(
    folder: str | Path,
    seed: int,
    *,
    hidden: BasiliskHidden = _NOTHING,
    urdf: str | Path = ROBOT,
    instruments: Instruments = _INSTRUMENTS,
    manoeuvres: Manoeuvres = _MANOEUVRES,
    guess_spread: float = 0.15,
    title: str = "Basilisk truth",
) -> Path:
    """Write robot.urdf, manoeuvre-N.csv and study.toml into a folder.

    Parameters
    ----------
    folder : path
        Made where it does not exist.
    seed : int
        Of motions, initial values, guess and noise.
    hidden : BasiliskHidden
        Parts and actions that the study's model lacks.
    urdf : path
        The robot as it truly is, a serial arm on a base; the study's copy has a wrong base and the true arm.
    instruments : Instruments
    manoeuvres : Manoeuvres
        The joints' reference motions; the joints follow them badly.
    guess_spread : float
        The study's base is wrong by about twice this in mass and moments; 0 leaves it true.
    title : str

    Returns
    -------
    Path
        The study's TOML file. What identification should find is `true_base(hidden, urdf)`.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    generator = np.random.default_rng(seed)
    base, _, arm = read_robot(urdf)
    joints = [link.joint for link in arm]
    write_urdf(urdf, folder / "robot.urdf", wrong_guess(true_base(hidden, urdf), generator, guess_spread))
    attitudes = []
    for index in range(1, manoeuvres.count + 1):
        motion = smooth_motion(
            len(arm),
            manoeuvres.duration,
            int(generator.integers(2**31)),
            amplitude=manoeuvres.amplitude,
            centre=manoeuvres.centre_spread * generator.uniform(-1.0, 1.0, len(arm)),
            frequencies=manoeuvres.frequencies,
            ramp=manoeuvres.ramp,
        )
        truth = simulate(
            motion,
            manoeuvres.duration,
            hidden=hidden,
            urdf=urdf,
            rate0=manoeuvres.rate_spread * generator.standard_normal(3),
            sigma0=0.5 * generator.standard_normal(3),
            accel_position=instruments.accel_position,
        ).truth
        attitudes.append(truth.attitude[0])
        table = _recording(joints, truth, instruments, generator)
        header, rows = ",".join(table), np.stack(list(table.values()), axis=1)
        np.savetxt(folder / f"manoeuvre-{index}.csv", rows, fmt="%.12g", delimiter=",", header=header, comments="")
    file = folder / "study.toml"
    file.write_text(_study_toml(title, base, instruments, attitudes))
    return file
