"""The report on what can be identified, by the structure of the robot and by a study's manoeuvres and sensors."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bayesid._io.words import abridged
from bayesid.identifiability.advice import WORST, Advice
from bayesid.identifiability.base_parameters import BaseParameters
from bayesid.identifiability.parameter_table import NORMAL, Method, ParameterRow
from bayesid.identifiability.practical_identifiability import Practical
from bayesid.inference.body_quantities import CONTRACTED, PRIOR_ONLY, ContractionVerdict
from bayesid.inference.predicted_readings import integration_error_at
from bayesid.report import figures
from bayesid.report.document import Document, Rows
from bayesid.report.model_assumptions import add_joints, model_sentences
from bayesid.report.numbers import (
    format_fixed,
    format_number,
    format_percent,
    format_quantity,
    format_signed,
    format_unit,
)

__all__ = [
    "advice_sentences",
    "confidence_sentences",
    "identifiability_report",
    "practical_sentences",
    "structure_sentence",
]

SHOWN = 20  # largest number of directions in the table, from the worst known
NEGLIGIBLE = 1e-9  # size of a regrouping's coefficient below which it is rounding


def identifiability_report(
    structure: BaseParameters, result: Practical | None, statement: str, title: str, file: Path, *, origin: str = ""
) -> None:
    """Write the report as PDF, whole or not at all.

    Parameters
    ----------
    structure : BaseParameters
        Base parameters of the whole robot.
    result : Practical or None
        Practical identifiability, None where the study has no recordings.
    statement : str
        Basis of the practical part, or why there is none.
    title : str
        Title of the study.
    file : path
    origin : str, optional
        Where the report comes from: files with their hashes, version, seed and command.
    """
    document = Document(title, "What can be identified")
    document.foot(origin)
    document.section("Summary")
    document.paragraph(structure_sentence(structure))
    document.paragraph(statement)
    if result is not None:
        document.items([*practical_sentences(result), *advice_sentences(result)])
        _add_directions(document, result)
        _add_parameters(document, result)
        _add_advice(document, result)
    _add_structure(document, structure)
    if result is not None:
        document.section("Method and assumptions")
        error = integration_error_at(result.posterior, result.optimum.z)
        document.items([*method_sentences(result), *model_sentences(result.posterior, error)])
        add_joints(document, result.posterior)
    document.write(file)


def _add_directions(document: Document, result: Practical) -> None:
    document.section("Directions")
    document.figure(
        figures.direction_widths(result.directions),
        "Remaining share of the prior's width in every direction, from the worst to the best known. At one, the data "
        "add no information.",
    )
    shown = min(SHOWN, len(result.directions))
    document.table(
        ["no.:", "remaining:", "verdict", "direction"],
        direction_rows(result, shown),
        f"The {shown} worst known of {len(result.directions)} directions: the remaining share of the prior's width, "
        "and the largest parts of the displacement that the data cannot resolve.",
    )
    document.figure(
        figures.displacements(result.directions, result.knowledge.prior_sd),
        "Displacement of the parameters along the worst known directions by one posterior sd, in units of the "
        "parameter's prior sd. Parameters that no direction moves are omitted.",
    )


def _add_parameters(document: Document, result: Practical) -> None:
    document.section("Parameters")
    document.items(confidence_sentences(result))
    header = ["parameter", "unit", "value ± sd:", "prior sd:", "learnt:", "verdict", "confused with", "95 % profile"]
    rows = parameter_rows(result)
    kept = [column for column in range(len(header)) if any(row[column] for row in rows)]
    document.table(
        [header[column] for column in kept],
        [[row[column] for column in kept] for row in rows],
        "Parameters of the bodies to identify, in the axes of the link, inertias about the body's centre of mass: "
        "value and sd of the normal approximation, prior sd, and learnt, which is one minus sd over prior sd; where "
        "applicable, parameters with a correlation above 0.9 in magnitude, and the profile interval of a posterior "
        "that is not normal.",
    )


def _add_advice(document: Document, result: Practical) -> None:
    document.section("Recommended measurements")
    document.items(advice_sentences(result))
    worst = min(result.parameters, key=lambda item: item.shrinkage)
    numbers = [f"no. {number}:" for number in range(1, WORST + 1)]
    document.table(
        ["with", *numbers, f"sd of {worst.name}:", "nats:"],
        advice_rows(result, worst),
        "Possible additions to the study, each alone; pulses and swings are added to every recording. For each: the "
        "remaining share of the prior's width in the presently worst directions, the standard deviation of the "
        "presently worst known parameter, and the added information on all parameters.",
    )


def _add_structure(document: Document, structure: BaseParameters) -> None:
    document.section("Structure of the robot")
    document.paragraph(
        "This section is valid for any motion and any sensors, and for known torques or actions. The standard "
        "parameters of a body are its mass, the first moment of mass (first.x, y, z) and the inertia about the origin "
        "of the link, in the link's axes. Not all of them can be separated: the dependent ones act only in sums with "
        "others."
    )
    rows, alone = regrouping_rows(structure)
    document.table(
        ["base parameter", "regrouped with dependent parameters"],
        rows,
        f"Base parameters that represent sums. Coefficients follow from the geometry [m, m²]; the "
        f"{len(structure.dependent)} dependent parameters are {', '.join(structure.dependent)}.",
    )
    if alone:
        document.paragraph(f"The other base parameters are single parameters: {', '.join(alone)}.")


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
        f"Of the {total} parameters of the bodies to identify, {fully} are learnt from the data, {weakly} weakly and "
        f"{not_at_all} not at all."
    ]
    if names := [item.name for item in result.parameters if item.verdict is ContractionVerdict.NOT]:
        sentences.append(f"Not learnt (the posterior equals the prior): {abridged(names)}.")
    directions = sum(item.verdict is ContractionVerdict.NOT for item in result.directions)
    if directions:
        plural = "direction is" if directions == 1 else "directions are"
        sentences.append(f"{directions} of {len(result.directions)} {plural} not learnt.")
    subject, _, known = result.words[0].partition(": ")
    sentences.append(f"The least well determined direction is {subject}: {known}.")
    worst = min(result.parameters, key=lambda item: item.shrinkage)
    sentences.append(
        f"The least well determined parameter is {worst.name}: {format_percent(1.0 - worst.shrinkage)} of the prior's "
        f"width remains{_confused(worst)}."
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
    texts = "; ".join(f"to {format_percent(item.directions[0])} ({item.text})" for item in best)
    remains = f"In the worst direction, {format_percent(now)} of the prior's width remains."
    return [f"{remains} It could be reduced {texts}."]


def confidence_sentences(result: Practical) -> list[str]:
    """Return how the normal approximation was checked."""
    draws = result.draws
    if not draws.trusted:
        also = "emcee was not tried because of the number of unknowns"
        if draws.method is Method.ENSEMBLE:
            also = "emcee has not converged"
        return [
            f"The normality of the posterior is not evaluated: importance sampling is not reliable (Pareto k-hat "
            f"{draws.pareto_k:.2f}), and {also}. All widths are those of the normal approximation; profile intervals "
            "are given for the worst known of the learnt parameters."
        ]
    skewed = [item.name for item in result.parameters if not item.normal]
    how = f"{draws.method.value}, {len(draws.values)} draws, Pareto k-hat of importance sampling {draws.pareto_k:.2f}"
    if not skewed:
        return [
            f"The posterior of every parameter is normal within {NORMAL:g} sd at its 2.5, 16, 84 and 97.5 % quantiles "
            f"({how})."
        ]
    profiled = sum(item.profile is not None for item in result.parameters)
    return [
        f"The posterior of {abridged(skewed)} is not normal: a quantile deviates by more than {NORMAL:g} sd ({how}). "
        f"{profiled} of {len(skewed)} were profiled, the least normal first."
    ]


def method_sentences(result: Practical) -> list[str]:
    """Return how to read the figures and tables."""
    return [
        "Prior and posterior are compared in the normal approximation about the fit (for a prediction, about the "
        "prior's centre): C = D (J'J)⁻¹ D' and C₀ = D D', with J the derivative of whitened residuals and prior and D "
        "that of the parameters. Initial rates, effects and links with a few percent uncertainty are marginalised.",
        f"A parameter or direction is learnt if the data narrow the prior by at least {100 * CONTRACTED:.0f} %, and "
        f"not learnt if they narrow it by less than {100 * PRIOR_ONLY:.0f} %.",
        "Learning includes information that the data transfer from other parameters: a mass that the data tie to "
        "others is known as well as the priors of all of these together allow.",
        "A direction is a combination of parameters whose weights are scaled so that the largest, times the prior sd "
        "of its parameter, is one. Its displacement is the change of all parameters by one posterior sd of the "
        "combination, which the data cannot resolve. Directions in which the data narrow the prior by less than 1 % "
        "have no order; they are rotated so that each moves few parameters.",
        "The description of a direction is derived from its displacement in units of the prior's widths and names only "
        "its largest parts; the numbers are in identifiability.json.",
        "The recommendations use one additional prediction for each candidate, linearised at the same point.",
    ]


def _confused(item: ParameterRow) -> str:
    if not item.correlated_with:
        return ""
    alone = 1.0 - item.conditional_sd / item.prior_sd
    names = abridged([name for name, _ in item.correlated_with])
    if np.isfinite(alone) and alone > item.shrinkage + PRIOR_ONLY:
        return f" because it is confused with {names}; if these were known, {format_percent(1.0 - alone)} would remain"
    return f"; it is correlated with {names}"


def direction_rows(result: Practical, shown: int) -> Rows:
    """Return number, share of the prior's width that is left, verdict and words of the worst known directions."""
    worst = zip(result.directions[:shown], result.words[:shown], strict=True)
    return [
        [str(number), format_percent(item.sd / item.prior_sd), item.verdict.value, words.partition(": ")[0]]
        for number, (item, words) in enumerate(worst, start=1)
    ]


def parameter_rows(result: Practical) -> Rows:
    """Return name, unit, value ± sd, prior sd, shrinkage, verdict, correlations and profile interval of parameters."""
    return [
        [
            item.name,
            format_unit(item.unit),
            format_quantity(item.mean, item.sd),
            format_number(item.prior_sd, 2),
            format_percent(item.shrinkage),
            "prior only" if item.verdict is ContractionVerdict.NOT else item.verdict.value,
            _correlations(item),
            _interval(item),
        ]
        for item in result.parameters
    ]


def _correlations(item: ParameterRow) -> str:
    body = item.name.partition(".")[0]
    return ", ".join(
        f"{name.removeprefix(f'{body}.')} ({format_signed(value, 2)})" for name, value in item.correlated_with
    )


def _interval(item: ParameterRow) -> str:
    if item.profile is None:
        return "" if item.normal else "not evaluated"
    return " to ".join("beyond" if end is None else format_number(end, 3) for end in item.profile.to_dict()["95 %"])


def advice_rows(result: Practical, worst: ParameterRow) -> Rows:
    """Return what is left of the worst directions, sd of one parameter, and information: now, and with each candidate.

    Parameters
    ----------
    worst : ParameterRow
        Parameter of which the data tell least at present.
    """
    now = [item.sd / item.prior_sd for item in result.directions[:WORST]]
    return [
        ["no addition (present)", *_shares(now), f"{format_number(worst.sd, 2)} {format_unit(worst.unit)}", "0.0"],
        *(_advice_row(item, worst.unit) for item in result.advice),
    ]


def _advice_row(item: Advice, unit: str) -> list[str]:
    if item.reason:
        return [item.text, f"not evaluated: {item.reason}", *[""] * (WORST + 1)]
    sd = f"{format_number(item.sd, 2)} {format_unit(unit)}"
    return [item.text, *_shares(item.directions), sd, format_fixed(item.information, 1)]


def _shares(ratios: list[float] | tuple[float, ...]) -> list[str]:
    return [format_percent(ratio) for ratio in ratios] + [""] * (WORST - len(ratios))


def regrouping_rows(structure: BaseParameters) -> tuple[Rows, list[str]]:
    """Return base parameter and sum for those that stand for sums, and the names of those that stand for themselves."""
    rows, alone = [], []
    for name, row in zip(structure.independent, structure.regrouping, strict=True):
        terms = [
            _term(float(value), dependent)
            for value, dependent in zip(row, structure.dependent, strict=True)
            if abs(value) > NEGLIGIBLE
        ]
        if terms:
            rows.append([name, " ".join([name, *terms])])
        else:
            alone.append(name)
    return rows, alone


def _term(value: float, name: str) -> str:
    sign = "−" if value < 0.0 else "+"
    size = "" if abs(abs(value) - 1.0) < NEGLIGIBLE else f"{format_number(abs(value), 4)} "
    return f"{sign} {size}{name}"
