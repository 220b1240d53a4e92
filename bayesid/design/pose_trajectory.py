"""Draws of the pose of one body along a manoeuvre: mean, standard deviation and 95 % regions, and their summary."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from bayesid._math.arrays import Floats
from bayesid.inference.body_quantities import quantity

__all__ = ["CONTENT", "Pose", "PoseTrajectory", "Region"]


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


CONTENT = 0.95
"""Probability content of a region, the usual one for intervals."""

# distance from the mean to the surface of a region of normal draws in three dimensions, in standard deviations
REACH = float(np.sqrt(chi2.ppf(CONTENT, 3)))


@dataclass(frozen=True)
class Region:
    """Ellipsoid of draws in three dimensions.

    It has the directions and proportions of the draws' covariance, and is as large as the draws want it: where a body
    is known badly, final poses have heavier tails than a normal distribution, whose ellipsoid holds 92 % in place of
    95 % where masses are known to 30 %.

    Parameters
    ----------
    mean : (3,) array
        Mean of the draws, in their unit.
    covariance : (3, 3) array
        Covariance of the draws, in the square of their unit.
    reach : float
        Distance from the mean to the surface, in standard deviations; by default that of normal draws.
    """

    mean: Floats
    covariance: Floats
    reach: float = REACH

    @classmethod
    def of(cls, draws: Floats) -> Region:
        """Return the region whose surface is where the next draw lies inside with probability `CONTENT`, (n, 3)."""
        region = cls(draws.mean(axis=0), np.cov(draws.T))
        rank = min(int(np.ceil(CONTENT * (len(draws) + 1))), len(draws))
        return replace(region, reach=float(np.sort(region.distance(draws))[rank - 1]))

    @property
    def sd(self) -> Floats:
        """Standard deviation per axis, shape (3,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def semi_axes(self) -> Floats:
        """Lengths of the semi-axes of the ellipsoid, the longest first, shape (3,)."""
        return self.reach * np.sqrt(np.maximum(np.linalg.eigvalsh(self.covariance)[::-1], 0.0))

    @property
    def directions(self) -> Floats:
        """Unit vectors of the semi-axes, one per row, shape (3, 3)."""
        return np.linalg.eigh(self.covariance)[1].T[::-1]

    def distance(self, points: Floats) -> Floats:
        """Return the Mahalanobis distances (...,) of points (..., 3) from the mean; it is `reach` at the surface."""
        offset = points - self.mean
        return np.sqrt(np.einsum("...i,ij,...j", offset, np.linalg.pinv(self.covariance, hermitian=True), offset))

    def holds(self, points: Floats) -> NDArray[np.bool_]:
        """Return whether points, shape (..., 3), lie inside the region, shape (...,)."""
        return self.distance(points) <= self.reach


@dataclass(frozen=True)
class Pose:
    """Draws of one pose in orbit axes.

    Parameters
    ----------
    position : (n, 3) array
        Positions in orbit axes [m].
    attitude : (n, 4) array
        Quaternions x, y, z, w from body axes to orbit axes.
    start : (4,) array
        Mean attitude at the start, from which the rotation is counted.
    """

    position: Floats
    attitude: Floats
    start: Floats

    @property
    def mean_attitude(self) -> Floats:
        """Mean quaternion, shape (4,)."""
        return Rotation.from_quat(self.attitude).mean().as_quat()

    @property
    def millimetres(self) -> Region:
        """Region of the position [mm]."""
        return Region.of(1e3 * self.position)

    @property
    def degrees(self) -> Region:
        """Region of the rotation vector since the start, orbit axes [degrees].

        Its covariance is that of the small rotations from the mean attitude to the draws.
        """
        mean = Rotation.from_quat(self.mean_attitude)
        rotation = np.degrees((mean * Rotation.from_quat(self.start).inv()).as_rotvec())
        return replace(Region.of(self._turns(self.attitude)), mean=rotation)

    def _turns(self, attitude: Floats) -> Floats:
        """Return the rotation vectors (..., 3) from the mean to attitudes (..., 4), orbit axes [degrees]."""
        mean = Rotation.from_quat(self.mean_attitude)
        return np.degrees((Rotation.from_quat(attitude) * mean.inv()).as_rotvec())

    def holds(self, position: Floats, attitude: Floats) -> tuple[bool, bool]:
        """Return whether the region of the position contains a position [m], and that of the rotation an attitude.

        Parameters
        ----------
        position : (..., 3) array
            Positions in orbit axes [m].
        attitude : (..., 4) array
            Quaternions x, y, z, w from body axes to orbit axes.
        """
        rotation = replace(self.degrees, mean=np.zeros(3))
        return bool(self.millimetres.holds(1e3 * position)), bool(rotation.holds(self._turns(attitude)))
