"""The planner: where a path will end by what it knows, and which path ends where it wants."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import root
from scipy.spatial.transform import Rotation

from bayesid import Manoeuvre, Model, Recording
from bayesid._math.arrays import Floats
from bayesid.design.base_prediction import BasePredictor
from bayesid.design.pose_region import Pose
from studies.common import mission
from studies.common.ets7 import TIP
from studies.planning.world import EXCURSION, FlownPose, Swing

__all__ = ["Planner", "miss_of"]

ARM = 2.0  # length that makes a rotation error comparable with a position error [m/rad]


@dataclass(frozen=True)
class Planner:
    """Planner with a model of the ship; what it knows is points of the bodies' coordinates in that model."""

    model: Model  # model whose priors are what the planner knows at first

    @cached_property
    def first(self) -> Swing:
        """The path that ends at the target if the ship is as it was published."""
        return Swing(mission.start(), mission.start() + EXCURSION)

    @cached_property
    def target(self) -> FlownPose:
        """Pose of the end-effector that is wanted."""
        pose = self.poses(self.first, np.zeros((1, self._count)))["tip"]
        return pose.position[0], pose.attitude[0]

    def poses(self, swing: Swing, bodies: Floats) -> dict[str, Pose]:
        """Return the final poses of ``base`` and ``tip`` on a path, for points (n, b) of the bodies' coordinates."""
        predictor = self._predictor(swing)
        z = np.tile(predictor.centre, (len(bodies), 1))
        z[:, : self._count] = bodies
        base, tip = predictor.courses(z)
        return {"base": base.pose(), "tip": tip.pose()}

    def prior(self, draws: int, rng: np.random.Generator) -> Floats:
        """Draw points of the bodies' coordinates from the prior, shape (draws, b)."""
        return rng.normal(size=(draws, self._count))

    def plan(self, bodies: Floats) -> Swing:
        """Return the path that ends at the target if the bodies' coordinates (b,) are right.

        Raises
        ------
        RuntimeError
            If none is found.
        """
        position, attitude = self.target

        def miss(goal: Floats) -> Floats:
            pose = self.poses(Swing(self.first.start, goal), bodies[None])["tip"]
            turn = Rotation.from_quat(pose.attitude[0]) * Rotation.from_quat(attitude).inv()
            return np.concatenate([pose.position[0] - position, ARM * turn.as_rotvec()])

        found = root(miss, self.first.goal, tol=1e-9)
        if not found.success:
            raise RuntimeError(f"no path to the target was found: {found.message}")
        return Swing(self.first.start, found.x)

    @property
    def _count(self) -> int:
        """Number of the bodies' coordinates."""
        return 10 * len(self.model.priors)

    @cached_property
    def _resting(self) -> BasePredictor:
        """Predictor whose compiled simulation serves all paths."""
        return BasePredictor(self.model, _planned(Swing(self.first.start, self.first.start)), TIP)

    def _predictor(self, swing: Swing) -> BasePredictor:
        return BasePredictor(self.model, _planned(swing), TIP, self._resting)


def miss_of(flown: FlownPose, target: FlownPose) -> tuple[float, float]:
    """Return distance [mm] and angle [degrees] of a pose from its target."""
    turn = Rotation.from_quat(flown[1]) * Rotation.from_quat(target[1]).inv()
    return float(1e3 * np.linalg.norm(flown[0] - target[0])), float(np.degrees(turn.magnitude()))


def _planned(swing: Swing) -> Manoeuvre:
    return Manoeuvre(Recording("path", None, np.linspace(0.0, swing.duration, 9), {}), swing)
