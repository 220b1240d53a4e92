"""The report on what can be identified: by the robot's structure, and by a study's manoeuvres, sensors and priors."""

from __future__ import annotations

from pathlib import Path

from bayesid.identifiability.advice import WORST
from bayesid.identifiability.base_parameters import BaseParameters
from bayesid.identifiability.parameter_table import ParameterRow
from bayesid.identifiability.practical_identifiability import Practical
from bayesid.inference.contraction import ContractionVerdict
from bayesid.inference.predicted_readings import integration_error_at
from bayesid.report import figures
from bayesid.report import identifiability_text as text
from bayesid.report.assumptions import model_sentences
from bayesid.report.document import Document
from bayesid.report.identification_report import add_joints
from bayesid.report.numbers import format_number, format_quantity, format_unit

__all__ = ["identifiability_report"]

NEGLIGIBLE = 1e-9
"""Coefficient of a regrouping that is rounding."""

SHOWN = 20
"""Directions in words, from the worst."""


def identifiability_report(
    structure: BaseParameters, result: Practical | None, statement: str, title: str, file: Path
) -> None:
    """Write the report as PDF, all or nothing.

    Parameters
    ----------
    structure : BaseParameters
        Of the whole robot.
    result : Practical or None
        None where the study has no recordings.
    statement : str
        What the practical part rests on, or why there is none.
    title : str
        Of the study.
    file : path
    """
    document = Document(title, "What can be identified")
    document.section("Summary")
    document.paragraph(text.structure_sentence(structure))
    document.paragraph(statement)
    if result is not None:
        document.items([*text.practical_sentences(result), *text.advice_sentences(result)])
        _add_directions(document, result)
        _add_parameters(document, result)
        _add_advice(document, result)
    _add_structure(document, structure)
    if result is not None:
        document.section("How to read this, and what was assumed")
        error = integration_error_at(result.posterior, result.optimum.z)
        document.items([*text.method_sentences(result), *model_sentences(result.posterior, error)])
        add_joints(document, result.posterior)
    document.write(file)


def _add_directions(document: Document, result: Practical) -> None:
    document.section("Directions")
    document.figure(
        figures.direction_widths(result.directions),
        "What is left of the prior's width in every direction, from the worst known to the best. At one the data said "
        "nothing.",
    )
    shown = min(SHOWN, len(result.directions))
    document.table(
        ["no.", "left", "verdict", "direction"],
        [
            [str(number), text.share(item.sd / item.prior_sd), item.verdict.value, words.partition(": ")[0]]
            for number, (item, words) in enumerate(
                zip(result.directions[:shown], result.words[:shown], strict=True), start=1
            )
        ],
        f"The {shown} worst known of {len(result.directions)} directions: what is left of the prior's width, and the "
        "largest parts of the displacement along which the data cannot tell.",
        ["right", "right", "left", "left"],
    )
    document.figure(
        figures.displacements(result.directions, result.knowledge.prior_sd),
        "Displacement of the parameters along the worst known directions by one posterior sd, in units of the "
        "parameter's prior sd. Parameters that none of these moves are left out.",
    )


def _add_parameters(document: Document, result: Practical) -> None:
    document.section("Parameters")
    document.items(text.confidence_sentences(result))
    header = ["parameter", "unit", "value ± sd", "prior sd", "learnt", "verdict", "confused with", "95 % profile"]
    rows = [_parameter_row(item) for item in result.parameters]
    align = ["left", "left", "right", "right", "right", "left", "left", "left"]
    kept = [column for column in range(len(header)) if any(row[column] for row in rows)]
    document.table(
        [header[column] for column in kept],
        [[row[column] for column in kept] for row in rows],
        "Parameters of the bodies to identify, in the axes of the link, inertias about the own centre of mass: value "
        "and sd of the normal approximation, prior sd, and shrinkage (one minus sd over prior sd); parameters with "
        "which the correlation is above 0.9 in size, and the profile interval where the posterior is not normal, if "
        "there are any.",
        [align[column] for column in kept],
    )


def _parameter_row(item: ParameterRow) -> list[str]:
    interval = "" if item.normal else "not evaluated"
    if item.profile is not None:
        ends = item.profile.to_dict()["95 %"]
        interval = " to ".join("beyond" if end is None else format_number(end, 3) for end in ends)
    body = item.name.partition(".")[0]
    confused = (f"{name.removeprefix(f'{body}.')} ({_signed(value)})" for name, value in item.correlated_with)
    return [
        item.name,
        format_unit(item.unit),
        format_quantity(item.mean, item.sd),
        format_number(item.prior_sd, 2),
        text.share(item.shrinkage),
        "prior only" if item.verdict is ContractionVerdict.NOT else item.verdict.value,
        ", ".join(confused),
        interval,
    ]


def _add_advice(document: Document, result: Practical) -> None:
    document.section("What would tell more")
    document.items(text.advice_sentences(result))
    worst = min(result.parameters, key=lambda item: item.shrinkage)
    numbers = [f"no. {number}" for number in range(1, WORST + 1)]
    now = [text.share(item.sd / item.prior_sd) for item in result.directions[:WORST]]
    now += [""] * (WORST - len(now))
    document.table(
        ["with", *numbers, f"sd of {worst.name}", "nats"],
        [
            ["nothing more (now)", *now, f"{format_number(worst.sd, 2)} {format_unit(worst.unit)}", "0.0"],
            *(text.advice_row(item, worst.unit) for item in result.advice),
        ],
        "What each candidate would leave of the prior's width in the presently worst directions, the standard "
        "deviation it would give to the presently worst known parameter, and the information on all parameters that "
        "it would add. Each is alone added to the study; pulses and swings to every recording.",
        ["left", *["right"] * (WORST + 2)],
    )


def _add_structure(document: Document, structure: BaseParameters) -> None:
    document.section("Structure of the robot")
    document.paragraph(
        "What follows holds for any motion and any sensors, and for known torques or actions. The standard parameters "
        "of a body are its mass, the first moment of mass (first.x, y, z) and the inertia about the origin of the "
        "link, in the link's axes. Not all can be told apart: the dependent ones act only in sums with others."
    )
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
    document.table(
        ["base parameter", "regrouped with dependent parameters"],
        rows,
        f"Base parameters that stand for sums. Coefficients are in m and m² of the geometry; the "
        f"{len(structure.dependent)} dependent parameters are {', '.join(structure.dependent)}.",
    )
    if alone:
        document.paragraph(f"These stand for themselves: {', '.join(alone)}.")


def _signed(value: float) -> str:
    return f"{value:+.2f}".replace("-", "−")


def _term(value: float, name: str) -> str:
    sign = "−" if value < 0.0 else "+"
    size = "" if abs(abs(value) - 1.0) < NEGLIGIBLE else f"{format_number(abs(value), 4)} "
    return f"{sign} {size}{name}"
