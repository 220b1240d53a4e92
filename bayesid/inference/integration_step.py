"""Choice of the integration step: the longest whose error stays far below the sensors' noise."""

from __future__ import annotations

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid._math.double_precision import in_double_precision
from bayesid._math.on_device import on_device
from bayesid.inference import compiled
from bayesid.inference.compiled import Numbers, Simulated, Structure
from bayesid.inference.data import RecordedSamples, attitudes_of, grids_of
from bayesid.recording.plausibility import refuse_unfollowed_base
from bayesid.recording.recording import Recording
from bayesid.simulation.dynamics import Grid
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.sensors import SensorKind
from bayesid.simulation.time_grid import pad_grids, rounded

__all__ = ["choose_step", "integration_error", "simulate_padded"]

LONGEST_STEP = 2.0
"""Longest integration step, from which the search starts [s]."""

STEP_TOLERANCE = 0.01
"""Largest integration error allowed, in standard deviations of a sample."""

SHORTEST_STEP = 2e-4
"""Shortest integration step [s]."""

MOST_PER_ROW = 64.0
"""Number of steps from one row of a recording to the next beyond which its motion is taken for one in wrong units."""

HOPELESS = 1.0 / 64.0
"""Part of the first step at which a simulation without finite readings is given up."""

FEWEST_STEPS = 512
"""Smallest number of steps to which simulations of different steps are padded; larger numbers are powers of two."""


def choose_step(
    model: Model,
    manoeuvres: Sequence[Manoeuvre],
    recorded: Sequence[RecordedSamples],
    structure: Structure,
    numbers: Numbers,
    z: Floats,
) -> float:
    """Return the longest step [s], by halving from `LONGEST_STEP`, whose error at ``z`` is within `STEP_TOLERANCE`.

    Parameters
    ----------
    model : Model
    manoeuvres : sequence of Manoeuvre
    recorded : (R,) sequence of RecordedSamples
    structure : Structure
    numbers : Numbers
    z : (size,) array
        Coordinates.

    Raises
    ------
    InputError
        If a recorded motion is too fast to be followed.
    """
    for manoeuvre in manoeuvres:
        refuse_unfollowed_base(manoeuvre.recording)
    interval = min(float(np.median(np.diff(manoeuvre.recording.time))) for manoeuvre in manoeuvres)
    shortest = min(float(samples.time[-1]) for samples in recorded)
    step = min([LONGEST_STEP, 0.25 * shortest, *(effect.longest_step for effect in model.effects)])
    coarsest = step
    grids = {step: grids_of(model, manoeuvres, recorded, step)}
    while True:
        finer = grids_of(model, manoeuvres, recorded, 0.5 * step)
        error = _error(model, manoeuvres, recorded, structure, numbers, z, (grids[step], finer))
        if error <= STEP_TOLERANCE:
            return step
        step *= 0.5
        if np.isinf(error) and step < HOPELESS * coarsest:
            named = f", and the effects {', '.join(effect.label for effect in model.effects)}" if model.effects else ""
            raise InputError(
                "the simulation gives no finite readings near the prior's centre",
                remedy=f"Check the units of joint motion and of the robot's inertial parameters{named}",
            )
        grids = {step: finer}
        if step < max(SHORTEST_STEP, interval / MOST_PER_ROW):
            raise _step_error(model, manoeuvres)


def _step_error(model: Model, manoeuvres: Sequence[Manoeuvre]) -> InputError:
    """Return the error where no step is short enough, with the recorded column of the fastest motion."""
    problem = "no integration step has an error below 1 % of the sensor noise"
    remedy = "Give rates in rad/s and joints in rad, and check the sensors' sigma"
    speeds_by_column: list[tuple[float, str, Recording, str]] = []
    for manoeuvre in manoeuvres:
        recording = manoeuvre.recording
        for column in SensorKind.RATE.columns:
            if column in recording.channels:
                rate = float(np.nanmax(np.abs(recording.channels[column])))
                speeds_by_column.append((rate, SensorKind.RATE.unit, recording, column))
        speeds = np.abs(manoeuvre.motion.evaluate(recording.time).velocity).max(axis=0)
        for joint, speed in zip(model.robot.joints, speeds, strict=True):
            family = "position" if f"position.{joint.name}" in recording.channels else "velocity"
            speeds_by_column.append((float(speed), f"{joint.unit}/s", recording, f"{family}.{joint.name}"))
    if not speeds_by_column:
        return InputError(problem, remedy=remedy)
    speed, unit, recording, column = max(speeds_by_column, key=lambda entry: entry[0])
    return InputError(
        f"{problem}; the fastest motion recorded is {speed:.3g} {unit}",
        file=recording.file or recording.name,
        place=f"column '{column}'",
        remedy=remedy,
    )


def integration_error(
    model: Model,
    manoeuvres: Sequence[Manoeuvre],
    recorded: Sequence[RecordedSamples],
    structure: Structure,
    numbers: Numbers,
    z: Floats,
    step: float,
) -> float:
    """Return the largest error of any sample due to the step, in its standard deviations, from half the step.

    Parameters
    ----------
    model : Model
    manoeuvres : sequence of Manoeuvre
    recorded : (R,) sequence of RecordedSamples
    structure : Structure
    numbers : Numbers
    z : (size,) array
        Coordinates.
    step : float
        Integration step [s].
    """
    both = [grids_of(model, manoeuvres, recorded, size) for size in (step, 0.5 * step)]
    return _error(model, manoeuvres, recorded, structure, numbers, z, (both[0], both[1]))


def simulate_padded(
    manoeuvres: Sequence[Manoeuvre],
    structure: Structure,
    numbers: Numbers,
    z: Floats,
    grids: Sequence[Grid],
    steps: int | None = None,
) -> Simulated:
    """Simulate all recordings on grids of any step, padded so that grids of different steps share compiled code.

    Parameters
    ----------
    manoeuvres : sequence of Manoeuvre
    structure : Structure
    numbers : Numbers
    z : (size,) array
        Coordinates.
    grids : (R,) sequence of Grid
    steps : int, optional
        Number of steps to pad to, by default that of the longest grid.
    """
    count = steps or max(len(grid.step) for grid in grids)
    count = max(FEWEST_STEPS, 1 << (count - 1).bit_length())
    samples = rounded(max(len(grid.step_of) for grid in grids))
    attitude = on_device(attitudes_of(manoeuvres))
    return compiled.simulated(structure, numbers, on_device(z), pad_grids(grids, count, samples), attitude)


@in_double_precision
def _error(
    model: Model,
    manoeuvres: Sequence[Manoeuvre],
    recorded: Sequence[RecordedSamples],
    structure: Structure,
    numbers: Numbers,
    z: Floats,
    grids: tuple[list[Grid], list[Grid]],
) -> float:
    steps = max(len(grid.step) for grid in grids[1])
    coarse, fine = (simulate_padded(manoeuvres, structure, numbers, z, grid, steps).readings for grid in grids)
    worst = 0.0
    for kind in model.channels.kinds:
        sigma = np.stack([samples.sigma(kind) for samples in recorded])
        between = jnp.vectorize(kind.residual, signature="(a),(a)->(c)")
        difference = np.asarray(between(fine.channels[kind.value], coarse.channels[kind.value]))
        worst = max(worst, _largest(difference, sigma[:, None]))
    if model.torque is not None:
        columns = model.torque.columns(model.robot)
        first, second = (np.asarray(readings.torque)[..., columns] for readings in (coarse, fine))
        worst = max(worst, _largest(first - second, np.array(model.torque.sigma)))
    return worst * 16.0 / 15.0  # error of a fourth-order method from the difference to half the step


def _largest(difference: Floats, sigma: Floats) -> float:
    """Return the largest difference in sigma, infinite where one is not finite."""
    with np.errstate(invalid="ignore", over="ignore"):  # a step that is far too long
        largest = float(np.abs(difference / sigma).max())
    return largest if np.isfinite(largest) else float("inf")
