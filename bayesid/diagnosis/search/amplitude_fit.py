"""Fit of a set of causes in their amplitudes, with the prior of the scales that the Gram finds most probable."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from bayesid._math.arrays import Floats, Integers
from bayesid.diagnosis.candidates.catalogue_signatures import group_names
from bayesid.diagnosis.candidates.initial_rate_signatures import INITIAL_RATE
from bayesid.diagnosis.evidence.gram import GaussianBlock
from bayesid.diagnosis.response.perturbed_model import Fit
from bayesid.diagnosis.search.linearisation import Linearisation
from bayesid.simulation.effects.effect import Effect

__all__ = ["fit_in_amplitudes", "predicted_cost"]

FAR = 20.0
"""Difference from the predicted cost beyond which a fit is started anew [nats]."""


def fit_in_amplitudes(point: Linearisation, effects: Sequence[Effect], released: bool = False) -> tuple[Fit, float]:
    """Fit causes that are linear in their amplitudes, with all unknowns.

    Where the fit does not end where the linear model says, it is started from the prior's centre as well, since the
    unknowns of the present model may have strayed too far to imitate what it lacks.

    Parameters
    ----------
    point : Linearisation
        From whose Gram the scales and the start follow.
    effects : sequence of Effect
        The causes, none of which vibrates.
    released : bool
        Whether the initial rates that the study takes to be zero are among the causes.

    Returns
    -------
    fit : Fit
        With the effects in amplitudes; released rates are no unknowns of it, but keep their values.
    expected : float
        Cost that the linear model predicts for it: where both agree, the linear evidence holds.
    """
    evidence = point.evidence
    names = sorted([*(effect.label for effect in effects), *([INITIAL_RATE] if released else [])])
    forms = evidence.forms(names)
    held, deviations = evidence.most_probable(names, forms)
    mean, gain = _mode(point, names, held, deviations)
    scaled, start = [], []
    sizes = dict(zip(held.tolist(), zip(deviations, mean, strict=True), strict=True))
    for effect in effects:
        linear = copy.copy(effect.in_amplitudes())
        if linear.parameters:
            places = _places(linear, effect, evidence.gram.groups)
            count = len(linear.parameters)
            sigma = np.array([sizes[place][0] for place in places])
            linear.parameters = tuple(
                parameter._replace(sigma=float(own), mean=0.0)
                for parameter, own in zip(linear.parameters, sigma[:count], strict=True)
            )
            start.append(np.array([sizes[place][1] for place in places]) / sigma)
        else:
            start.append(np.zeros(0))
        scaled.append(linear)
    perturbed = point.perturbed.released() if released else point.perturbed
    frozen = point.perturbed.frozen
    z = point.fit.z.copy()
    if released:
        z[frozen] = perturbed.posterior.starting_point()[frozen]
    expected = predicted_cost(point) - gain
    fit = perturbed.fit(scaled, start, z=z, operating=None if released else point.fit.operating)
    if abs(fit.cost - expected) > FAR and not point.far:  # far from the data no fit finds them from the centre
        fresh = perturbed.fit(scaled, [np.zeros_like(own) for own in start])
        fit = fresh if fresh.cost < fit.cost else fit
    if not released:
        return fit, expected
    known = np.delete(fit.own, np.searchsorted(perturbed.free, frozen), axis=1)
    return replace(fit, own=known, released=np.zeros(0, dtype=int), frozen=frozen), expected


def predicted_cost(point: Linearisation) -> float:
    """Return half of chi-square and squared unknowns of the present model at its mode, by the linear model."""
    own = point.fit.own
    constant = float(point.fit.posterior.log_normalisation.sum())
    return constant - GaussianBlock.of(own.T @ own).half_log_det - point.log_nothing


def _places(linear: Effect, effect: Effect, groups: Mapping[str, Integers]) -> list[int]:
    """Return the columns of the Gram of each amplitude, recording after recording."""
    names = group_names(effect)
    waiting = {name: list(map(int, groups[name])) for name in set(names.values())}
    total = sum(len(own) for own in waiting.values())
    units = np.resize([parameter.unit for parameter in linear.parameters], total)
    return [waiting[names[str(unit)]].pop(0) for unit in units]


def _mode(point: Linearisation, names: Sequence[str], held: Integers, deviations: Floats) -> tuple[Floats, float]:
    """Return the amplitudes at the mode, given their scales, and the decrease of the cost that they bring."""
    evidence = point.evidence
    score = evidence.score_beside(names)
    gain = 0.0
    for name in names:
        if evidence.causes[name].fixed:
            own = evidence.gram.groups[evidence.causes[name].groups[0].name]
            gain -= float(evidence.gram.score[own].sum() + 0.5 * evidence.gram.matrix[np.ix_(own, own)].sum())
    if not len(held):
        return np.zeros(0), gain
    block = GaussianBlock.of(evidence.gram.matrix[np.ix_(held, held)], deviations)
    pull = block.share(score[held])
    return block.mean(score[held]), gain + 0.5 * float(pull @ pull)
