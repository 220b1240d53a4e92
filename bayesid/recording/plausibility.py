"""Refusal of recorded joint motion that no robot can have made."""

from __future__ import annotations

import numpy as np

from bayesid._io.errors import InputError
from bayesid.recording.recording import Recording
from bayesid.robot.robot import Robot

__all__ = ["refuse_impossible_joints"]


def refuse_impossible_joints(recording: Recording, robot: Robot) -> None:
    """Refuse joint positions and speeds far outside the joints' limits, such as degrees taken for radians.

    Raises
    ------
    InputError
        If a position is beyond a limit by more than a tenth of the range, or a speed is above five times its limit.
    """
    for joint in robot.joints:
        name = f"position.{joint.name}"
        if name not in recording.channels:
            continue
        time, position = recording.series(name)
        slack = 0.1 * (joint.upper - joint.lower) if np.isfinite(joint.upper - joint.lower) else 0.0
        outside = (position < joint.lower - slack) | (position > joint.upper + slack)
        speed = np.abs(np.diff(position) / np.diff(time))
        fast = speed > 5.0 * joint.velocity
        remedy = (
            "Give positions in radians, not degrees"
            if joint.unit == "rad"
            else "Give positions in metres, not millimetres"
        )
        file = recording.file or recording.name
        if outside.any():
            row = int(np.argmax(outside))
            raise InputError(
                f"{position[row]:g} {joint.unit} at time {time[row]:g} s is outside the joint's limits "
                f"[{joint.lower:g}, {joint.upper:g}]",
                file=file,
                place=f"column {name}",
                remedy=f"{remedy}, or correct the limits in the URDF",
            )
        if fast.any():
            row = int(np.argmax(fast))
            raise InputError(
                f"the joint moves at {speed[row]:.3g} {joint.unit}/s at time {time[row]:g} s, "
                f"its limit is {joint.velocity:g}",
                file=file,
                place=f"column {name}",
                remedy=f"{remedy}, or correct the limit in the URDF",
            )
