"""How far the motion that is predicted without the named causes is from that with them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.design.base_prediction import base_and_tip
from bayesid.diagnosis.search.fitted_set import Hypothesis
from bayesid.inference.perturbed_posterior import trace
from bayesid.robot.kinematics import Tip

__all__ = ["MotionChange", "motion_change"]


@dataclass(frozen=True)
class MotionChange:
    """Largest distances, over all recordings, between the motions of two fits.

    Attributes
    ----------
    rate : float
        Of the angular velocities of the base [rad/s].
    tip_frame : str or None
        Name of the end-effector's frame; None where the robot has no joints.
    tip : float
        Of the positions of the end-effector, from the same start of the base and without external force [m].
    """

    rate: float
    tip_frame: str | None
    tip: float

    def to_dict(self) -> dict[str, Any]:
        """Return the change in the form that it has in JSON."""
        rate = {"largest": self.rate, "unit": "rad/s"}
        if self.tip_frame is None:
            return {"rate": rate}
        return {"rate": rate, "tip": {"frame": self.tip_frame, "largest": self.tip, "unit": "m"}}


def motion_change(before: Hypothesis, after: Hypothesis) -> MotionChange:
    """Compare the motions of the present model and the extended one, each at its fit.

    Parameters
    ----------
    before, after : Hypothesis
    """
    posterior = before.fit.posterior
    robot = posterior.model.robot
    tip = Tip.of(robot) if robot.joints else None
    samples = [trace(one.fit.posterior, one.fit.z, one.fit.data).sample for one in (before, after)]
    rate = distance = 0.0
    for index, manoeuvre in enumerate(posterior.manoeuvres):
        count = len(posterior.data.recorded[index].nodes)
        rates, turns, centres = (
            [np.asarray(of)[index, :count] for of in each]
            for each in zip(*((sample.rate, sample.attitude, sample.body.com) for sample in samples), strict=True)
        )
        rate = max(rate, _largest(rates[1] - rates[0]))
        if tip is not None:
            time = np.asarray(samples[0].environment.time)[index, :count]
            place = tip.motion(robot, manoeuvre.motion.evaluate(time))[0][:, :3, 3]
            ends = [base_and_tip(turn, centre, place)[1] for turn, centre in zip(turns, centres, strict=True)]
            distance = max(distance, _largest(ends[1] - ends[0]))
    return MotionChange(rate, None if tip is None else tip.name, distance)


def _largest(vectors: Floats) -> float:
    return float(np.linalg.norm(vectors, axis=-1).max(initial=0.0))
