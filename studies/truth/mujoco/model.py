"""True motion of free-flying robots from MuJoCo, and studies written from it; shares no code with the package.

The URDF is read here and rebuilt as a MuJoCo model with a free base and no gravity. Kinematics, inertia matrix,
velocity terms and the accelerometer are MuJoCo's. The joints are driven exactly: at every stage of a classical
Runge-Kutta step their position and speed are set to the prescribed motion, and MuJoCo's equations are solved for the
accelerations that are left free (base, appendages) and for the joint torques. The recorded joint positions are thus
those MuJoCo had, and no servo error limits the accuracy. The gravity gradient is a wrench on every body. What else may
act (drag, a leak, pulses) is a field: a force and torque on the base given by time, attitude and rate.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import expm

Array = NDArray[np.float64]
Motion = Callable[[float], tuple[Array, Array, Array]]
Field = Callable[[float, Array, Array], tuple[Array, Array]]
"""Time, rotation matrix base -> orbit axes, rate in base axes -> force and torque at the base origin, base axes."""

MU = 3.986004418e14
"""Gravitational parameter of the Earth [m3/s2]."""
EARTH_RADIUS = 6371.2e3
"""Of the magnetic field's reference sphere [m]."""
EARTH_FIELD = 3.12e-5
"""Magnetic field on the equator of that sphere [T]."""

ARMATURE = 1.0
"""Inertia of a flexible joint's motor about its axis [kg m2]; the motor is driven, so that nothing else feels it."""

JOINT_TYPES = {
    "revolute": mujoco.mjtJoint.mjJNT_HINGE,
    "continuous": mujoco.mjtJoint.mjJNT_HINGE,
    "prismatic": mujoco.mjtJoint.mjJNT_SLIDE,
}


# Ingredients ----------------------------------------------------------------------------------------------------------


class Body(NamedTuple):
    """Inertial parameters: mass [kg], centre of mass [m], inertia about it [kg m2], in the link's axes."""

    mass: float
    com: Array
    inertia: Array


@dataclass(frozen=True)
class Orbit:
    """A Kepler orbit; angles [rad], radius is the semi-major axis [m], sun is a unit vector (node, along, normal)."""

    radius: float = 6.878e6
    eccentricity: float = 0.0
    argument_of_perigee: float = 0.0
    argument_of_latitude: float = 0.0
    inclination: float | None = None
    sun: tuple[float, float, float] | None = None

    def _anomaly(self, time: float) -> tuple[float, float]:
        """True anomaly [rad] and distance [m]."""
        start = self.argument_of_latitude - self.argument_of_perigee
        mean_motion = np.sqrt(MU / self.radius**3)
        if self.eccentricity == 0.0:
            return start + mean_motion * time, self.radius
        e, squash = self.eccentricity, np.sqrt((1.0 - self.eccentricity) / (1.0 + self.eccentricity))
        eccentric = 2.0 * np.arctan2(squash * np.sin(start / 2.0), np.cos(start / 2.0))
        mean = eccentric - e * np.sin(eccentric) + mean_motion * time
        eccentric = mean + e * np.sin(mean)
        for _ in range(20):
            eccentric -= (eccentric - e * np.sin(eccentric) - mean) / (1.0 - e * np.cos(eccentric))
        anomaly = 2.0 * np.arctan2(np.sin(eccentric / 2.0), squash * np.cos(eccentric / 2.0))
        return anomaly, self.radius * (1.0 - e * np.cos(eccentric))

    def zenith(self, time: float) -> tuple[Array, float]:
        """Zenith in orbit axes (x = zenith at time 0, z = orbit normal) and mu / R^3 [1/s2]."""
        anomaly, distance = self._anomaly(time)
        angle = anomaly - (self.argument_of_latitude - self.argument_of_perigee)
        return np.array([np.cos(angle), np.sin(angle), 0.0]), MU / distance**3

    def heading(self, time: float) -> Array:
        """Direction of the velocity in orbit axes."""
        anomaly, _ = self._anomaly(time)
        start = self.argument_of_latitude - self.argument_of_perigee
        # in the axes of the perigee the velocity is along (-sin, e + cos) of the true anomaly
        x, y = -np.sin(anomaly), self.eccentricity + np.cos(anomaly)
        c, s = np.cos(start), np.sin(start)
        return np.array([c * x + s * y, c * y - s * x, 0.0]) / np.hypot(x, y)

    def from_node(self, vector: ArrayLike) -> Array:
        """Turn a vector given along node, along-orbit, normal into orbit axes."""
        x, y, z = np.asarray(vector, dtype=float)
        c, s = np.cos(self.argument_of_latitude), np.sin(self.argument_of_latitude)
        return np.array([c * x + s * y, c * y - s * x, z])

    def magnetic_field(self, time: float) -> Array:
        """Field [T] of a centred dipole along the Earth's axis, orbit axes."""
        if self.inclination is None:
            raise ValueError("the magnetic field needs the orbit's inclination; give Orbit(inclination=...)")
        up, gradient = self.zenith(time)
        north = self.from_node([0.0, np.sin(self.inclination), np.cos(self.inclination)])
        size = EARTH_FIELD * EARTH_RADIUS**3 * gradient / MU
        return -size * (3.0 * (north @ up) * up - north)


@dataclass(frozen=True)
class Rotor:
    """A wheel in the base that spins at constant speed relative to it; at rest its mass and inertia are the base's."""

    momentum: tuple[float, float, float]
    position: tuple[float, float, float] = (-0.3, 0.1, 0.4)
    mass: float = 6.0
    spin_inertia: float = 0.03

    @property
    def axis(self) -> Array:
        """Unit vector of the spin, base axes."""
        return np.array(self.momentum) / np.linalg.norm(self.momentum)

    @property
    def body(self) -> Body:
        """The rotor at rest, base axes."""
        across = 0.6 * self.spin_inertia
        tensor = across * np.eye(3) + (self.spin_inertia - across) * np.outer(self.axis, self.axis)
        return Body(self.mass, np.array(self.position), tensor)


@dataclass(frozen=True)
class Appendage:
    """A body on the base with spring-held joints, unseen by the recording: a solar panel, a tank of fuel.

    Parameters
    ----------
    body : Body
        In base axes; the centre of mass relative to the base origin.
    hinges, slides : sequence of (3,) array_like
        Axes of its joints, base axes.
    anchor : (3,) array_like
        Where hinges act, base frame [m].
    frequency : float
        Of each joint's spring with the base held and the other joints locked [Hz].
    damping : float
        Relative to critical.
    """

    body: Body
    hinges: Sequence[ArrayLike] = ()
    slides: Sequence[ArrayLike] = ()
    anchor: tuple[float, float, float] = (0.0, 0.0, 0.0)
    frequency: float = 0.2
    damping: float = 0.01


@dataclass(frozen=True)
class Thrust:
    """A constant force and torque at the base origin, base axes, from `start` until `stop` [s]."""

    start: float
    stop: float
    force: tuple[float, float, float] = (0.0, 0.0, 0.0)
    torque: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Flexibility:
    """A spring and damper between a driven joint and what it carries; the recording shows the motor's side.

    The stiffness is J (2 pi frequency)^2, with J the inertia about the joint's axis of all that lies beyond it, the
    other joints locked, in the configuration the model is built with; the damping is relative to critical.
    """

    joint: str
    frequency: float
    damping: float = 0.02


@dataclass(frozen=True)
class Mover:
    """A body in the base that is moved by `travel` along `direction` (base axes) from `start` on, within `duration`."""

    body: Body
    direction: tuple[float, float, float]
    travel: float
    start: float
    duration: float = 2.0

    def motion(self, time: float) -> tuple[float, float, float]:
        """Position, speed and acceleration of a quintic step."""
        x = min(max((time - self.start) / self.duration, 0.0), 1.0)
        value, slope = x**3 * (10.0 - 15.0 * x + 6.0 * x**2), 30.0 * x**2 * (1.0 - x) ** 2
        bend = 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x)
        return self.travel * value, self.travel * slope / self.duration, self.travel * bend / self.duration**2


def slosh(mass: float, position: ArrayLike, frequency: float, damping: float = 0.02) -> Appendage:
    """Fuel as a small ball on three springs: mass [kg], position at rest in the base frame [m], frequency [Hz]."""
    body = Body(mass, np.asarray(position, dtype=float), 1e-4 * mass * np.eye(3))
    return Appendage(body, slides=np.eye(3), frequency=frequency, damping=damping)


def panel(
    mass: float, size: Sequence[float], anchor: ArrayLike, hinge: ArrayLike, frequency: float, damping: float = 0.005
) -> Appendage:
    """Rectangular panel, 2 cm thick, on a sprung hinge.

    Parameters
    ----------
    mass : float
        [kg].
    size : (length, width)
        [m]; the length points away from the base's origin.
    anchor : (3,) array_like
        Middle of the inner edge, base frame [m].
    hinge : (3,) array_like
        Axis of the hinge, base axes; the length is made perpendicular to it.
    frequency : float
        [Hz], with the base held.
    damping : float
        Relative to critical.
    """
    length, width = size
    root, across = np.asarray(anchor, dtype=float), np.asarray(hinge, dtype=float) / np.linalg.norm(hinge)
    along = root - across * (across @ root)
    along /= np.linalg.norm(along)
    thickness = 0.02
    squares = np.array([length, width, thickness]) ** 2
    moments = mass / 12.0 * (squares.sum() - squares)
    axes = np.stack([along, across, np.cross(along, across)], axis=1)
    body = Body(mass, root + 0.5 * length * along, axes * moments @ axes.T)
    return Appendage(body, hinges=[across], anchor=tuple(root), frequency=frequency, damping=damping)


# Fields ---------------------------------------------------------------------------------------------------------------


def _cross(a: Array, b: Array) -> Array:
    """Cross product along the last axis; numpy's is slow on small arrays."""
    result = np.empty(np.broadcast_shapes(a.shape, b.shape))
    result[..., 0] = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    result[..., 1] = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    result[..., 2] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return result


def _pushed(direction: Callable[[float], Array], force: float, cp: ArrayLike) -> Field:
    """Constant force along a direction given in orbit axes, at a point of the base."""
    point = np.asarray(cp, dtype=float)

    def push(time: float, attitude: Array, rate: Array) -> tuple[Array, Array]:
        vector = force * (attitude.T @ direction(time))
        return vector, _cross(point, vector)

    return push


def drag(orbit: Orbit, force: float, cp: ArrayLike) -> Field:
    """Air drag: constant force [N] against the velocity at the centre of pressure [m, base frame]."""
    return _pushed(lambda time: -orbit.heading(time), force, cp)


def sunlight(orbit: Orbit, force: float, cp: ArrayLike) -> Field:
    """Solar pressure: constant force [N] away from the Sun at the centre of pressure [m, base frame]."""
    if orbit.sun is None:
        raise ValueError("solar pressure needs the Sun's direction; give Orbit(sun=...)")
    away = -orbit.from_node(orbit.sun)
    return _pushed(lambda time: away, force, cp)


def magnet(orbit: Orbit, moment: ArrayLike) -> Field:
    """A magnetic moment [A m2, base axes] in the Earth's field."""
    dipole = np.asarray(moment, dtype=float)
    return lambda time, attitude, rate: (np.zeros(3), _cross(dipole, attitude.T @ orbit.magnetic_field(time)))


def leak(force: ArrayLike = (0.0, 0.0, 0.0), torque: ArrayLike = (0.0, 0.0, 0.0)) -> Field:
    """Constant force [N] and torque about the base origin [N m], base axes."""
    wrench = np.asarray(force, dtype=float), np.asarray(torque, dtype=float)
    return lambda time, attitude, rate: wrench


def braking(coefficients: ArrayLike) -> Field:
    """Torque against the rate, -coefficients * rate [N m s], base axes."""
    factor = np.asarray(coefficients, dtype=float)
    return lambda time, attitude, rate: (np.zeros(3), -factor * rate)


def pulses(torque: ArrayLike, *, every: float, length: float, start: float = 0.0) -> Field:
    """Torque pulses, base axes; their edges must be sample times."""
    vector = np.asarray(torque, dtype=float)

    def pulse(time: float, attitude: Array, rate: Array) -> tuple[Array, Array]:
        on = time >= start and (time - start) % every < length
        return np.zeros(3), vector if on else np.zeros(3)

    return pulse


def snap(torque: ArrayLike, *, start: float, decay: float) -> Field:
    """A torque, base axes, that appears at a sample time and dies away exponentially within `decay` [s]."""
    vector = np.asarray(torque, dtype=float)

    def jerk(time: float, attitude: Array, rate: Array) -> tuple[Array, Array]:
        return np.zeros(3), vector * (np.exp((start - time) / decay) if time >= start else 0.0)

    return jerk


def outer_torque(history: Callable[[float], ArrayLike]) -> Field:
    """Any history of a torque in orbit axes [N m], which do not rotate."""
    return lambda time, attitude, rate: (np.zeros(3), attitude.T @ np.asarray(history(time), dtype=float))


# Motion ---------------------------------------------------------------------------------------------------------------


def smooth_motion(
    joints: int,
    duration: float,
    seed: int,
    *,
    amplitude: ArrayLike = 0.5,
    centre: ArrayLike = 0.0,
    frequencies: Sequence[float] = (0.02, 0.035, 0.06),
    ramp: float = 20.0,
) -> Motion:
    """Rest-to-rest motion: sines under a quintic ramp at both ends.

    Parameters
    ----------
    joints : int
        Number of joints.
    duration : float
        [s]; before 0 and after it the joints rest.
    seed : int
        Of amplitudes and phases.
    amplitude, centre : (joints,) array_like or float
        Typical excursion and position at rest of each joint [rad, or m].
    frequencies : sequence of float
        Of the sines [Hz], each varied by up to 20 % from joint to joint.
    ramp : float
        Length of each ramp [s].

    Returns
    -------
    callable
        Time -> positions, speeds, accelerations, each (joints,).
    """
    if 2.0 * ramp > duration:
        raise ValueError(f"two ramps of {ramp:g} s do not fit in {duration:g} s; shorten the ramp")
    generator = np.random.default_rng(seed)
    shape = (joints, len(frequencies))
    omega = 2.0 * np.pi * np.asarray(frequencies) * generator.uniform(0.8, 1.2, shape)
    size = generator.uniform(0.5, 1.0, shape) * np.broadcast_to(amplitude, joints)[:, None] / np.sqrt(shape[1])
    phase = generator.uniform(0.0, 2.0 * np.pi, shape)
    rest = np.broadcast_to(np.asarray(centre, dtype=float), joints)

    def window(time: float) -> Array:
        left, right = (min(max(x / ramp, 0.0), 1.0) for x in (time, duration - time))
        x, sign = (left, 1.0) if left < 1.0 else (right, -1.0)
        value = x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
        slope, bend = 30.0 * x**2 * (1.0 - x) ** 2, 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x)
        return np.array([value, sign * slope / ramp, bend / ramp**2])

    def motion(time: float) -> tuple[Array, Array, Array]:
        s, ds, dds = window(time)
        angle = omega * time + phase
        f = (size * np.sin(angle)).sum(axis=1)
        df = (size * omega * np.cos(angle)).sum(axis=1)
        ddf = -(size * omega**2 * np.sin(angle)).sum(axis=1)
        return rest + s * f, ds * f + s * df, dds * f + 2.0 * ds * df + s * ddf

    return motion


# Model ----------------------------------------------------------------------------------------------------------------


def rotation_from_rpy(rpy: ArrayLike) -> Array:
    """Rotation matrix of URDF's roll, pitch, yaw about fixed axes."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    roll = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    pitch = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    yaw = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return yaw @ pitch @ roll


def _numbers(element: ElementTree.Element | None, attribute: str, default: str) -> Array:
    text = default if element is None else element.get(attribute, default)
    return np.array([float(word) for word in text.split()])


def read_body(link: ElementTree.Element) -> Body | None:
    """Inertial parameters of a URDF link, in link axes; None where it has none."""
    inertial = link.find("inertial")
    if inertial is None:
        return None
    origin = inertial.find("origin")
    rotation = rotation_from_rpy(_numbers(origin, "rpy", "0 0 0"))
    xx, xy, xz, yy, yz, zz = (
        float(inertial.find("inertia").get(name)) for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    )
    tensor = rotation @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ rotation.T
    return Body(float(inertial.find("mass").get("value")), _numbers(origin, "xyz", "0 0 0"), tensor)


def join(*bodies: Body) -> Body:
    """Return the rigid union of bodies given in the same axes."""
    mass = sum(body.mass for body in bodies)
    com = sum(body.mass * body.com for body in bodies) / mass
    tensor = np.zeros((3, 3))
    for body in bodies:
        d = body.com - com
        tensor += body.inertia + body.mass * (d @ d * np.eye(3) - np.outer(d, d))
    return Body(mass, com, tensor)


def _root(urdf: ElementTree.Element) -> ElementTree.Element:
    children = {joint.find("child").get("link") for joint in urdf.iterfind("joint")}
    return next(link for link in urdf.iterfind("link") if link.get("name") not in children)


def _quaternion(rotation: Array) -> Array:
    """MuJoCo's quaternion (w, x, y, z) of a rotation matrix."""
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(rotation).ravel())
    return quaternion


def _set_inertial(spec_body: mujoco.MjsBody, body: Body) -> None:
    moments, axes = np.linalg.eigh(body.inertia)
    axes[:, 2] *= np.linalg.det(axes)
    spec_body.explicitinertial = True
    spec_body.mass, spec_body.ipos = body.mass, body.com
    spec_body.inertia, spec_body.iquat = moments, _quaternion(axes)


def _add_links(
    spec_body: mujoco.MjsBody,
    name: str,
    urdf: ElementTree.Element,
    changed: Mapping[str, Body],
    flexible: Mapping[str, Flexibility],
) -> None:
    """Add everything that hangs on link `name`."""
    links = {link.get("name"): link for link in urdf.iterfind("link")}
    for joint in urdf.iterfind("joint"):
        if joint.find("parent").get("link") != name:
            continue
        child, origin = joint.find("child").get("link"), joint.find("origin")
        quaternion = _quaternion(rotation_from_rpy(_numbers(origin, "rpy", "0 0 0")))
        added = spec_body.add_body(name=child, pos=_numbers(origin, "xyz", "0 0 0"), quat=quaternion)
        body = changed.get(child, read_body(links[child]))
        if body is not None:
            _set_inertial(added, body)
        kind, joint_name = joint.get("type"), joint.get("name")
        if kind != "fixed":
            axis = _numbers(joint.find("axis"), "xyz", "1 0 0")
            motor = added.add_joint(name=joint_name, type=JOINT_TYPES[kind], axis=axis)
            if joint_name in flexible:
                # two coaxial joints on one body: the motor needs an inertia of its own to keep the matrix regular
                motor.armature = ARMATURE
                added.add_joint(name=f"{joint_name} spring", type=JOINT_TYPES[kind], axis=axis)
        _add_links(added, child, urdf, changed, flexible)


def _add_rotor(base: mujoco.MjsBody, rotor: Rotor) -> None:
    added = base.add_body(name="rotor")
    _set_inertial(added, rotor.body)
    added.add_joint(name="rotor", type=mujoco.mjtJoint.mjJNT_HINGE, axis=rotor.axis, pos=rotor.position)


def _add_mover(base: mujoco.MjsBody, name: str, mover: Mover) -> None:
    added = base.add_body(name=name)
    _set_inertial(added, mover.body)
    added.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=mover.direction)


def _add_appendage(base: mujoco.MjsBody, name: str, appendage: Appendage) -> None:
    """Add the body with springs of the wanted frequency: stiffness = inertia about the axis x omega^2."""
    body, omega = appendage.body, 2.0 * np.pi * appendage.frequency
    added = base.add_body(name=name)
    _set_inertial(added, body)
    arm = body.com - np.array(appendage.anchor)
    about_anchor = body.inertia + body.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    kinds = [(mujoco.mjtJoint.mjJNT_HINGE, a) for a in appendage.hinges]
    kinds += [(mujoco.mjtJoint.mjJNT_SLIDE, a) for a in appendage.slides]
    for index, (kind, direction) in enumerate(kinds):
        axis = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
        inertia = axis @ about_anchor @ axis if kind == mujoco.mjtJoint.mjJNT_HINGE else body.mass
        spring = added.add_joint(name=f"{name}_{index}", type=kind, axis=axis, pos=appendage.anchor)
        # MuJoCo 4 takes polynomials; the first coefficient is the linear one
        spring.stiffness = [inertia * omega**2, 0.0, 0.0]
        spring.damping = [2.0 * appendage.damping * inertia * omega, 0.0, 0.0]


# Simulation -----------------------------------------------------------------------------------------------------------


class Truth(NamedTuple):
    """Noise-free motion at n times; base axes unless said otherwise.

    Fields
    ------
    times : (n,) array [s]
    position, speed, acceleration, torque : (n, joints) array
        Of the driven joints, in the order of the URDF.
    rate : (n, 3) array [rad/s]
    attitude : (n, 4) array
        Quaternion x, y, z, w, base axes to orbit axes.
    accel : (n, 3) array [m/s2]
    force, external_torque : (n, 3) array
        Thrust at the base origin [N, N m].
    """

    times: Array
    position: Array
    speed: Array
    acceleration: Array
    torque: Array
    rate: Array
    attitude: Array
    accel: Array
    force: Array
    external_torque: Array


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
        root = _root(tree)
        self.joints = tuple(j.get("name") for j in tree.iterfind("joint") if j.get("type") != "fixed")
        self.orbit, self.thrusts, self.rotor = orbit, tuple(thrusts), rotor
        self.fields, self.movers = tuple(fields), tuple(movers)
        changed, springs = dict(changed or {}), {f.joint: f for f in flexible}
        self._check_names(tree, root.get("name"), changed, springs)
        base = read_body(root)
        at_rest = ([] if rotor is None else [rotor.body]) + [a.body for a in (*appendages, *movers)]
        self.base = join(base, *at_rest)
        """The base body with all that is fixed on it when nothing moves: what identification should find."""

        spec = mujoco.MjSpec()
        spec.option.gravity = np.zeros(3)
        spec_base = spec.worldbody.add_body(name=root.get("name"))
        spec_base.add_freejoint()
        _set_inertial(spec_base, base)
        spec_base.add_site(name="sensor", pos=np.asarray(accel_position, dtype=float))
        for kind in ("ACCELEROMETER", "GYRO"):
            sensor = spec.add_sensor(name=kind, type=getattr(mujoco.mjtSensor, f"mjSENS_{kind}"))
            sensor.objtype, sensor.objname = mujoco.mjtObj.mjOBJ_SITE, "sensor"
        if rotor is not None:
            _add_rotor(spec_base, rotor)
        for index, appendage in enumerate(appendages):
            _add_appendage(spec_base, f"appendage{index}", appendage)
        for index, mover in enumerate(movers):
            _add_mover(spec_base, f"mover{index}", mover)
        _add_links(spec_base, root.get("name"), tree, changed, springs)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self._index_degrees_of_freedom()
        self._stiffen(springs, np.zeros(len(self.joints)) if configuration is None else configuration)

    def _check_names(
        self, tree: ElementTree.Element, root: str, changed: Mapping[str, Body], springs: Mapping[str, Flexibility]
    ) -> None:
        links = {link.get("name") for link in tree.iterfind("link")} - {root}
        for kind, names, known in (("link", changed, links), ("joint", springs, set(self.joints))):
            if not set(names) <= known:
                raise ValueError(f"no {kind} {sorted(set(names) - known)} to change; there are {sorted(known)}")

    def _stiffen(self, springs: Mapping[str, Flexibility], configuration: ArrayLike) -> None:
        """Give flexible joints their stiffness and damping."""
        if not springs:
            return
        data, model = self.data, self.model
        data.qpos[self._driven_q[: len(self.joints)]] = configuration
        mujoco.mj_fwdPosition(model, data)
        mass = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, mass)
        for name, spring in springs.items():
            joint = model.joint(f"{name} spring")
            at, omega = joint.dofadr[0], 2.0 * np.pi * spring.frequency
            model.jnt_stiffness[joint.id] = mass[at, at] * omega**2
            model.dof_damping[at] = 2.0 * spring.damping * mass[at, at] * omega

    def _index_degrees_of_freedom(self) -> None:
        names = self.joints + (() if self.rotor is None else ("rotor",))
        names += tuple(f"mover{index}" for index in range(len(self.movers)))
        joints = [self.model.joint(name) for name in names]
        self._driven_q = np.array([joint.qposadr[0] for joint in joints], dtype=int)
        self._driven_v = np.array([joint.dofadr[0] for joint in joints], dtype=int)
        self._free_v = np.setdiff1d(np.arange(self.model.nv), self._driven_v)
        self._free_free = np.ix_(self._free_v, self._free_v)
        self._free_driven = np.ix_(self._free_v, self._driven_v)
        # beyond the base's seven numbers a joint's address in qpos is that in qvel plus one
        self._spring_v = self._free_v[6:]

    def _prescribed(self, motion: Motion, time: float) -> tuple[Array, Array, Array]:
        arm = motion(time)
        extra = []
        if self.rotor is not None:
            spin = np.linalg.norm(self.rotor.momentum) / self.rotor.spin_inertia
            extra.append((spin * time, spin, 0.0))
        extra += [mover.motion(time) for mover in self.movers]
        if not extra:
            return arm
        return tuple(np.append(values, more) for values, more in zip(arm, zip(*extra, strict=True), strict=True))

    def thrust(self, time: float) -> tuple[Array, Array]:
        """Force and torque at the base origin, base axes."""
        active = [t for t in self.thrusts if t.start <= time < t.stop]
        return sum((np.array(t.force) for t in active), np.zeros(3)), sum(
            (np.array(t.torque) for t in active), np.zeros(3)
        )

    def _tide(self, up: Array, gradient: float, offset: Array) -> Array:
        return gradient * (3.0 * (offset @ up)[..., None] * up - offset)

    def _apply_wrenches(self, time: float, action_time: float) -> None:
        data, model = self.data, self.model
        data.xfrc_applied[:] = 0.0
        if self.orbit is not None:
            up, gradient = self.orbit.zenith(time)
            offset = data.xipos[1:] - data.subtree_com[1]
            axes = data.ximat[1:].reshape(-1, 3, 3)
            inertia_up = np.einsum("bij,bj->bi", axes, model.body_inertia[1:] * (up @ axes))
            data.xfrc_applied[1:, :3] = model.body_mass[1:, None] * self._tide(up, gradient, offset)
            data.xfrc_applied[1:, 3:] = 3.0 * gradient * _cross(up, inertia_up)
        rotation = data.xmat[1].reshape(3, 3)
        if not self.thrusts and not self.fields:
            return
        force, torque = self.thrust(action_time)
        for act in self.fields:
            more = act(action_time, rotation, data.qvel[3:6])
            force, torque = force + more[0], torque + more[1]
        force, torque = rotation @ force, rotation @ torque
        data.xfrc_applied[1, :3] += force
        data.xfrc_applied[1, 3:] += torque + _cross(data.xpos[1] - data.xipos[1], force)

    def _solve(self, motion: Motion, time: float, qpos: Array, qvel: Array, action_time: float) -> Array:
        """Accelerations of all degrees of freedom; MuJoCo's state is left at this time."""
        data, model = self.data, self.model
        position, speed, acceleration = self._prescribed(motion, time)
        data.qpos[:], data.qvel[:] = qpos, qvel
        data.qpos[3:7] /= np.linalg.norm(data.qpos[3:7])
        data.qpos[self._driven_q], data.qvel[self._driven_v] = position, speed
        mujoco.mj_fwdPosition(model, data)
        self._apply_wrenches(time, action_time)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_fwdActuation(model, data)
        mujoco.mj_fwdAcceleration(model, data)
        mass = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, mass)
        free, driven = self._free_v, self._driven_v
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
        # thrust jumps at the end of a step: the last stage must not see the next value
        before = time + h * (1.0 - 1e-9)
        k1 = self._derivative(motion, time, y, time)
        k2 = self._derivative(motion, time + 0.5 * h, y + 0.5 * h * k1, time + 0.5 * h)
        k3 = self._derivative(motion, time + 0.5 * h, y + 0.5 * h * k2, time + 0.5 * h)
        k4 = self._derivative(motion, time + h, y + h * k3, before)
        y = y + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        y[3:7] /= np.linalg.norm(y[3:7])
        return y

    def _read(self, motion: Motion, time: float, y: Array) -> tuple[Array, ...]:
        data, model, nq, count = self.data, self.model, self.model.nq, len(self.joints)
        data.qacc[:] = self._solve(motion, time, y[:nq], y[nq:], time)
        acceleration = data.qacc[self._driven_v[:count]].copy()
        mujoco.mj_rnePostConstraint(model, data)
        mujoco.mj_sensorVel(model, data)
        mujoco.mj_sensorAcc(model, data)
        accel, rate = data.sensordata[:3].copy(), data.sensordata[3:6].copy()
        if self.orbit is not None:
            offset = data.site_xpos[0] - data.subtree_com[1]
            accel -= data.xmat[1].reshape(3, 3).T @ self._tide(*self.orbit.zenith(time), offset)
        position, speed = data.qpos[self._driven_q[:count]].copy(), data.qvel[self._driven_v[:count]].copy()
        attitude = data.qpos[[4, 5, 6, 3]].copy()
        torque = self._torque[:count].copy()
        return np.float64(time), position, speed, acceleration, torque, rate, attitude, accel, *self.thrust(time)

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

    def _march(self, motion: Motion, times: Array, state: Array, step: float) -> list[tuple[Array, ...]]:
        """Read the robot at times that lead away from 0, where it has the given state."""
        time, rows = 0.0, []
        for target in times:
            count = int(np.ceil(abs(target - time) / step - 1e-9))
            for index in range(count):
                h = (target - time) / count
                state = self._step(motion, time + index * h, state, h)
            time = target
            rows.append(self._read(motion, time, state))
        return rows


# Studies --------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Sensors:
    """White noise per sample and sampling of the recordings; a period of None leaves the sensor out.

    With a positive delay the sample stamped t shows the past.
    """

    rate_sigma: float = 1e-5
    accel_sigma: float = 1e-5
    attitude_sigma: float = 1e-5
    encoder_sigma: float = 1e-6
    rate_period: float | None = 0.5
    accel_period: float | None = 0.5
    attitude_period: float | None = None
    encoder_period: float = 0.5
    accel_position: tuple[float, float, float] = (0.1, -0.15, 0.3)
    rate_delay: float = 0.0
    accel_delay: float = 0.0
    encoder_delay: float = 0.0


@dataclass(frozen=True)
class Hidden:
    """What moves the robot besides its arm; the gravity gradient is there when the study has an orbit.

    Fields of the `environment` are made for each recording from its orbit. Links that are `changed` keep their URDF in
    the study; the stiffness of `flexible` joints belongs to the first recording's configuration at rest.
    """

    rotor: Rotor | None = None
    appendages: Sequence[Appendage] = ()
    thrusts: Sequence[Thrust] = ()
    fields: Sequence[Field] = ()
    environment: Sequence[Callable[[Orbit], Field]] = ()
    movers: Sequence[Mover] = ()
    changed: Mapping[str, Body] = field(default_factory=dict)
    flexible: Sequence[Flexibility] = ()


@dataclass(frozen=True)
class Manoeuvres:
    """The joint motions of a study, one `smooth_motion` with a seed of its own per recording.

    `amplitude` is that of rotating joints [rad]; prismatic ones move a third as far in metres. Initial rates are drawn
    with `rate_spread` [rad/s] per axis, initial attitudes from all rotations.
    """

    count: int = 3
    duration: float = 150.0
    amplitude: float = 0.6
    centre_spread: float = 0.6
    frequencies: Sequence[float] = (0.02, 0.035, 0.06)
    ramp: float = 20.0
    rate_spread: float = 5e-4


class Study(NamedTuple):
    """A written study: its TOML file, the true base body (all that is fixed on it included), the noise-free motions."""

    file: Path
    base: Body
    truths: tuple[Truth, ...]


Distortion = Callable[[dict[str, Array], Truth], None]
"""Changes the noise-free columns in place, given with the truth at their times."""
Spoiling = Callable[[dict[str, Array], Array, np.random.Generator], None]
"""Changes the noisy columns in place, given with their times."""


_ORBIT, _HIDDEN, _SENSORS, _MANOEUVRES = Orbit(), Hidden(), Sensors(), Manoeuvres()


def wrong_guess(body: Body, generator: np.random.Generator, spread: float = 0.1) -> Body:
    """Return a physical body that is wrong by about twice `spread` in mass and moments (log-Cholesky fashion)."""
    # never near zero: every guess is really wrong
    change = generator.choice([-1.0, 1.0], (4, 4)) * generator.uniform(0.5, 1.5, (4, 4)) * spread
    return _turned(body, expm(np.triu(change)))


def nearby(body: Body, generator: np.random.Generator, spread: float) -> Body:
    """Draw a physical body from the log-Cholesky prior of relative width `spread` about the given one."""
    scale, *diagonal = np.exp(spread * generator.standard_normal(4))
    upper = np.diag([*diagonal, 1.0]) + np.triu(spread * generator.standard_normal((4, 4)), 1)
    return _turned(body, scale * upper)


def _turned(body: Body, change: Array) -> Body:
    """Multiply the upper Cholesky factor of the body's pseudo-inertia by an upper triangular matrix."""
    second = 0.5 * np.trace(body.inertia) * np.eye(3) - body.inertia + body.mass * np.outer(body.com, body.com)
    first = body.mass * body.com
    pseudo = np.block([[second, first[:, None]], [first[None], np.array([[body.mass]])]])
    factor = np.linalg.cholesky(pseudo[::-1, ::-1])[::-1, ::-1] @ change
    pseudo = factor @ factor.T
    mass, com = pseudo[3, 3], pseudo[:3, 3] / pseudo[3, 3]
    second = pseudo[:3, :3] - mass * np.outer(com, com)
    return Body(mass, com, np.trace(second) * np.eye(3) - second)


def write_urdf(source: str | Path, target: str | Path, base: Body) -> None:
    """Copy a URDF with another base body."""
    tree = ElementTree.parse(source)
    root = _root(tree.getroot())
    root.remove(root.find("inertial"))
    inertial = ElementTree.SubElement(root, "inertial")
    ElementTree.SubElement(inertial, "origin", xyz=" ".join(f"{x:.15g}" for x in base.com), rpy="0 0 0")
    ElementTree.SubElement(inertial, "mass", value=f"{base.mass:.15g}")
    elements = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    ElementTree.SubElement(inertial, "inertia", {key: f"{base.inertia[at]:.15g}" for key, at in elements.items()})
    tree.write(target, xml_declaration=True, encoding="utf-8")


def _sample_times(duration: float, sensors: Sensors) -> dict[str, Array]:
    periods = {
        "position": sensors.encoder_period,
        "rate": sensors.rate_period,
        "accel": sensors.accel_period,
        "attitude": sensors.attitude_period,
    }
    return {
        name: np.round(np.arange(int(duration / period + 1e-9) + 1) * period, 9)
        for name, period in periods.items()
        if period is not None
    }


def _delayed(times: Array, sensors: Sensors) -> dict[str, Array]:
    """When the samples stamped with these times were really taken, by sensor."""
    delays = {"rate": sensors.rate_delay, "accel": sensors.accel_delay, "position": sensors.encoder_delay}
    return {name: np.round(times - delay, 9) for name, delay in delays.items()} | {"attitude": times}


def _rows(truth: Truth, times: Array) -> Truth:
    """Pick the truth at some of its times."""
    at = np.searchsorted(truth.times, times)
    return Truth(*(values[at] for values in truth))


def _table(
    joints: Sequence[str], truths: Mapping[str, Truth], samples: Mapping[str, Array], times: Array
) -> dict[str, Array]:
    """Noise-free columns of a recording; NaN where a sensor takes no sample."""
    table = {}
    names = {"rate": "xyz", "accel": "xyz", "attitude": "xyzw", "position": joints}
    for sensor, taken_at in samples.items():
        taken, values = np.isin(times, taken_at), getattr(truths[sensor], sensor)
        for index, name in enumerate(names[sensor]):
            table[f"{sensor}.{name}"] = np.where(taken, values[:, index], np.nan)
    return table


def _add_noise(table: dict[str, Array], sensors: Sensors, generator: np.random.Generator) -> None:
    sigmas = {"position": sensors.encoder_sigma, "rate": sensors.rate_sigma, "accel": sensors.accel_sigma}
    for name, column in table.items():
        sigma = sigmas.get(name.split(".")[0])
        if sigma is not None:
            column += sigma * generator.standard_normal(column.shape)
    if "attitude.x" in table:
        vector = np.stack([table[f"attitude.{axis}"] for axis in "xyz"], axis=1)
        scalar = table["attitude.w"][:, None]
        # a small rotation d after the true one: q (d / 2, 1), exact to second order in d
        turn = 0.5 * sensors.attitude_sigma * generator.standard_normal(vector.shape)
        noisy = np.hstack([vector + scalar * turn + np.cross(vector, turn), scalar - (vector * turn).sum(1)[:, None]])
        noisy /= np.linalg.norm(noisy, axis=1)[:, None]
        for index, axis in enumerate("xyzw"):
            table[f"attitude.{axis}"] = noisy[:, index]


def _cut_gaps(table: dict[str, Array], times: Array, gaps: Mapping[str, Sequence[tuple[float, float]]]) -> None:
    for channel, intervals in gaps.items():
        columns = [name for name in table if name == channel or name.startswith(channel + ".")]
        if not columns:
            raise ValueError(f"no channel {channel} to cut a gap in; there are {', '.join(table)}")
        for name in columns:
            for start, stop in intervals:
                table[name][(times >= start) & (times < stop)] = np.nan


def _add_thrusts(table: dict[str, Array], truth: Truth, thrusts: Sequence[Thrust]) -> None:
    edges = {edge for thrust in thrusts for edge in (thrust.start, thrust.stop)}
    if not edges <= set(truth.times.tolist()):
        raise ValueError(f"thrusts start and stop at {sorted(edges)} s, which must all be sample times")
    for name, values in (("base_force", truth.force), ("base_torque", truth.external_torque)):
        for index, axis in enumerate("xyz"):
            table[f"{name}.{axis}"] = values[:, index].copy()


def _write_csv(file: Path, times: Array, table: Mapping[str, Array]) -> None:
    rows = [",".join(["time", *table])]
    for index, time in enumerate(times):
        cells = ["" if np.isnan(column[index]) else f"{column[index]:.12g}" for column in table.values()]
        rows.append(",".join([f"{time:.12g}", *cells]))
    file.write_text("\n".join(rows) + "\n")


def _list(values: ArrayLike) -> str:
    return "[" + ", ".join(repr(float(value)) for value in np.asarray(values)) + "]"


def _study_toml(
    title: str,
    base_name: str,
    orbits: Sequence[Orbit | None],
    sensors: Sensors,
    attitudes: Sequence[Array],
    effects: Sequence[str],
    link_spread: float,
    initial_rate: str | None,
) -> str:
    lines = [f'title = "{title}"', "[robot]", 'urdf = "robot.urdf"']
    if link_spread:
        lines += [f"link_spread = {link_spread!r}"]
    orbit = orbits[0]
    if orbit is not None:
        lines += ["[orbit]", f"radius = {orbit.radius!r}"]
        if orbit.eccentricity:
            lines += [f"eccentricity = {orbit.eccentricity!r}", f"argument_of_perigee = {orbit.argument_of_perigee!r}"]
        if orbit.inclination is not None:
            lines += [f"inclination = {orbit.inclination!r}"]
        if orbit.sun is not None:
            lines += [f"sun = {_list(orbit.sun)}"]
    if sensors.rate_period is not None:
        lines += ["[sensors.rate]", f"sigma = {sensors.rate_sigma!r}"]
    if sensors.accel_period is not None:
        lines += ["[sensors.accel]", f"sigma = {sensors.accel_sigma!r}"]
        lines += [f"position = {_list(sensors.accel_position)}"]
    if sensors.attitude_period is not None:
        lines += ["[sensors.attitude]", f"sigma = {sensors.attitude_sigma!r}"]
    lines += ["[sensors.encoder]", f"sigma = {sensors.encoder_sigma!r}"]
    for index, (attitude, place) in enumerate(zip(attitudes, orbits, strict=True), start=1):
        lines += ["[[recordings]]", f'file = "manoeuvre-{index}.csv"', f"attitude = {_list(attitude)}"]
        if place is not None:
            lines += [f"argument_of_latitude = {place.argument_of_latitude!r}"]
    names = ", ".join(f'"{effect}"' for effect in effects)
    lines += ["[unknowns]", f'bodies = ["{base_name}"]', "[model]", f"effects = [{names}]"]
    if initial_rate is not None:
        lines += [f'initial_rate = "{initial_rate}"']
    return "\n".join(lines) + "\n"


def _motion(urdf: ElementTree.Element, plan: Manoeuvres, generator: np.random.Generator) -> Motion:
    kinds = [joint.get("type") for joint in urdf.iterfind("joint") if joint.get("type") != "fixed"]
    scale = np.array([1.0 / 3.0 if kind == "prismatic" else 1.0 for kind in kinds])
    return smooth_motion(
        len(kinds),
        plan.duration,
        int(generator.integers(2**31)),
        amplitude=plan.amplitude * scale,
        centre=plan.centre_spread * scale * generator.uniform(-1.0, 1.0, len(kinds)),
        frequencies=plan.frequencies,
        ramp=plan.ramp,
    )


def write_study(
    folder: str | Path,
    urdf: str | Path,
    generator: np.random.Generator,
    *,
    orbit: Orbit | None = _ORBIT,
    hidden: Hidden = _HIDDEN,
    sensors: Sensors = _SENSORS,
    manoeuvres: Manoeuvres = _MANOEUVRES,
    effects: Sequence[str] | None = None,
    guess_spread: float = 0.1,
    declared_accel_position: ArrayLike | None = None,
    record_thrusts: bool = True,
    gaps: Mapping[str, Sequence[tuple[float, float]]] | None = None,
    distort: Distortion | None = None,
    spoil: Spoiling | None = None,
    declared: Sensors | None = None,
    link_spread: float = 0.0,
    initial_rate: str | None = None,
    latitudes: Sequence[float] | None = None,
    step: float = 0.05,
    title: str = "MuJoCo truth",
) -> Study:
    """Write robot.urdf, manoeuvre-N.csv and study.toml into a folder.

    Parameters
    ----------
    folder : path
        Made where it does not exist.
    urdf : path
        The robot as it truly is; the study's copy has a wrong base.
    generator : numpy.random.Generator
        Of motions, initial values, guess and noise.
    orbit : Orbit, optional
        None: no orbit, no gravity gradient.
    hidden : Hidden
        Wheel, appendages, thrust. Only thrust is told to the study, and only with `record_thrusts`.
    sensors : Sensors
    manoeuvres : Manoeuvres
    effects : sequence of str, optional
        Effects the study's model has; by default the gravity gradient where there is an orbit.
    guess_spread : float
        How wrong the base of the study's URDF is, see `wrong_guess`; 0 leaves it true.
    declared_accel_position : (3,) array_like, optional
        What the study says in place of the true `sensors.accel_position` [m].
    record_thrusts : bool
        Whether thrusts are written as base_force and base_torque; they must then start and stop at sample times.
    gaps : mapping, optional
        Channel ("accel", "position.joint2") -> intervals (start, stop) [s] with empty cells.
    distort : callable, optional
        Changes the noise-free columns (in place) of each recording, given with the truth: a sensor's error.
    spoil : callable, optional
        Changes the noisy columns (in place), given with their times and the generator: outliers, quantisation.
    declared : Sensors, optional
        What the study says in place of `sensors`; their delays are never told.
    link_spread : float
        The study's; the links that really are there are drawn within it.
    initial_rate : str, optional
        The study's.
    latitudes : sequence of float, optional
        Argument of latitude of each recording [rad] in place of the orbit's.
    step : float
        Largest integration step [s].
    title : str

    Returns
    -------
    Study
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    tree = ElementTree.parse(urdf).getroot()
    options = {
        "rotor": hidden.rotor,
        "appendages": hidden.appendages,
        "thrusts": hidden.thrusts,
        "movers": hidden.movers,
        "flexible": hidden.flexible,
        "accel_position": sensors.accel_position,
    }
    model = TruthModel(urdf, **options)
    write_urdf(urdf, folder / "robot.urdf", wrong_guess(model.base, generator, guess_spread))
    changed = _drawn_links(tree, generator, link_spread) | dict(hidden.changed)
    samples = _sample_times(manoeuvres.duration, sensors)
    times = np.unique(np.concatenate(list(samples.values())))
    taken = _delayed(times, sensors)
    truths, attitudes, orbits, configuration = [], [], [], None
    for index in range(1, manoeuvres.count + 1):
        attitude = generator.standard_normal(4)
        attitudes.append(attitude / np.linalg.norm(attitude))
        rate = manoeuvres.rate_spread * generator.standard_normal(3)
        motion = _motion(tree, manoeuvres, generator)
        configuration = motion(0.0)[0] if configuration is None else configuration
        orbits.append(orbit if latitudes is None else replace(orbit, argument_of_latitude=latitudes[index - 1]))
        fields = [*hidden.fields, *(make(orbits[-1]) for make in hidden.environment)]
        model = TruthModel(
            urdf, orbit=orbits[-1], fields=fields, changed=changed, configuration=configuration, **options
        )
        whole = model.run(
            motion, np.unique(np.concatenate(list(taken.values()))), rate0=rate, attitude0=attitudes[-1], step=step
        )
        truth = _rows(whole, times)
        table = _table(model.joints, {name: _rows(whole, when) for name, when in taken.items()}, samples, times)
        if distort is not None:
            distort(table, truth)
        _add_noise(table, sensors, generator)
        if spoil is not None:
            spoil(table, times, generator)
        _cut_gaps(table, times, gaps or {})
        if hidden.thrusts and record_thrusts:
            _add_thrusts(table, truth, hidden.thrusts)
        _write_csv(folder / f"manoeuvre-{index}.csv", times, table)
        truths.append(truth)
    if effects is None:
        effects = () if orbit is None else ("gravity-gradient",)
    told = sensors if declared is None else declared
    if declared_accel_position is not None:
        told = replace(told, accel_position=tuple(np.asarray(declared_accel_position, dtype=float)))
    file = folder / "study.toml"
    root = _root(tree).get("name")
    file.write_text(_study_toml(title, root, orbits, told, attitudes, effects, link_spread, initial_rate))
    return Study(file, model.base, tuple(truths))


def _drawn_links(tree: ElementTree.Element, generator: np.random.Generator, spread: float) -> dict[str, Body]:
    """Draw the links that joints move; what is fixed on them stays."""
    if not spread:
        return {}
    links = {link.get("name"): read_body(link) for link in tree.iterfind("link")}
    moved = [joint.find("child").get("link") for joint in tree.iterfind("joint") if joint.get("type") != "fixed"]
    return {name: nearby(links[name], generator, spread) for name in moved if links[name] is not None}
