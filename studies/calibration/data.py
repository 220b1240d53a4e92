"""The cases, truths drawn from the prior, the recordings that sensors take of them, and how joints are smoothed.

Chi-square per sample is not exactly one because of the errors of smoothed joints. The smoothing takes a joint's motion
as an m-fold integral of white noise. In frequency w its posterior variance is that of the encoder times
H = 1 / (1 + (w / c)^2m), of which H^2 is noise let through and H - H^2 roughness not resolved. Of the r-th derivative's
variance the second part is (2r + 1) / 2m. A motion of a few sines has no such roughness, so that the mean square of its
errors is 1 - (2r + 1) / 2m of what is stated; at a jump of the jerk that is not found in the samples
(`bayesid.recording.jumps`) it is far more.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cache
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from bayesid import BodyPrior, InertialParameters, Manoeuvre, Model, Posterior, Robot, SensorKind
from bayesid._math.arrays import Floats
from bayesid.inference.predicted_readings import blank_channels, simulate_recordings
from bayesid.recording.jumps import smooth_joints
from bayesid.recording.recording import Recording
from bayesid.recording.smoothing import ORDERS, JointSamples
from bayesid.robot.composite_tables import composite_rows
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import kinematics
from bayesid.robot.log_cholesky import log_cholesky_vector
from bayesid.robot.robot import Load
from bayesid.simulation.dynamics import composite
from bayesid.simulation.effects import SensorBias
from studies.common.ets7 import ACCEL, BASE, BIAS, ENCODER, INTERVAL, RATE, ets7
from studies.common.flight import prescribed, readings, smoothed, true_robot
from studies.common.models import ARM_SPREAD, NOISE, base_model
from studies.truth.mujoco import smooth_motion

# relative widths of the priors of base and load (their masses are uncertain by a factor of 1.8) and, where the whole
# system is unknown, of the links. The default width of 1 would draw bases of a tenth of the mass and of ten times it.
BASE_SPREAD, LOAD_SPREAD, DRAWINGS_SPREAD = 0.3, 0.3, 0.05

START_RATE = 1e-3  # standard deviation of each axis of the initial rate [rad/s]

# load in the hand where the whole system is unknown
LOAD = Load("load", "link6", InertialParameters(120.0, [0.05, -0.1, 0.45], np.diag([14.0, 11.0, 9.0])))


class Case(StrEnum):
    """One kind of replicate."""

    BASE = "base body"
    EXACT = "base body, joints known exactly"
    ARM = "base body, arm known to 5 %"
    WHOLE = "whole system"
    AROUND = "base body, around one data set"
    MUJOCO = "MuJoCo, ETS-VII"
    MUJOCO_REST = "MuJoCo, ETS-VII from rest"
    PLANAR = "MuJoCo, planar robot"
    PLANAR_REST = "MuJoCo, planar robot from rest"

    @property
    def label(self) -> str:
        """What a reader calls it; the value names it in stored trials."""
        return self.value.replace("known to", "uncertain by")


# number of replicates of each case in the full study
REPLICATES = {
    Case.BASE: 1000,
    Case.EXACT: 200,
    Case.ARM: 300,
    Case.WHOLE: 200,
    Case.AROUND: 100,
    Case.MUJOCO: 100,
    Case.MUJOCO_REST: 100,
    Case.PLANAR: 100,
    Case.PLANAR_REST: 100,
}

# cases whose data MuJoCo makes; the package itself makes those of the others
INDEPENDENT = (Case.MUJOCO, Case.MUJOCO_REST, Case.PLANAR, Case.PLANAR_REST)

AT_REST = (Case.MUJOCO_REST, Case.PLANAR_REST)


@cache
def model_of(case: Case) -> Model:
    """Return the model of a case: ETS-VII or the planar robot, its sensors and its priors."""
    robot = Robot.shipped("planar") if case in (Case.PLANAR, Case.PLANAR_REST) else ets7()
    robot = robot.with_load(LOAD) if case is Case.WHOLE else robot
    model = base_model(
        {SensorKind.RATE: RATE, SensorKind.ACCEL: ACCEL},
        robot=robot,
        base_spread=BASE_SPREAD,
        arm_spread=ARM_SPREAD if case is Case.ARM else 0.0,
        rate_sigma=0.0 if case in AT_REST else START_RATE,
    )
    return replace(model, priors=_whole(robot)) if case is Case.WHOLE else model


def _whole(robot: Robot) -> tuple[BodyPrior, ...]:
    widths = {BASE: BASE_SPREAD, LOAD.name: LOAD_SPREAD}
    return tuple(
        BodyPrior(name, link.inertial, widths.get(name, DRAWINGS_SPREAD))
        for name, link in robot.links.items()
        if link.inertial.mass > 0.0
    )


DURATION = 120.0  # length of a recording [s]
STEP = 0.1  # longest integration step of both simulators [s]
AMPLITUDE = 0.5  # typical excursion of a joint [rad]

# joint positions before and after the motion [rad]; the planar robot has the first two
POSTURE = np.array([0.2, -0.8, 1.2, -0.5, 0.6, 0.3])


@dataclass(frozen=True)
class Truth:
    """What is true in one replicate."""

    # coordinates of all unknown bodies, shape (10 B,), and of the accelerometer's constant error, shape (3,)
    bodies: Floats
    bias: Floats
    rates: Floats  # (R, 3): initial rate of every recording [rad/s], the base's own or that of `Recorded`


@dataclass(frozen=True)
class SmoothMotion:
    """Smooth random motion of all joints from rest to rest; a `bayesid.recording.joint_motion.Motion`."""

    joints: int
    seed: int

    def evaluate(self, time: Floats) -> JointState:
        """Return the joint state at the times, shape (T,)."""
        motion = smooth_motion(self.joints, DURATION, self.seed, amplitude=AMPLITUDE, centre=POSTURE[: self.joints])
        return JointState(*(np.array(part) for part in zip(*map(motion, map(float, time)), strict=True)))


def draw_truth(model: Model, rng: np.random.Generator) -> Truth:
    """Draw bodies, accelerometer error and the initial rate of one recording from the prior."""
    rate = model.rate_sigma * rng.normal(size=(1, 3))
    return Truth(rng.normal(size=10 * len(model.priors)), rng.normal(size=3), rate)


def point(posterior: Posterior, truth: Truth) -> Floats:
    """Return the coordinates of a truth, shape (size,)."""
    unknowns, layout = posterior.unknowns, posterior.unknowns.layout
    z = np.zeros(posterior.size)
    z[layout.all_bodies] = truth.bodies
    z[unknowns.effect_indices(SensorBias.of(SensorKind.ACCEL).name)] = truth.bias
    if layout.rates:
        z[layout.all_rates] = (truth.rates / unknowns.rate_sigma).ravel()
    if layout.joints:  # joints that truly rest at time 0
        smooth = [manoeuvre.motion.evaluate(np.zeros(1)).velocity[0] for manoeuvre in posterior.manoeuvres]
        z[layout.all_speeds] = (np.array(smooth) / np.array(unknowns.speed_sigma)).ravel()
    return z


class Recorded(NamedTuple):
    """Recording of one replicate."""

    manoeuvre: Manoeuvre
    # (3,): initial rate that the model must take with the joints as they were smoothed [rad/s]. The momentum at time 0
    # is the same: what the smoothed joints are too fast by, the base is too slow by.
    rate: Floats


def record(case: Case, truth: Truth, rng: np.random.Generator) -> Recorded:
    """Move the true robot, record it with noise, and smooth its joints where they are not known exactly."""
    model = model_of(case)
    robot = _true_robot(model, truth)
    time = np.arange(0.0, DURATION + 1e-9, INTERVAL)
    motion = SmoothMotion(len(robot.joints), int(rng.integers(2**31)))
    attitude = rng.normal(size=4)
    attitude /= np.linalg.norm(attitude)
    make = _flown if case in INDEPENDENT else _simulated
    channels = make(model, truth, motion, attitude, time, rng)
    if case is Case.EXACT:
        return Recorded(Manoeuvre(Recording(case, None, time, channels), motion, attitude), truth.rates[-1])
    manoeuvre = replace(smoothed(case, time, channels, robot, ENCODER), attitude=attitude)
    exact, smooth = (source.evaluate(np.zeros(1)) for source in (motion, manoeuvre.motion))
    excess = JointState(exact.position, smooth.velocity - exact.velocity, 0.0 * exact.acceleration)
    body = composite(jnp.asarray(composite_rows(robot, kinematics(robot, excess))[0]))
    return Recorded(manoeuvre, truth.rates[-1] - np.asarray(body.inverse @ body.spin))


def _true_robot(model: Model, truth: Truth) -> Robot:
    robot = model.robot
    for prior, z in zip(model.priors, truth.bodies.reshape(-1, 10), strict=True):
        vector = log_cholesky_vector(prior.centre, jnp.asarray(prior.spread * z))
        robot = robot.with_inertial(prior.name, InertialParameters.from_vector(np.asarray(vector)))
    return robot


def _simulated(
    model: Model, truth: Truth, motion: SmoothMotion, attitude: Floats, time: Floats, rng: np.random.Generator
) -> dict[str, Floats]:
    """Return channels that the package's own simulator makes."""
    names = [f"position.{joint.name}" for joint in model.robot.joints]
    exact = dict(zip(names, motion.evaluate(time).position.T, strict=True))
    planned = Recording("planned", None, time, {**exact, **blank_channels(model.sensors, len(time))})
    posterior = Posterior.of(model, [Manoeuvre(planned, motion, attitude)], step=STEP, window=0)
    channels = simulate_recordings(posterior, rng, point(posterior, truth))[0].channels
    return {**channels, **{name: exact[name] + ENCODER * rng.normal(size=len(time)) for name in names}}


def _flown(
    model: Model, truth: Truth, motion: SmoothMotion, attitude: Floats, time: Floats, rng: np.random.Generator
) -> dict[str, Floats]:
    """Return channels that MuJoCo makes."""
    robot = _true_robot(model, truth)
    flown = true_robot(robot).run(
        prescribed(motion, time, STEP), time, rate0=truth.rates[-1], attitude0=attitude, step=STEP
    )
    biased = flown._replace(accel=flown.accel + BIAS * truth.bias)
    return readings(biased, [joint.name for joint in robot.joints], NOISE, rng)


RAMP = 20.0  # length of the quintic ramps, at whose inner ends the jerk jumps [s]
NEAR = 1.0  # distance from such an end within which a sample counts as near it [s]
MOTIONS = 10  # number of random motions of each row

# time between samples [s] and noise of the encoder [rad]
SETTINGS = ((0.5, 1e-6), (0.5, 1e-5), (0.5, 1e-4), (2.0, 1e-6))


class Smoothed(NamedTuple):
    """Mean squares of the errors of joint position, speed and acceleration over their stated variances, each (3,)."""

    # time between samples [s] and noise of the encoder [rad]
    interval: float
    encoder: float
    # (3,): farther than `NEAR` from the inner ends of the ramps, and nearer
    between: Floats
    near: Floats


def smooth_share(derivative: int, order: int = ORDERS[-1]) -> float:
    """Return the mean square error of a derivative of a motion much smoother than the process, over that stated."""
    return 1.0 - (2 * derivative + 1) / (2 * order)


def smoothed_errors(seed: int = 1, motions: int = MOTIONS) -> list[Smoothed]:
    """Smooth samples of random motions that are known exactly, and compare."""
    rows = []
    for interval, encoder in SETTINGS:
        time = np.arange(0.0, DURATION + 1e-9, interval)
        near = np.abs(time[:, None] - [RAMP, DURATION - RAMP]).min(axis=1) <= NEAR
        ratios = np.mean([_ratios(time, encoder, seed + number) for number in range(motions)], axis=0)
        rows.append(Smoothed(interval, encoder, ratios[:, ~near].mean(axis=1), ratios[:, near].mean(axis=1)))
    return rows


def _ratios(time: Floats, encoder: float, seed: int) -> Floats:
    """Return squared errors over stated variances of one motion, shape (3, T)."""
    motion = smooth_motion(1, DURATION, seed, amplitude=AMPLITUDE, ramp=RAMP)
    exact = np.array([np.ravel(motion(float(now))) for now in time]).T
    noisy = exact[0] + encoder * np.random.default_rng(seed).normal(size=len(time))
    (joint,) = smooth_joints([[JointSamples(0, time, noisy, encoder)]])
    return np.asarray(((joint.evaluate(time) - exact) / joint.standard_deviation(time)) ** 2)
