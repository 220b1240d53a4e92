"""Limits of theory on what a diagnosis can say of a hidden effect of known size."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from bayesid._math.arrays import Floats, Integers
from bayesid.diagnosis import Diagnosis
from bayesid.diagnosis.candidates.linear_model import SignatureProducts
from bayesid.diagnosis.evidence.cause_sets import CausePrior, enumerate_sets
from bayesid.diagnosis.evidence.gram import Gram, independent_directions
from bayesid.diagnosis.evidence.set_evidence import SetEvidence
from bayesid.diagnosis.evidence.verdict import ProbableVerdict, classes_of_equivalents, probable_verdict
from bayesid.diagnosis.noise.family_alarm import FamilyAlarm
from bayesid.diagnosis.response.perturbed_model import Fit
from bayesid.inference.posterior import Posterior

DRAWS = 1  # simulated data sets from which the decision is taken, in each of hundreds of trials


@dataclass(frozen=True)
class Limits:
    """Limits of theory for one hidden effect."""

    # root of the noncentrality, after the model's unknowns have taken their share; None where what is hidden does not
    # change the mean of the data
    signal_to_noise: float | None
    # probability of an alarm by the test of the hidden effect alone; None where none of the causes has a test
    detection: float | None
    # share of simulated data in which the Bayes decision names the hidden causes alone; None where the model cannot
    # have one of them
    naming: float | None


def limits_of(
    result: Diagnosis,
    causes: Sequence[str],
    change: Floats,
    right: Callable[[ProbableVerdict], bool],
    rng: np.random.Generator,
) -> Limits:
    """Return the limits for hidden causes of the catalogue.

    Parameters
    ----------
    result : Diagnosis
    causes : sequence of str; what is hidden
    change : (N,) array; what is hidden as a change of the whitened residual
    right : callable; whether a verdict names what is hidden, and nothing else
    rng : Generator
    """
    noncentrality = float(result.before.fit.project(change[:, None])[0, 0])
    parameters = {effect.label: max(len(effect.parameters), 1) for effect in result.effects}
    degrees = sum(parameters.get(cause, 3) for cause in causes)
    return Limits(
        float(np.sqrt(noncentrality)),
        _detection(result.alarm, causes, degrees, noncentrality),
        _naming(result, causes, change, right, rng),
    )


def what_is_left(result: Diagnosis, change: Floats) -> float:
    """Return the signal-to-noise ratio of what the most probable set of known causes leaves of a change."""
    return float(np.sqrt(_best(result).project(change[:, None])[0, 0]))


def _best(result: Diagnosis) -> Fit:
    """Return the fit of the most probable set of known causes, beside nothing unknown; of the present model if none."""
    best = next((one for one in result.probabilities.sets if one.causes and one.generic is None), None)
    return result.before.fit if best is None or result.alarm.silent else result.fitted(best.causes).fit


def _detection(alarm: FamilyAlarm, causes: Sequence[str], degrees: int, noncentrality: float) -> float | None:
    """Return the power of chi-square at the local level that is family-wise that of the alarm.

    Candidates share half of the family's level. The local level is that at which the evidence of the hidden cause
    itself, of several the highest, is as rare as the family's largest.
    """
    evidence = alarm.candidates
    least = evidence.largest.threshold(1.0 - np.sqrt(1.0 - alarm.level))
    local = [evidence.each[cause].log_p(least) for cause in causes if cause in evidence.each]
    if not local:
        return None
    return float(stats.ncx2.sf(stats.chi2.isf(np.exp(max(local)), degrees), degrees, noncentrality))


def _naming(
    result: Diagnosis,
    causes: Sequence[str],
    change: Floats,
    right: Callable[[ProbableVerdict], bool],
    rng: np.random.Generator,
) -> float | None:
    """Return the share of simulated data in which the Bayes decision with all rivals names what is hidden.

    The data are those of the linear model: the hidden causes with the amplitudes that come closest to what is hidden,
    and white noise, whose scores are normal with the Gram as covariance. The decision is the verdict on the
    probabilities of all sets of causes and generic candidates under the prior, the alarm apart.
    """
    base = result.search.base
    evidence = base.evidence
    if not all(cause in evidence.causes for cause in causes):
        return None
    fit = base.fit
    changed = _Changed(fit.posterior, change, fit.own, np.zeros(fit.own.shape[1]))
    score = SignatureProducts.of(base.bank.signatures, changed).gram().score
    nearest = _nearest(evidence.gram, score, _forms(evidence, causes))
    return simulated_naming(evidence, result.probabilities.prior, nearest, right, rng)


def simulated_naming(
    evidence: SetEvidence,
    prior: CausePrior,
    score: Floats,
    right: Callable[[ProbableVerdict], bool],
    rng: np.random.Generator,
    draws: int = DRAWS,
) -> float:
    """Return the share of simulated data whose verdict is right, the alarm apart.

    Parameters
    ----------
    evidence : SetEvidence; all candidates
    prior : CausePrior
    score : (m,) array; what the hidden causes add to the score of the Gram
    right : callable
    rng : Generator
    draws : int; number of simulated data sets
    """
    count = 0
    for noise in evidence.gram.null_scores(rng, draws):
        drawn = SetEvidence(replace(evidence.gram, score=score + noise), evidence.causes.values())
        probabilities = enumerate_sets(drawn, prior)
        count += right(probable_verdict(probabilities, classes_of_equivalents(drawn), silent=False))
    return count / draws


@dataclass(frozen=True)
class _Changed:
    """A fit in which the residual is a change of the data alone."""

    posterior: Posterior
    residual: Floats
    own: Floats
    own_coordinates: Floats


def _forms(evidence: SetEvidence, causes: Sequence[str]) -> list[Integers]:
    """Return the columns of the causes in each combination of their forms."""
    combinations = [np.zeros(0, dtype=int)]
    for cause in causes:
        forms = [
            np.concatenate([evidence.gram.groups[group.name] for group in variant.groups])
            for variant in evidence.causes[cause].variants
        ]
        combinations = [np.concatenate([before, columns]) for before in combinations for columns in forms]
    return combinations


def _nearest(gram: Gram, score: Floats, forms: Sequence[Integers]) -> Floats:
    """Return the score of a change in all columns, the change replaced by what the best form comes closest to."""
    nearest, most = np.zeros_like(score), -1.0
    for columns in forms:
        directions = independent_directions(gram.matrix[np.ix_(columns, columns)])
        fitted = directions.T @ score[columns]
        if fitted @ fitted > most:
            most = float(fitted @ fitted)
            nearest = gram.matrix[:, columns] @ (directions @ fitted)
    return nearest
