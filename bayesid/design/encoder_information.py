"""Information lost to the encoders' noise: directions of the readings that errors of the joints could explain.

The error of each joint's smoothed position is a series of cosines, whose coefficients the encoder's samples determine.
Seen by the sensors it is a signal like any other, which the information about the unknowns must not use. It is
linearised along one motion, since it depends on the posture and hardly on how the joints move.
"""

from __future__ import annotations

from collections.abc import Mapping

import jax
import numpy as np

from bayesid._math.arrays import Floats
from bayesid.design.plan import Plan
from bayesid.inference.encoder_noise import SampledMotion, joint_sensitivity
from bayesid.simulation.time_grid import time_tables

__all__ = ["Encoder", "encoder_directions", "likely_directions", "position_noise"]

Encoder = Mapping[int, float | Mapping[str, float | None] | None]
"""Standard deviation of joint position (0), velocity (1) and acceleration (2), for all joints or by joint."""

FASTEST = 60  # largest number of cosines per joint; faster errors do not resemble what a manoeuvre shows
NEGLIGIBLE = 1e-4  # fraction of a direction's information below which its loss is neglected
UNIT = 16  # unit of the padded number of directions, so that motions share compiled functions


def position_noise(encoder: Encoder, joints: tuple[str, ...]) -> Floats:
    """Return the standard deviation of each joint's position samples [rad or m], zero where none is known.

    Parameters
    ----------
    encoder : Encoder
        Noise of the encoders.
    joints : tuple of str
        Names of the joints.
    """
    level = encoder.get(0)
    by_joint = level if isinstance(level, Mapping) else dict.fromkeys(joints, level)
    return np.array([by_joint.get(joint) or 0.0 for joint in joints])


def encoder_directions(plan: Plan, parameters: Floats, rate: Floats) -> Floats:
    """Return the directions V for which the information is ``J' (1 - V V') J``, shape (samples * 3 sensors, r).

    Parameters
    ----------
    plan : Plan
        Plan with the noise of its encoders; ``J`` are its whitened derivatives of the readings.
    parameters : (n,) array
        Motion along which the errors are linearised.
    rate : (samples, 3) array
        Angular velocity of the base along it, base axes [rad/s].
    """
    robot, times = plan.model.robot, plan.samples
    motion = plan.family.motion(parameters)
    noise = np.array(plan.encoder_sigma)
    if not noise.any():
        return np.zeros((len(times) * len(plan.sigma), 0))
    environment = time_tables(robot, (), (), motion, times, plan.model.orbit, plan.argument_of_latitude).environment
    attitude = np.tile(np.asarray(plan.attitude, dtype=float), (len(times), 1))
    seen = SampledMotion(attitude, rate, jax.tree.map(np.asarray, environment))
    sensitivity = joint_sensitivity(robot, motion.evaluate(times), seen, plan.model.sensors) / plan.sigma
    end = plan.family.duration
    count = min(FASTEST, len(times) // 2)
    errors = np.einsum("jdtc,dtk->tcjk", sensitivity, _cosines(times, end, count))
    recorded = _cosines(np.linspace(0.0, end, round(end / plan.interval) + 1), end, count)[0]
    spread = np.linalg.inv(np.linalg.cholesky(recorded.T @ recorded)).T
    signals = (errors @ spread * noise[:, None]).reshape(len(times) * len(plan.sigma), -1)
    directions, sizes, _ = np.linalg.svd(signals, full_matrices=False)
    lost = sizes**2 / (1.0 + sizes**2)
    used = int((lost > NEGLIGIBLE).sum())
    explained = np.zeros((len(signals), -(-used // UNIT) * UNIT))
    explained[:, :used] = directions[:, :used] * np.sqrt(lost[:used])
    return explained


def likely_directions(plan: Plan) -> Floats:
    """Return zeros of the likeliest shape of `encoder_directions`, so that what uses them can be compiled before."""
    return np.zeros((len(plan.samples) * len(plan.sigma), UNIT if any(plan.encoder_sigma) else 0))


def _cosines(time: Floats, end: float, count: int) -> Floats:
    """Return cosines of up to half ``count`` periods with two derivatives, shape (3, T, count)."""
    w = np.pi * np.arange(count) / end
    phase = time[:, None] * w
    return np.stack([np.cos(phase), -w * np.sin(phase), -(w**2) * np.cos(phase)])
