"""What is real, flown by an independent simulator, and what the planner takes for granted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from bayesid import BodyPrior, Excitation, InertialParameters, Manoeuvre, Model
from bayesid._math.arrays import Floats
from bayesid.robot.joint_state import JointState
from studies.base_body import paper
from studies.common import flight
from studies.common.ets7 import BASE, TIP, ets7
from studies.common.ets7_model import NOISE, orbiting_model
from studies.common.flight import prescribed, true_robot
from studies.common.guesses import guess_about
from studies.truth.numerics import quintic_step

__all__ = ["Flown", "FlownPose", "Guess", "Swing", "drawn_guess", "fly", "measure", "model_of", "paper_guess"]

FlownPose = tuple[Floats, Floats]
"""Position (3,) [m] and quaternion x, y, z, w to orbit axes, counted in orbit axes from where the base started."""

INTERVAL = 0.5
"""Time between samples of all sensors [s]."""

EXCITATION = Excitation(
    offset=np.array([0.6, -2.2, 0.1, 0.0, 0.0, 0.0]),
    amplitude=np.array([-0.9, -0.2, -0.6, 0.0, 0.0, 0.0]),
    frequency=0.2,
)
"""Manoeuvre that is flown to identify the base."""

INITIAL_RATE = 1e-4
"""Standard deviation of the true initial rate of that manoeuvre about each axis [rad/s]."""

ATTITUDE = Rotation.from_euler("xyz", [0.4, -0.3, 0.8]).as_quat()
"""Attitude of the base when the planned path starts, a quaternion from base to orbit axes."""

DURATION = 60.0
"""Duration of the planned path [s]."""

SPREAD, FAR = 0.15, 1.0
"""Relative widths of the priors about a drawn guess and about the paper's, in log-Cholesky coordinates."""

STEP = 0.1
"""Integration step of MuJoCo [s]."""


@dataclass(frozen=True)
class Guess:
    """Base as the planner takes it, with the relative width of its prior."""

    title: str
    body: InertialParameters
    spread: float


@dataclass(frozen=True)
class Flown:
    """Final poses of base and end-effector."""

    base: FlownPose
    tip: FlownPose


@dataclass(frozen=True)
class Swing:
    """A path in joint space on which each joint goes from rest to rest on a quintic.

    Parameters
    ----------
    start, goal : (6,) arrays
        Joint positions before and after [rad].
    duration : float
        Duration of the path [s].
    """

    start: Floats
    goal: Floats
    duration: float

    def evaluate(self, time: Floats) -> JointState:
        """Return the joint state at the times, shape (T,)."""
        steps = [quintic_step(instant / self.duration) for instant in np.asarray(time, dtype=float)]
        value, slope, bend = np.array(steps).T[:, :, None] * (self.goal - self.start)
        return JointState(self.start + value, slope / self.duration, bend / self.duration**2)


def drawn_guess(seed: int) -> Guess:
    """Draw a guess of the base such that the truth is a draw of the prior about it."""
    body = guess_about(ets7().link(BASE).inertial, SPREAD, np.random.default_rng(seed))
    return Guess(f"Base guessed to {100.0 * SPREAD:g} %", body, SPREAD)


def paper_guess() -> Guess:
    """Return the paper's initial guess, section 4.1."""
    return Guess("The paper's initial guess", paper.body(paper.GUESS), FAR)


def model_of(guess: Guess) -> Model:
    """Return the model of the planner: the arm is known, the base is not."""
    return orbiting_model(ets7().with_inertial(BASE, guess.body), [BodyPrior(BASE, guess.body, guess.spread)])


def fly(swing: Swing) -> Flown:
    """Fly a planned path from rest and return the final poses."""
    model, end = true_robot(ets7()), [swing.duration]
    truth = model.run(prescribed(swing, end, STEP), end, attitude0=ATTITUDE, step=STEP)
    body = model.data.body(TIP)
    tip = Rotation.from_matrix(np.array(body.xmat).reshape(3, 3)).as_quat()
    return Flown((np.array(model.data.qpos[:3]), truth.attitude[-1]), (np.array(body.xpos), tip))


def measure(seed: int) -> Manoeuvre:
    """Fly the identifying manoeuvre and record it with noise."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, EXCITATION.duration, INTERVAL)
    truth = flight.fly(ets7(), EXCITATION, time, rate=INITIAL_RATE * rng.standard_normal(3), step=STEP)
    return flight.record(truth, "identification", ets7(), NOISE, rng)
