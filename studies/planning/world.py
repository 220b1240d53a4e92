"""What is real, flown by an independent simulator, and what the planner takes for granted."""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from bayesid import BodyPrior, Excitation, InertialParameters, Kind, Manoeuvre, Model, Orbit, Sensor, White
from bayesid.recording.joint_motion import Motion
from bayesid.robot.inertial_parameters import parameters_from_pseudo_inertia
from bayesid.robot.joint_state import JointState
from bayesid.robot.log_cholesky import log_cholesky_factor, upper_cholesky
from bayesid.simulation.effects import GravityGradient
from studies.base_body import paper
from studies.common import flight
from studies.common.ets7 import ACCEL, ACCELEROMETER, BASE, ENCODER, RADIUS, RATE, TIP, ets7
from studies.common.flight import prescribed, true_robot

__all__ = ["Flown", "Guess", "Swing", "drawn_guess", "fly", "guess_about", "measure", "model_of", "paper_guess"]

Floats = NDArray[np.floating]

INTERVAL = 0.5
"""Time between samples of all sensors [s]."""

EXCITATION = Excitation(
    offset=np.array([0.6, -2.2, 0.1, 0.0, 0.0, 0.0]),
    amplitude=np.array([-0.9, -0.2, -0.6, 0.0, 0.0, 0.0]),
    frequency=0.2,
)
"""The manoeuvre that is flown to identify the base."""

INITIAL_RATE = 1e-4
"""Standard deviation of the true initial rate of that manoeuvre about each axis [rad/s]."""

ATTITUDE = Rotation.from_euler("xyz", [0.4, -0.3, 0.8]).as_quat()
"""Attitude of the base when the planned path starts, a quaternion from base to orbit axes."""

DURATION = 60.0
"""Length of the planned path [s]."""

SPREAD, FAR = 0.15, 1.0
"""Relative widths of the priors in log-Cholesky coordinates."""

STEP = 0.1
"""Integration step of MuJoCo [s]."""


@dataclass(frozen=True)
class Guess:
    """What the planner takes the base for, and how sure it is."""

    title: str
    body: InertialParameters
    spread: float


@dataclass(frozen=True)
class Flown:
    """Final pose of base and end-effector: positions [m] and quaternions in orbit axes, from where the base started."""

    base: tuple[Floats, Floats]
    tip: tuple[Floats, Floats]


@dataclass(frozen=True)
class Swing:
    """A path in joint space: each joint goes from rest to rest on a quintic."""

    start: Floats
    goal: Floats
    duration: float

    def evaluate(self, time: Floats) -> JointState:
        """Return the joint state at the times, shape (T,)."""
        x = np.clip(np.asarray(time, dtype=float) / self.duration, 0.0, 1.0)[:, None]
        way = self.goal - self.start
        share = x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
        speed = 30.0 * x**2 * (1.0 - x) ** 2 / self.duration
        bend = 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) / self.duration**2
        return JointState(self.start + share * way, speed * way, bend * way)


def drawn_guess(seed: int) -> Guess:
    """Draw a guess of the base (`guess_about`)."""
    truth = ets7().link(BASE).inertial
    body = guess_about(truth, SPREAD, np.random.default_rng(seed))
    return Guess(f"Base guessed to {100.0 * SPREAD:g} %", body, SPREAD)


def guess_about(truth: InertialParameters, spread: float, rng: np.random.Generator) -> InertialParameters:
    """Draw a guess such that the truth is a draw of the prior about it: the inverse of the prior's relative factor."""
    factor = np.asarray(log_cholesky_factor(jnp.asarray(spread * rng.normal(size=10))))
    guess = upper_cholesky(truth.pseudo_inertia) @ np.linalg.inv(factor)
    return InertialParameters.from_vector(np.asarray(parameters_from_pseudo_inertia(jnp.asarray(guess @ guess.T))))


def paper_guess() -> Guess:
    """Return the paper's initial guess, section 4.1."""
    return Guess("The paper's initial guess", paper.body(paper.GUESS), FAR)


def model_of(guess: Guess) -> Model:
    """Return the model of the planner: the arm is known, the base is not."""
    robot = ets7().with_inertial(BASE, guess.body)
    sensors = (Sensor(Kind.RATE, White(RATE)), Sensor(Kind.ACCEL, White(ACCEL), position=ACCELEROMETER))
    return Model(robot, sensors, (BodyPrior(BASE, guess.body, guess.spread),), Orbit(RADIUS), (GravityGradient(),))


def fly(motion: Motion, duration: float) -> Flown:
    """Fly a planned path from rest."""
    model = true_robot(ets7())
    truth = model.run(prescribed(motion, [duration], STEP), [duration], attitude0=ATTITUDE, step=STEP)
    body = model.data.body(TIP)
    tip = Rotation.from_matrix(np.array(body.xmat).reshape(3, 3)).as_quat()
    return Flown((np.array(model.data.qpos[:3]), truth.attitude[-1]), (np.array(body.xpos), tip))


def measure(seed: int) -> Manoeuvre:
    """Fly the identifying manoeuvre and record it with noise."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, EXCITATION.duration, INTERVAL)
    truth = flight.fly(ets7(), EXCITATION, time, rate=INITIAL_RATE * rng.standard_normal(3), step=STEP)
    return flight.record(truth, "identification", ets7(), {"position": ENCODER, "rate": RATE, "accel": ACCEL}, rng)
