"""Complete nonlinear fits of some sets of noise, beside the linear estimates from the same noise."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from bayesid import Manoeuvre, Posterior
from bayesid._math.arrays import Floats
from bayesid.identifiability.local_knowledge import Knowledge
from bayesid.inference import maximise
from bayesid.inference.body_quantities import linearise
from bayesid.robot.joint_state import JointState
from studies.base_body import paper
from studies.common.ets7 import INTERVAL
from studies.common.monte_carlo import Workers, run_trials
from studies.common.quantities import JUDGED
from studies.sensors.draws import Draws
from studies.sensors.linear import STEP, Estimator, Solved, linearised, raw_posterior, recording_of
from studies.sensors.montecarlo import LIKELIHOOD, PIECES, Spread
from studies.sensors.setting import Noise, fly, levels, model_of, motion
from studies.sensors.treatments import LowPass, Wiener
from studies.sensors.weights import integrated

__all__ = ["Refits", "refit_all"]


@dataclass(frozen=True)
class SampledJoints:
    """Joint motion that is known at the samples alone.

    Parameters
    ----------
    states : (3, T, joints) array
        Positions, velocities and accelerations of the joints.
    """

    states: Floats

    def evaluate(self, time: Floats) -> JointState:
        """Return the joint state at the times, shape (T,), which must be samples."""
        rows = np.rint(np.asarray(time) / INTERVAL).astype(int)
        if not np.allclose(rows * INTERVAL, time, atol=1e-9):
            raise ValueError(
                f"times from {np.min(time):g} to {np.max(time):g} s are not all samples {INTERVAL:g} s apart"
            )
        return JointState(*self.states[:, rows])


@dataclass(frozen=True)
class Refits:
    """Nonlinear fits of N sets of noise, and the linear estimates from the same sets."""

    nonlinear: Spread
    linear: Spread

    @property
    def difference(self) -> Floats:
        """Median absolute difference over the linear standard deviation, shape (10,)."""
        gap = self.nonlinear.errors - self.linear.errors
        return np.asarray(np.median(np.abs(gap), axis=0)) / self.linear.sd

    @property
    def diverged(self) -> NDArray[np.bool_]:
        """Which fits have an error of more than the true value in the mass or a moment, shape (N,)."""
        return np.asarray((np.abs(self.nonlinear.errors[:, JUDGED]) > 1.0).any(axis=1))


def refit_all(
    chosen: Sequence[str],
    counts: Mapping[str, int],
    seed: int,
    store: Path | None,
    workers: Workers,
    progress: Callable[[str], None],
) -> dict[str, dict[str, Refits]]:
    """Fit fresh sets of noise by each procedure at each level of noise.

    Parameters
    ----------
    chosen : sequence of str
        Levels of noise.
    counts : mapping of str to int
        Number of fits by procedure, `LIKELIHOOD` or `PAPER`.
    seed, store, workers, progress
        See `studies.common.monte_carlo.run_trials`.

    Returns
    -------
    dict of str to dict of str to Refits
        Fits by level and procedure.
    """
    plan = [(level, procedure) for level in chosen for procedure, count in counts.items() for _ in range(count)]
    trials = run_trials(refit, plan, store, seed=seed, workers=workers, progress=progress).complete()
    results: dict[str, dict[str, Refits]] = {level: {} for level in chosen if plan}
    for level, procedure in dict.fromkeys(plan):
        made = [trial for task, trial in zip(plan, trials, strict=True) if task == (level, procedure)]
        both = (Spread.of(_joined([trial[name] for trial in made])) for name in ("nonlinear", "linear"))
        results[level][procedure] = Refits(*both)
    return results


def _joined(solved: Sequence[Solved]) -> Solved:
    errors, stated, chi2 = (np.concatenate(parts) for parts in zip(*solved, strict=True))
    return errors, stated, chi2


def refit(task: tuple[str, str], rng: np.random.Generator) -> dict[str, Solved]:
    """Fit one set of noise by a procedure at a level of noise, nonlinearly and to first order.

    Fits start from the truth: the question is where the optimum lies, not whether it is reached.
    """
    level, procedure = task
    noise = levels(fly())[level]
    fit = _likelihood if procedure == LIKELIHOOD else _paper
    return fit(Draws.of(fly(), 1, rng), noise, rng)


def _likelihood(draws: Draws, noise: Noise, rng: np.random.Generator) -> dict[str, Solved]:
    """Fit as the package does."""
    measured, linear = draws.measured_motion(noise), linearised()
    manoeuvre = Manoeuvre(draws.recording(noise), measured)
    posterior = Posterior.of(model_of(noise, biased=False), [manoeuvre], step=STEP, flat_prior=True)
    refined, optimum = maximise(posterior, rng, np.zeros(posterior.size))
    chi2 = optimum.chi2 / (refined.samples - refined.size)
    errors = linear.residual(draws.raw("rate", noise), draws.raw("accel", noise), draws.joints(Wiener(), noise))
    return {
        "nonlinear": _solved(Knowledge.at(refined, optimum.z), 1.0, chi2),
        "linear": Estimator(linear, linear.whitening(noise, measured)).solve(errors),
    }


def _paper(draws: Draws, noise: Noise, rng: np.random.Generator) -> dict[str, Solved]:
    """Fit as the paper does: signals treated, accelerations integrated, squares of SI units added."""
    flight, linear = draws.flight, linearised()
    rate, accel = (draws.treated(LowPass(), family, noise)[:, 0] for family in ("rate", "accel"))
    joints = draws.joints(PIECES, noise)
    moved = SampledJoints(np.stack(motion().evaluate(flight.time)) + joints[0])
    recording = recording_of(flight.time, flight.rate + rate[0], flight.accel + accel[0])
    posterior = raw_posterior(recording, moved, biased=False)
    weight = integrated(flight.time, None)
    scalars = weight.shape[1]  # the posterior's other rows are padding

    def residual(z: Floats) -> Floats:
        values: Floats = weight @ posterior.residuals(z).ravel()[:scalars]
        return values

    def jacobian(z: Floats) -> Floats:
        slopes: Floats = weight @ posterior.jacobian(z)[:scalars]
        return slopes

    solution = least_squares(residual, np.zeros(posterior.size), jacobian, method="lm", x_scale="jac")
    variance = 2.0 * solution.cost / (len(weight) - posterior.size)
    knowledge = Knowledge(*linearise(posterior, solution.x), jacobian(solution.x))
    equal_weights = Estimator(linear, weight, declared=False)
    return {
        "nonlinear": _solved(knowledge, np.sqrt(variance), variance),
        "linear": equal_weights.solve(linear.residual(rate, accel, joints)),
    }


def _solved(knowledge: Knowledge, sigma: float, chi2: float) -> Solved:
    return (knowledge.values - paper.TRUTH)[None], sigma * knowledge.sd[None], np.array([chi2])
