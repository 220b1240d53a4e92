"""Whitening of every recording, with the encoders' noise linearised at given coordinates."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.inference import whitening
from bayesid.inference.compiled import Numbers, Structure
from bayesid.inference.encoder_noise import SampledMotion
from bayesid.inference.integration_step import simulate_padded
from bayesid.inference.recorded_samples import RecordedSamples
from bayesid.inference.unknowns import Unknowns
from bayesid.inference.whitening import Whitening
from bayesid.simulation.dynamics import Grid
from bayesid.simulation.model import Manoeuvre, Model

__all__ = ["whiten"]


def whiten(
    model: Model,
    recorded: Sequence[RecordedSamples],
    grids: Sequence[Grid],
    manoeuvres: Sequence[Manoeuvre],
    unknowns: Unknowns,
    structure: Structure,
    numbers: Numbers,
    z: Floats,
    windows: Sequence[int | None] | None = None,
) -> list[Whitening]:
    """Return the whitening of every recording.

    Parameters
    ----------
    z : (size,) array
        Linearisation point of the robot and its motion.
    windows : (R,) sequence of int or None, optional
        Number of earlier blocks to condition on; None takes the smallest number that is accurate.

    Returns
    -------
    list of Whitening
    """
    robot = model.robot
    for prior, inertial in zip(model.priors, unknowns.inertials(z), strict=True):
        robot = robot.with_inertial(prior.name, inertial)
    simulated = simulate_padded(manoeuvres, structure, numbers, z, grids)
    rates, attitudes = np.asarray(simulated.rate), np.asarray(simulated.quaternion)
    result = []
    for index, (samples, grid) in enumerate(zip(recorded, grids, strict=True)):
        count = len(samples.time)
        seen = SampledMotion(attitudes[index, :count], rates[index, :count], grid.sample.environment)
        window = None if windows is None else windows[index]
        result.append(whitening.build(samples.noise_model(robot, seen), window))
    return result
