"""Motion of the joints, prescribed by a formula or measured and smoothed.

A motion gives the positions, velocities and accelerations of all joints at any time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import BPoly

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.recording.blocks import BLOCKS_PER_SECOND
from bayesid.recording.jumps import smooth_joints
from bayesid.recording.recording import Recording
from bayesid.recording.smoothing import EXTENDED, JointSamples, SmoothedJoint
from bayesid.robot.joint_state import JointState
from bayesid.robot.robot import Robot

__all__ = ["Excitation", "MeasuredMotion", "Motion", "check_joints"]


class Motion(Protocol):
    """Motion of all joints as a function of time."""

    def evaluate(self, time: Floats) -> JointState:
        """Return the joint state at the times, shape (T,)."""
        ...


@dataclass(frozen=True)
class Excitation:
    """Excitation by the paper's equation (27), with its connecting splines.

    Each joint goes from ``start`` at rest to ``offset + amplitude``, oscillates as
    ``offset + amplitude cos(frequency (t - ramp))`` for a whole number of periods, and returns. The paper
    connects to the offset itself, where its cosine does not begin; the spline here meets position, velocity and
    acceleration of (27).

    Parameters
    ----------
    offset, amplitude : (joints,) array_like
        Offset q1 and amplitude q2 of (27) [rad].
    frequency : float
        Angular frequency omega_e of (27), which the paper does not state [rad/s].
    periods : int
        Number of oscillations.
    ramp : float
        Duration of each connecting spline [s].
    start : (joints,) array_like, optional
        Joint positions at rest before and after the motion, by default zero [rad].
    """

    offset: Floats
    amplitude: Floats
    frequency: float
    periods: int = 2
    ramp: float = 20.0
    start: Floats | None = None

    def __post_init__(self) -> None:
        for name in ("offset", "amplitude"):
            object.__setattr__(self, name, np.array(getattr(self, name), dtype=float))
        start = np.zeros_like(self.offset) if self.start is None else np.array(self.start, dtype=float)
        object.__setattr__(self, "start", start)

    @property
    def duration(self) -> float:
        """Duration of the whole manoeuvre [s]."""
        return 2.0 * self.ramp + self.periods * 2.0 * np.pi / self.frequency

    def evaluate(self, time: ArrayLike) -> JointState:
        """Return the joint state at the times, shape (T,)."""
        t = np.asarray(time, dtype=float)
        w, first, last = self.frequency, self.ramp, self.duration - self.ramp
        phase = w * (np.clip(t, first, last) - first)[:, None]
        state = np.stack(
            [
                self.offset + self.amplitude * np.cos(phase),
                -self.amplitude * w * np.sin(phase),
                -self.amplitude * w**2 * np.cos(phase),
            ]
        )
        assert self.start is not None
        rest = np.stack([self.start, np.zeros_like(self.start), np.zeros_like(self.start)])
        swing = np.stack([self.offset + self.amplitude, np.zeros_like(self.offset), -self.amplitude * w**2])
        for use, interval, ends in (
            (t < first, [0.0, first], [rest, swing]),
            (t > last, [last, self.duration], [swing, rest]),
        ):
            spline = BPoly.from_derivatives(interval, np.array(ends))
            inside = np.clip(t[use], interval[0], interval[1])
            for order in range(3):
                state[order, use] = spline.derivative(order)(inside) if order else spline(inside)
        return JointState(*state)


@dataclass(frozen=True)
class MeasuredMotion:
    """Joint motion smoothed from a recording, with the joints in the order of the robot."""

    joints: tuple[SmoothedJoint, ...]
    names: tuple[str, ...]

    @classmethod
    def from_recording(
        cls,
        recording: Recording,
        robot: Robot,
        *,
        sigma: Mapping[int, float | Mapping[str, float | None] | None] | None = None,
        start: Mapping[str, float] | None = None,
        blocks_per_second: float = BLOCKS_PER_SECOND,
    ) -> MeasuredMotion:
        """Smooth the joint channels of a recording.

        Parameters
        ----------
        sigma : mapping, optional
            Standard deviation of the noise of position (0), velocity (1) and acceleration (2), for all joints or by
            joint. Omitted values are estimated from the data.
        start : mapping of str to float, optional
            Positions at time 0 of joints that are recorded by speed only, by default zero.
        blocks_per_second : float, optional
            Rate above which samples are averaged over blocks [1/s]; 0 disables averaging.

        Raises
        ------
        InputError
            If a joint of the robot is not recorded, or the recording contains a joint that the robot lacks.
        """
        check_joints(recording, robot)
        names = tuple(joint.name for joint in robot.joints)
        starts = [None if f"position.{name}" in recording.channels else (start or {}).get(name, 0.0) for name in names]
        samples = [[one.reduced(blocks_per_second) for one in _samples(recording, name, sigma or {})] for name in names]
        return cls(smooth_joints(samples, starts), names)

    def evaluate(self, time: Floats) -> JointState:
        """Return the joint state at the times, shape (T,)."""
        if not self.joints:
            return JointState(*np.zeros((3, len(time), 0)))
        return JointState(*np.stack([joint.evaluate(time) for joint in self.joints], axis=-1))

    def check_extent(self, end: float, file: Path | str) -> None:
        """Refuse a recording whose joints are not sampled from about time 0 to about the last of its sensors' samples.

        A smoothing spline has no meaning far beyond its samples, unless they are constant.

        Parameters
        ----------
        end : float
            Time of the last sample of the other sensors [s].
        file : Path or str
            Recording, for the message.
        """
        for name, joint in zip(self.names, self.joints, strict=True):
            first, last, margin = joint.nodes[0], joint.nodes[-1], EXTENDED * joint.scale
            if not joint.is_constant and (first > margin or end > last + margin):
                raise InputError(
                    f"its samples cover {first:g} s to {last:g} s, but its motion is needed from 0 s to {end:g} s",
                    file=file,
                    place=f"joint '{name}'",
                    remedy="Record the joint over this whole period, or omit sensor readings outside it; 0 is the "
                    "start of the recording",
                )

    def with_noise(self, factor: float) -> MeasuredMotion:
        """Return the motion smoothed again with the declared noise of the encoders times a factor."""
        return replace(self, joints=tuple(joint.with_noise(factor) for joint in self.joints))

    def lag_covariance(self, time: Floats, lags: int) -> Floats:
        """Return the covariances of `SmoothedJoint.lag_covariance` for all joints, (joints, lags + 1, T, 3, 3).

        Parameters
        ----------
        time : (T,) array
            Times [s].
        lags : int
            Largest distance in samples.
        """
        if not self.joints:
            return np.zeros((0, lags + 1, len(time), 3, 3))
        return np.stack([joint.lag_covariance(time, lags) for joint in self.joints])


def _samples(
    recording: Recording, joint: str, sigma: Mapping[int, float | Mapping[str, float | None] | None]
) -> list[JointSamples]:
    samples = []
    for derivative, family in enumerate(("position", "velocity", "acceleration")):
        channel = f"{family}.{joint}"
        if channel in recording.channels:
            level = sigma.get(derivative)
            if isinstance(level, Mapping):
                level = level.get(joint)
            time, value = recording.series(channel)
            samples.append(JointSamples(derivative, time, value, level))
    return samples


def check_joints(recording: Recording, robot: Robot) -> None:
    """Refuse a recording that lacks a joint of the robot or holds one that the robot lacks.

    Parameters
    ----------
    recording : Recording
    robot : Robot
    """
    known = [joint.name for joint in robot.joints]
    missing = [name for name in known if not {f"position.{name}", f"velocity.{name}"} & set(recording.channels)]
    strangers = [name for name in recording.joints if name not in known]
    if missing or strangers:
        parts = []
        if missing:
            parts.append(f"no position or velocity for joint {', '.join(missing)}")
        if strangers:
            parts.append(f"joint {', '.join(strangers)} is not a joint of the robot")
        remedy = f"Record exactly the robot's moving joints ({', '.join(known)}), or correct the path of the robot"
        if spun := [name for name in missing if name in recording.wheels]:
            remedy = f"A wheel of [[robot.wheels]] is not a joint: make {', '.join(spun)} fixed in the URDF"
        raise InputError("; ".join(parts), file=recording.file or recording.name, remedy=remedy)


def sample_joints(motion: Motion, robot: Robot, time: Sequence[float] | Floats) -> dict[str, Floats]:
    """Return the channels ``position.<joint>`` of a recording that samples a motion at the times (T,).

    Parameters
    ----------
    motion : Motion
    robot : Robot
    time : (T,) array
        Times [s].
    """
    position = motion.evaluate(np.asarray(time, dtype=float)).position
    return {f"position.{joint.name}": position[:, index] for index, joint in enumerate(robot.joints)}
