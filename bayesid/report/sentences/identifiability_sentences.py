"""Sentences of an identifiability report: structure, learnt and unlearnt directions, advice and method."""

from __future__ import annotations

import numpy as np

from bayesid._io.words import abridged
from bayesid.identifiability.advice import WORST
from bayesid.identifiability.base_parameters import BaseParameters
from bayesid.identifiability.normality import NORMAL, Method
from bayesid.identifiability.parameter_table import ParameterRow
from bayesid.identifiability.practical_identifiability import Practical
from bayesid.inference.contraction import CONTRACTED, PRIOR_ONLY, ContractionVerdict
from bayesid.report.numbers import format_percent

__all__ = [
    "advice_sentences",
    "confidence_sentences",
    "method_sentences",
    "practical_sentences",
    "structure_sentence",
]


def structure_sentence(structure: BaseParameters) -> str:
    """Return the number of standard parameters of the robot, and that of the base parameters they combine to."""
    return (
        f"Of {len(structure.standard)} standard inertial parameters of the robot, motion and torques depend on "
        f"{len(structure.independent)} combinations, the base parameters."
    )


def practical_sentences(result: Practical) -> list[str]:
    """Return which parameters and directions the study tells of, and which it does not."""
    count = {verdict: sum(item.verdict is verdict for item in result.parameters) for verdict in ContractionVerdict}
    total = len(result.parameters)
    fully, weakly, not_at_all = (count[verdict] for verdict in ContractionVerdict)
    sentences = [
        f"Of {total} parameters of the bodies to identify {fully} are learnt, {weakly} weakly, {not_at_all} not."
    ]
    if names := [item.name for item in result.parameters if item.verdict is ContractionVerdict.NOT]:
        sentences.append(f"Not learnt, so that the posterior is the prior: {abridged(names)}.")
    directions = sum(item.verdict is ContractionVerdict.NOT for item in result.directions)
    if directions:
        plural = "direction is" if directions == 1 else "directions are"
        sentences.append(f"{directions} of {len(result.directions)} {plural} not learnt.")
    sentences.append(f"The worst known direction: {result.words[0]}.")
    worst = min(result.parameters, key=lambda item: item.shrinkage)
    sentences.append(
        f"The worst known parameter: {worst.name}, {format_percent(1.0 - worst.shrinkage)} of the prior's width is left"
        f"{_confused(worst)}."
    )
    return sentences


def advice_sentences(result: Practical) -> list[str]:
    """Return which candidates narrow the worst direction most."""
    usable = [item for item in result.advice if not item.reason]
    worst = result.directions[0]
    now = worst.sd / worst.prior_sd
    if not usable or usable[0].directions[0] > 0.95 * now:
        return ["None of the candidates narrows the worst direction by more than 5 %."]
    best = [item for item in usable if item.directions[0] <= 0.95 * now][:WORST]
    texts = "; ".join(f"{format_percent(item.directions[0])} with {item.text}" for item in best)
    return [f"Of the worst direction {format_percent(now)} of the prior's width is left. It would be {texts}."]


def confidence_sentences(result: Practical) -> list[str]:
    """Return how the normal approximation was checked."""
    draws = result.draws
    if not draws.trusted:
        also = "with so many unknowns emcee was not tried"
        if draws.method is Method.ENSEMBLE:
            also = "emcee has not converged"
        return [
            f"Whether the posterior is normal is not evaluated: importance sampling may not be trusted (Pareto k-hat "
            f"{draws.pareto_k:.2f}), and {also}. All widths are those of the normal approximation; profile intervals "
            "are given for the worst known parameters of which something was learnt."
        ]
    skewed = [item.name for item in result.parameters if not item.normal]
    how = f"{draws.method.value}, {len(draws.values)} draws, Pareto k-hat of importance sampling {draws.pareto_k:.2f}"
    if not skewed:
        return [
            f"The posterior of every parameter is normal within {NORMAL:g} sd at its 2.5, 16, 84 and 97.5 % ({how})."
        ]
    profiled = sum(item.profile is not None for item in result.parameters)
    return [
        f"The posterior of {abridged(skewed)} is not normal: a quantile is off by more than {NORMAL:g} sd ({how}). "
        f"{profiled} of {len(skewed)} were profiled, the least normal first."
    ]


def method_sentences(result: Practical) -> list[str]:
    """Return how to read the figures and tables."""
    return [
        "Prior and posterior are compared in the normal approximation about the fit (for a prediction, about the "
        "prior's centre): C = D (J'J)⁻¹ D' and C₀ = D D', with J the derivative of whitened residuals and prior and D "
        "that of the parameters. Initial rates, effects and links that are known to a few percent are marginalised.",
        f"A parameter or direction is learnt if the data narrow the prior by at least {100 * CONTRACTED:.0f} %, and "
        f"not learnt if by less than {100 * PRIOR_ONLY:.0f} %.",
        "Learning counts what the data carry over: a mass tied by the data to others is known as well as the priors of "
        "all of these together say.",
        "A direction is a combination of parameters whose weights are scaled so that the largest, times the prior sd "
        "of its parameter, is one. Its displacement is the change of all parameters by one posterior sd of the "
        "combination: the data cannot tell whether it happened. Directions of which the data tell less than 1 % have "
        "no order; they are turned so that each moves few parameters.",
        "The words for a direction are read off its displacement in units of the prior's widths and name only its "
        "largest parts; the numbers are in identifiability.json.",
        "Advice is computed as one more prediction for each candidate, linearised at the same point.",
    ]


def _confused(item: ParameterRow) -> str:
    if not item.correlated_with:
        return ""
    alone = 1.0 - item.conditional_sd / item.prior_sd
    names = abridged([name for name, _ in item.correlated_with])
    if np.isfinite(alone) and alone > item.shrinkage + PRIOR_ONLY:
        return f", as it is confused with {names}; were these known, {format_percent(1.0 - alone)} would be"
    return f"; it is correlated with {names}"
