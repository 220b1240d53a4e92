"""What the predictions are worth: fits of many noisy recordings of an independent simulator, and emcee on one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bayesid import Posterior, identify
from bayesid._math.arrays import Floats
from bayesid.design import Design
from bayesid.inference import maximise
from bayesid.robot.inertial_parameters import mass_com_inertia
from studies.common.errors_in_deviations import squared_distances
from studies.common.ets7 import BASE
from studies.common.monte_carlo import run_trials
from studies.excitation.world import fly, recorded

__all__ = ["Realised", "realise"]


@dataclass(frozen=True)
class Realised:
    """One manoeuvre flown.

    Attributes
    ----------
    errors : (repeats, 10) array
        Estimates less the truth, in the order of the predicted quantities.
    sampled : (10,) array
        Posterior standard deviations by emcee on one recording.
    offset : (10,) array
        Posterior mean by emcee less the truth.
    predicted : (10,) array
        Predicted standard deviations.
    distances : (repeats,) array
        Squared distances of the truth from the estimate in the predicted covariance, ten on average.
    """

    errors: Floats
    sampled: Floats
    offset: Floats
    predicted: Floats
    distances: Floats

    @property
    def rms(self) -> Floats:
        """Root mean square error over the predicted standard deviation, shape (10,)."""
        return np.sqrt((self.errors**2).mean(axis=0)) / self.predicted

    @property
    def ratio(self) -> float:
        """Geometric mean of `rms`."""
        return float(np.exp(np.log(self.rms).mean()))

    @property
    def rms_error(self) -> float:
        """Standard error of one entry of `rms`."""
        return float(1.0 / np.sqrt(2.0 * len(self.errors)))


def realise(
    item: Design, seed: int, repeats: int, effective_samples: float, progress: Callable[[str], None]
) -> Realised:
    """Fly a design with the independent simulator, record it many times, and identify the base from each."""
    truth, flown = mass_com_inertia(item.posterior.model.robot.link(BASE).inertial.vector), fly(item.motion)

    def identified(number: int, rng: np.random.Generator) -> dict[str, Floats]:
        """Return the errors of the fit to one recording, and on the first recording the outcome of emcee."""
        posterior = Posterior.of(item.posterior.model, [recorded(flown, rng)], step=item.posterior.step)
        outcome = {}
        if number == 0:
            body = identify(posterior, seed, effective_samples=effective_samples).bodies[BASE]
            outcome = {"sampled": body.sd, "offset": body.mean - truth}
        _, optimum = maximise(posterior, rng, np.zeros(posterior.size))
        return outcome | {"error": mass_com_inertia(posterior.unknowns.inertials(optimum.z)[0].vector) - truth}

    trials = run_trials(identified, range(repeats), seed=seed, progress=lambda text: progress(f"{item.name}: {text}"))
    outcomes = trials.complete()
    errors = np.array([outcome["error"] for outcome in outcomes])
    sampled, offset = (np.array(outcomes[0][key]) for key in ("sampled", "offset"))
    distances = squared_distances(errors, item.predicted.covariance)
    return Realised(errors, sampled, offset, item.predicted.sd, distances)
