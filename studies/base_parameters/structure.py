"""Base parameters of a robot, its equations, identification by torques, data that show the scale, and FIGAROH's way."""

from __future__ import annotations

import importlib.util
import warnings
from dataclasses import dataclass
from importlib.metadata import version
from types import SimpleNamespace

import numpy as np
import pinocchio as pin
from scipy.linalg import subspace_angles

from bayesid import Load, Robot
from bayesid._math.arrays import Floats
from bayesid.identifiability import Base, BaseParameters, base_parameters, standard_names
from bayesid.identifiability.base_parameters import GRAVITY, massive_bodies, random_motion, stacked_regressor
from bayesid.robot.composite_tables import link_table
from bayesid.robot.inertial_parameters import InertialParameters
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import Kinematics, configuration, kinematics
from bayesid.robot.regressors import gradient_regressor, torque_regressor
from studies.common.mass_scale import Determined, consistent_accelerations, determined, rates_at_rest

SEED = 1991  # seed of the random states in which singular values are computed


@dataclass(frozen=True)
class Structure:
    """Identifiable part of a robot's parameters."""

    robot: Robot
    base: BaseParameters
    singular: Floats  # (n,): singular values of the regressor with columns of unit length, relative to the largest
    parameters: Floats  # (n,): parameters of the robot, in the order of ``base.standard``


@dataclass(frozen=True)
class Equations:
    """The paper's (23) in one state; base force and torque [N, N m], then the joint torques [N m]."""

    regressor: Floats  # (6 + joints,): product of this package's regressor with the parameters
    pinocchio: Floats  # (6 + joints,): result of Pinocchio's recursive Newton-Euler algorithm


def structure(robot: Robot, base: Base = Base.FREE) -> Structure:
    """Return which part of a robot's parameters can be identified."""
    regressor = stacked_regressor(robot, massive_bodies(robot), base, np.random.default_rng(SEED))
    length = np.linalg.norm(regressor, axis=0)
    values = np.linalg.svd(regressor / np.where(length > 0.0, length, 1.0), compute_uv=False)
    return Structure(robot, base_parameters(robot, base=base), values / values[0], standard_parameters(robot))


def standard_parameters(robot: Robot) -> Floats:
    """Return the linear parameters of all bodies, in the order of `BaseParameters.standard`."""
    return np.concatenate([robot.link(body).inertial.vector for body in massive_bodies(robot)])


def equations_at(robot: Robot, rng: np.random.Generator) -> Equations:
    """Evaluate (23) in a random state of the robot on which no wrench acts."""
    position, velocity, acceleration = rng.normal(size=(3, 1, len(robot.joints)))
    motion = kinematics(robot, JointState(position, velocity, acceleration))
    rate = rng.normal(size=(1, 3))
    change, lift = consistent_accelerations(robot, motion, rate, np.zeros((1, 6)))
    regressor = torque_regressor(robot, massive_bodies(robot), motion, rate, change, lift)[0]
    expected = pin.rnea(
        robot.model,
        robot.model.createData(),
        configuration(robot, position[0]),
        np.concatenate([np.zeros(3), rate[0], velocity[0]]),
        np.concatenate([lift[0], change[0], acceleration[0]]),
    )
    return Equations(regressor @ standard_parameters(robot), expected)


STATES = 60  # number of instants at which motion and torques are measured
WRONG = 1.05  # factor by which the wrong K_2 differs from the true one


@dataclass(frozen=True)
class Recovery:
    """Result of a least-squares identification with exact data."""

    base_error: float  # largest error of K_B relative to its largest entry of the same unit
    standard_error: float  # largest such error of all standard parameters, recovered with the true K_2
    # name, true value, and value recovered with K_2 wrong by 5 %, of the parameters of K_1 that change most
    shifted: tuple[tuple[str, float, float], ...]
    untouched: int  # number of parameters of K_1 that do not change at all
    # largest error of the torques that the wrong set predicts, by Pinocchio, relative to the largest torque
    torque_error: float


def identify_by_torques(robot: Robot, rng: np.random.Generator) -> Recovery:
    """Solve (23) for the base parameters, with the torques that Pinocchio gives, and recover the others."""
    base, bodies, p = base_parameters(robot), massive_bodies(robot), standard_parameters(robot)
    state = JointState(*rng.normal(size=(3, STATES, len(robot.joints))))
    rate = 0.1 * rng.normal(size=(STATES, 3))
    motion = kinematics(robot, state)
    change, lift = consistent_accelerations(robot, motion, rate, np.zeros((STATES, 6)))
    regressor = torque_regressor(robot, bodies, motion, rate, change, lift).reshape(-1, len(p))

    def torques(inertias: Floats) -> Floats:
        """Return Pinocchio's wrench on the base and joint torques, one instant after the other."""
        model = robot.model.copy()
        for body, vector in zip(bodies, inertias.reshape(-1, 10), strict=True):
            model.inertias[robot.link(body).joint + 2] = pin.Inertia.FromDynamicParameters(vector)
        data, rows = model.createData(), []
        for row in range(STATES):
            v = np.concatenate([np.zeros(3), rate[row], state.velocity[row]])
            a = np.concatenate([lift[row], change[row], state.acceleration[row]])
            rows.append(pin.rnea(model, data, configuration(robot, state.position[row]), v, a).copy())
        return np.concatenate(rows)

    independent = regressor[:, [base.standard.index(name) for name in base.independent]]
    measured = torques(p)
    grouped = np.linalg.lstsq(independent, measured)[0]
    value = dict(zip(base.standard, p, strict=True))
    second = np.array([value[name] for name in base.dependent])
    recovered, wrong = base.recover(grouped, second), base.recover(grouped, WRONG * second)
    moved = {
        name: (float(p[index]), float(wrong[index]))
        for index, name in enumerate(base.standard)
        if name in base.independent
    }
    order = sorted(moved, key=lambda name: -abs(moved[name][1] - moved[name][0]))
    return Recovery(
        base_error=_relative(grouped, base.project(p), base.independent),
        standard_error=_relative(recovered, p, base.standard),
        shifted=tuple((name, *moved[name]) for name in order[:8]),
        untouched=sum(abs(new - old) < 1e-6 for old, new in moved.values()),
        torque_error=float(np.abs(torques(wrong) - measured).max() / np.abs(measured).max()),
    )


def _relative(values: Floats, true: Floats, names: tuple[str, ...]) -> float:
    """Return the largest error, relative to the largest value of the same kind: mass, first moment, inertia."""
    kinds = np.array([name.split(".")[1] for name in names])
    return max(float(np.abs((values - true)[kinds == k]).max() / np.abs(true[kinds == k]).max()) for k in set(kinds))


SCALE_STATES = 90  # number of random states, many more than the parameters need
GRADIENT = 1.0  # gravity gradient mu / R^3, in units of time in which the random states turn at about the mean motion
ACTION = 1.0e3  # size of known forces, torques and momenta in the same units, as large as those of the arm's motion


@dataclass(frozen=True)
class ScaleCase:
    """Base parameters that some data determine."""

    data: str  # description of what is measured and known
    determined: Determined  # number of determined base parameters, and singular values on both sides of the rank
    open_scale: bool  # whether the data allow any common factor of all base parameters


def scale_cases(robot: Robot, rng: np.random.Generator) -> tuple[ScaleCase, ...]:
    """Return what motion alone determines, and what it determines together with further knowledge."""
    world = _World(robot, rng)
    wheel, thrust, torque = np.zeros((3, SCALE_STATES, 6))
    momentum = ACTION * np.array([0.5, -0.8, 0.3])
    wheel[:, 3:] = -np.cross(world.rate, momentum)
    wheel[::10, 3:] -= momentum  # spun up at times
    thrust[:: SCALE_STATES // 3, 0] = ACTION
    torque[:: SCALE_STATES // 3, 5] = ACTION
    at_rest = rates_at_rest(robot, world.motion)
    alone, bodies = world.equations(), world.bodies
    masses = [f"{body}.mass" for body in bodies]
    total = np.array([[name in masses for name in world.base.standard]], dtype=float)
    load = Load("load", bodies[-1], InertialParameters(10.0, [0.1, 0.1, 0.1], 10.0 * np.eye(3)))
    loaded = _World(robot.with_load(load), rng)
    return (
        world.case("motion, tumbling", alone),
        world.case("motion, from rest", world.equations(rate=at_rest)),
        world.case("motion in the gravity gradient, tumbling", world.equations(gradient=True)),
        world.case("motion in the gravity gradient, from rest", world.equations(rate=at_rest, gradient=True)),
        world.case("motion and joint torques", world.equations(joints=True)),
        world.case("motion, known wheel spun up at times", world.equations(wheel)),
        world.case("motion, known thrust on the base at times", world.equations(thrust)),
        world.case("motion, known torque on the base at times", world.equations(torque)),
        *(world.case(f"motion, {body} known", alone, world.known(body)) for body in bodies),
        world.case("motion, mass of the whole robot known", alone, total),
        world.case(f"motion, mass of {bodies[0]} known", alone, world.known(bodies[0])[:1]),
        loaded.case(
            f"motion, {bodies[-1]} with a load fixed on it, load known", loaded.equations(), loaded.known("load")
        ),
    )


class _World:
    def __init__(self, robot: Robot, rng: np.random.Generator) -> None:
        self.robot, self.bodies = robot, massive_bodies(robot)
        self.base: BaseParameters = base_parameters(robot)
        self.motion: Kinematics = random_motion(robot, SCALE_STATES, rng)
        self.tables = np.concatenate([link_table(robot, body, self.motion) for body in self.bodies], axis=2)
        self.rate = rng.normal(size=(SCALE_STATES, 3))
        up = rng.normal(size=(SCALE_STATES, 3))
        self.zenith = up / np.linalg.norm(up, axis=1)[:, None]

    def equations(
        self, wrench: Floats | None = None, *, rate: Floats | None = None, joints: bool = False, gradient: bool = False
    ) -> Floats:
        """Return the left side of the equations in states that a known wrench causes; with the joints' if measured."""
        rate = self.rate if rate is None else rate
        wrench = np.zeros((SCALE_STATES, 6)) if wrench is None else wrench
        zenith = self.zenith if gradient else None
        change, lift = consistent_accelerations(self.robot, self.motion, rate, wrench, zenith, GRADIENT)
        left = torque_regressor(self.robot, self.bodies, self.motion, rate, change, lift)
        left = left if joints else left[:, :6]
        if zenith is not None:
            left[:, :6] -= gradient_regressor(self.tables, zenith, GRADIENT)
        return left.reshape(-1, left.shape[-1])

    def known(self, body: str) -> Floats:
        """Return the equations that state the ten parameters of a body."""
        return np.eye(10 * len(self.bodies))[10 * self.bodies.index(body) :][:10]

    def case(self, data: str, left: Floats, known: Floats | None = None) -> ScaleCase:
        """Return what equations determine; known parameters weigh as much as one equation of motion."""
        if known is not None:
            weight = np.linalg.norm(known * np.linalg.norm(left, axis=0), axis=1, keepdims=True)
            left = np.concatenate([left, weight * known])
        result = determined(self.base, left)
        return ScaleCase(data, result, result.leaves_open(self.base.project(standard_parameters(self.robot))))


PEER_STATES = 80  # number of random states, many more than the parameters need

# statement in place of FIGAROH's version
ABSENT = "is not evaluated, because it is not installed (it comes with the extra peers)"


@dataclass(frozen=True)
class Comparison:
    """Numbers of base parameters, and how far the two tools' spaces of them are apart."""

    robot: str  # name of the robot
    gravity: tuple[float, float, float]  # gravity on the fixed base, base axes [m/s2]
    # number by this package, rank of Pinocchio's regressor, and number by FIGAROH
    count: int
    rank: int
    peer: int | None
    tool: str  # FIGAROH and its version, or why it was not run
    # largest angle between the rows that take standard to base parameters, this package's and FIGAROH's [rad]
    angle: float | None


def compare(robot: Robot, rng: np.random.Generator, gravity: tuple[float, float, float] = GRAVITY) -> Comparison:
    """Compare the base parameters of an arm bolted to the ground; each link is fixed on a separate joint."""
    base = base_parameters(robot, base=Base.FIXED, gravity=gravity)
    model = pin.buildModelFromXML(robot.urdf)
    model.gravity.linear = np.array(gravity)
    q = rng.uniform(-np.pi, np.pi, size=(PEER_STATES, model.nq))
    v, a = rng.normal(size=(2, PEER_STATES, model.nv))
    data = model.createData()
    rows = np.concatenate(
        [
            np.atleast_2d(pin.computeJointTorqueRegressor(model, data, *state)).copy()
            for state in zip(q, v, a, strict=True)
        ]
    )
    length = np.linalg.norm(rows, axis=0)
    rank = int(np.linalg.matrix_rank(rows / np.where(length > 0.0, length, 1.0), tol=1e-9))
    if importlib.util.find_spec("figaroh") is None:
        return Comparison(robot.name, gravity, base.count, rank, None, ABSENT, None)
    links = [next(name for name, link in robot.links.items() if link.joint == k) for k in range(len(robot.joints))]
    names = standard_names(links)
    peer = _figaroh(model, q, v, a, names)
    projection = base.projection[:, [base.standard.index(name) for name in names]]
    angle = float(subspace_angles(peer.T, projection.T).max()) if peer.shape == projection.shape else None
    return Comparison(robot.name, gravity, base.count, rank, len(peer), f"FIGAROH {version('figaroh')}", angle)


def _figaroh(model: pin.Model, q: Floats, v: Floats, a: Floats, names: tuple[str, ...]) -> Floats:
    """Return FIGAROH's matrix that takes the standard parameters of the links to base parameters."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # its libraries warn as they are imported
        from figaroh.tools.qrdecomposition import QRDecomposer
        from figaroh.tools.regressor import RegressorBuilder, eliminate_non_dynaffect

    robot = SimpleNamespace(model=model, data=model.createData())
    regressor = RegressorBuilder(robot).build_basic_regressor(q, v, a, {"act_idxv": []})
    reduced, kept = eliminate_non_dynaffect(regressor, dict.fromkeys(names, 0.0))
    mapping = QRDecomposer().decompose(reduced, kept).M
    full = np.zeros((len(mapping), len(names)))
    full[:, [names.index(name) for name in kept]] = mapping
    return full
