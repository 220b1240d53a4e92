"""Draws of the trajectory of one body along a manoeuvre, and the summary of them that is reported."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from scipy.spatial.transform import Rotation

from bayesid._math.arrays import Floats
from bayesid.design.pose_region import CONTENT, Pose, Region
from bayesid.inference.body_quantities import quantity

__all__ = ["PoseTrajectory"]


@dataclass(frozen=True)
class PoseTrajectory:
    """Draws of the pose of one body along a manoeuvre, in orbit axes.

    Parameters
    ----------
    time : (T,) array
        Instants [s].
    position : (n, T, 3) array
        Positions relative to the base origin at the start [m].
    attitude : (n, T, 4) array
        Quaternions x, y, z, w from body axes to orbit axes.
    """

    time: Floats
    position: Floats
    attitude: Floats

    def pose(self, index: int = -1) -> Pose:
        """Return the pose at one instant, by default the last."""
        start = Rotation.from_quat(self.attitude[:, 0]).mean().as_quat()
        return Pose(self.position[:, index], self.attitude[:, index], start)

    def to_dict(self) -> dict[str, Any]:
        """Return the entry of the body in prediction.json."""
        final = self.pose()
        poses = [self.pose(index) for index in range(len(self.time))]
        regions: Mapping[str, list[Region]] = {
            "position": [pose.millimetres for pose in poses],
            "rotation": [pose.degrees for pose in poses],
        }
        units = {"position": "mm", "rotation": "deg"}
        return {
            **{
                key: {
                    axis: quantity(mean, sd, units[key])
                    for axis, mean, sd in zip("xyz", regions[key][-1].mean, regions[key][-1].sd, strict=True)
                }
                for key in units
            },
            "attitude": final.mean_attitude.tolist(),
            "region": {
                key: {
                    "content": CONTENT,
                    "semi_axes": regions[key][-1].semi_axes.tolist(),
                    "directions": regions[key][-1].directions.tolist(),
                    "unit": unit,
                }
                for key, unit in units.items()
            },
            "course": {
                "time": self.time.tolist(),
                **{
                    key: {
                        "mean": [region.mean.tolist() for region in regions[key]],
                        "sd": [region.sd.tolist() for region in regions[key]],
                        "unit": unit,
                    }
                    for key, unit in units.items()
                },
            },
        }
