"""The case, its manoeuvres flown by an independent simulator, and what a manoeuvre and its sensors teach.

One Jacobian per manoeuvre, with all sensors, serves every question. The whitening conditions every sensor on those
before it, so that later ones may be left out exactly; a body is known exactly where its columns are left out; another
prior rescales them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from typing import Any

import numpy as np

from bayesid import BodyPrior, InertialParameters, Manoeuvre, Model, Posterior, Robot
from bayesid._math.arrays import Floats
from bayesid.identifiability.local_knowledge import Knowledge
from bayesid.inference.noise_changes import with_manoeuvres
from bayesid.robot.inertial_parameters import PARAMETERS
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import joint_motion, kinematics
from bayesid.robot.robot import Load
from bayesid.simulation.effects import JointFriction
from bayesid.simulation.joint_torques import TorqueSensor
from studies.common import flight
from studies.common.ets7 import ACCEL, BASE, ENCODER, RATE, TIP, ets7
from studies.common.models import ARM_SPREAD, guess_about, orbiting_model
from studies.truth.mujoco import Thrust, Truth, smooth_motion

LOAD, HAND = "load", "link6"  # name of the load, and link that carries it

# relative widths of the priors in log-Cholesky coordinates: links of the arm known from drawings, to 5 % of each mass
# as in all studies, a base that has used some of its fuel, and a load
ARM, BASE_SPREAD, LOAD_SPREAD = ARM_SPREAD, 0.3, 1.0

TORQUE = 0.1  # noise per sample of the joint torques [N m]
COULOMB, VISCOUS = 1.5, 8.0  # true friction of every joint, dry and viscous [N m, N m s]


def true_robot() -> Robot:
    """Return the robot as it truly is: the published one, holding a load of 120 kg."""
    body = InertialParameters(120.0, [0.05, -0.1, 0.45], np.diag([14.0, 11.0, 9.0]))
    return ets7().with_load(Load(LOAD, HAND, body))


def bodies(robot: Robot) -> tuple[str, ...]:
    """Return the names of the bodies with mass."""
    return tuple(name for name, link in robot.links.items() if link.inertial.mass > 0.0)


def groups(robot: Robot) -> dict[str, tuple[str, ...]]:
    """Return the four groups of bodies whose masses are reported, each with the names of its bodies."""
    names = bodies(robot)
    arm = tuple(name for name in names if name not in (BASE, LOAD))
    return {"base": (BASE,), "load": (LOAD,), "arm": arm, "whole system": names}


def spreads(robot: Robot) -> dict[str, float]:
    """Return the width of the prior of every body."""
    return {name: {BASE: BASE_SPREAD, LOAD: LOAD_SPREAD}.get(name, ARM) for name in bodies(robot)}


def drawn(truth: Robot, seed: int) -> Robot:
    """Return the drawings: every body such that the truth is a draw of the prior about it."""
    rng, robot = np.random.default_rng(seed), truth
    for name, spread in spreads(truth).items():
        robot = robot.with_inertial(name, guess_about(truth.link(name).inertial, spread, rng))
    return robot


def model_of(robot: Robot, *, torques: bool = False) -> Model:
    """Return the model with all bodies unknown.

    Parameters
    ----------
    robot : Robot; the drawings, on which the priors are centred
    torques : bool; true if the joint torques are measured; friction in every joint is then unknown
    """
    priors = [BodyPrior(name, robot.link(name).inertial, spread) for name, spread in spreads(robot).items()]
    if not torques:
        return orbiting_model(robot, priors)
    joints = tuple(joint.name for joint in robot.joints)
    sensor = TorqueSensor(joints, (TORQUE,) * len(joints))
    return orbiting_model(robot, priors, *(JointFriction(joint) for joint in joints), torque=sensor)


STEP, INTERVAL = 0.1, 0.5  # integration step of MuJoCo, and time between samples [s]
START_RATE = np.array([2e-4, -1e-4, 3e-4])  # true rate of the base at the start [rad/s]
CENTRE = np.array([0.2, -0.8, 1.2, -0.5, 0.6, 0.3])  # joint positions before and after a manoeuvre [rad]


def flights(duration: float) -> dict[str, dict[str, Any]]:
    """Return the manoeuvres compared, by name: arguments of `fly`."""
    first, second = round(0.25 * duration), round(0.6 * duration)
    pulses = (Thrust(first, first + 2.0, force=(20.0, 0.0, 0.0)), Thrust(second, second + 2.0, force=(0.0, 20.0, 0.0)))
    return {
        "three joints": {"joints": (0, 1, 2)},
        "six joints": {"joints": tuple(range(6))},
        "six joints, half as far": {"joints": tuple(range(6)), "amplitude": 0.25},
        "six joints, known thrust": {"joints": tuple(range(6)), "thrusts": pulses},
    }


def fly(
    robot: Robot, seed: int, *, duration: float, joints: tuple[int, ...], amplitude: float = 0.5, **hidden: Any
) -> Truth:
    """Fly a smooth manoeuvre of some joints and return what truly happened at the samples.

    Parameters
    ----------
    robot : Robot; the robot as it truly is
    seed : int; seed of the manoeuvre
    duration : float; duration of the manoeuvre [s]
    joints : tuple of int; joints that move
    amplitude : float; typical excursion [rad]
    **hidden
        Further influences, keywords of `studies.truth.mujoco.TruthModel`.
    """
    size = np.zeros(len(robot.joints))
    size[list(joints)] = amplitude
    motion = smooth_motion(len(size), duration, seed, amplitude=size, centre=CENTRE)
    time = np.arange(0.0, duration + 1e-9, INTERVAL)
    return flight.true_robot(robot, **hidden).run(motion, time, rate0=START_RATE, step=STEP)


def hand_speed(truth: Truth, robot: Robot) -> float:
    """Return the largest speed of the end-effector relative to the base [m/s]."""
    moved = kinematics(robot, JointState(truth.position, truth.speed, truth.acceleration))
    link = robot.link(TIP)
    _, flow, _ = joint_motion(moved, link.joint)
    return float(np.linalg.norm((flow @ link.placement)[:, :3, 3], axis=1).max())


def record(truth: Truth, robot: Robot, name: str, rng: np.random.Generator | None) -> Manoeuvre:
    """Record a flight with the noise of all sensors; torques include the friction of the joints."""
    friction = COULOMB * np.sign(truth.speed) + VISCOUS * truth.speed
    noise = {"position": ENCODER, "torque": TORQUE, "rate": RATE, "accel": ACCEL}
    return flight.record(truth._replace(torque=truth.torque + friction), name, robot, noise, rng, by_channel=())


class Sensors(Enum):
    """Sensors in use, each with its title and the number of columns of the whitened residual that they fill."""

    RATE = ("star tracker rate", 3)
    MOTION = ("rate and accelerometer", 6)
    TORQUES = ("rate, accelerometer, joint torques", None)


@dataclass(frozen=True)
class Known:
    """Knowledge of the bodies after a manoeuvre, in coordinates whose prior is standard normal."""

    robot: Robot  # robot about which the posterior was linearised
    names: tuple[str, ...]  # names of the unknown bodies, whose ten coordinates each come first
    widths: Mapping[str, float]  # width of every body's prior
    covariance: Floats  # (n, n): posterior covariance of the coordinates

    def mass(self, *members: str) -> tuple[float, float]:
        """Return the relative standard deviation of the sum of some bodies' masses, prior and posterior."""
        slope = np.zeros(len(self.covariance))
        total = sum(self.robot.link(name).inertial.mass for name in members)
        for index, name in enumerate(self.names):
            if name in members:  # the mass goes with the square of the scale exp(alpha)
                slope[PARAMETERS * index] = 2.0 * self.widths[name] * self.robot.link(name).inertial.mass / total
        return float(np.linalg.norm(slope)), float(np.sqrt(slope @ self.covariance @ slope))

    def shrinkage(self, name: str) -> Floats:
        """Return one minus the ratio of posterior to prior width of the ten coordinates of a body, shape (10,)."""
        first = PARAMETERS * self.names.index(name)
        return 1.0 - np.sqrt(np.diag(self.covariance)[first : first + PARAMETERS])

    @cached_property
    def directions(self) -> Floats:
        """Ratios of posterior to prior width along the independent directions of the coordinates, ascending."""
        count = PARAMETERS * len(self.names)
        return np.sqrt(np.clip(np.linalg.eigvalsh(self.covariance[:count, :count]), 0.0, None))

    @property
    def contraction(self) -> int:
        """Number of directions that the data narrowed to less than half of the prior."""
        return int((self.directions < 0.5).sum())


@dataclass(frozen=True)
class Information:
    """Information of a manoeuvre with all sensors."""

    robot: Robot  # true robot, about which the posterior was linearised
    jacobian: Floats  # (rows, columns, n): Jacobian of the whitened residuals

    def knowledge(
        self, sensors: Sensors, *, known: Sequence[str] = (), widths: Mapping[str, float] | None = None
    ) -> Known:
        """Return the knowledge after the manoeuvre.

        Parameters
        ----------
        sensors : Sensors; sensors in use
        known : sequence of str; names of bodies that are taken as exactly known
        widths : mapping of str to float, optional; widths of the bodies' priors in place of those of the drawings
        """
        drawn = spreads(self.robot)
        chosen = drawn if widths is None else widths
        names = bodies(self.robot)
        size = self.jacobian.shape[-1]
        scale = np.ones(size)
        scale[: PARAMETERS * len(names)] = np.repeat([chosen[name] / drawn[name] for name in names], PARAMETERS)
        rows = self.jacobian[:, : sensors.value[1]].reshape(-1, size) * scale
        exact = [PARAMETERS * i + k for i, name in enumerate(names) if name in known for k in range(PARAMETERS)]
        after = Knowledge((), np.zeros(0), np.zeros((0, size)), np.concatenate([rows, np.eye(size)])).fixing(exact)
        return Known(self.robot, tuple(name for name in names if name not in known), chosen, after.coordinates)


def informed(truth: Robot, manoeuvres: Mapping[str, Manoeuvre]) -> dict[str, Information]:
    """Linearise each manoeuvre of the true robot about the truth."""
    linearised: dict[str, Information] = {}
    like = Posterior.of(model_of(truth, torques=True), [next(iter(manoeuvres.values()))])
    for name, manoeuvre in manoeuvres.items():
        posterior = with_manoeuvres(like, [manoeuvre])  # shares what is compiled
        jacobian = posterior.jacobian(posterior.starting_point())[: -posterior.size]
        linearised[name] = Information(truth, jacobian.reshape(-1, posterior.residual_shape[2], posterior.size))
    return linearised
