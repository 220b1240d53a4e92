"""The report on what can be identified, by the structure of the robot and by a study's manoeuvres and sensors."""

from __future__ import annotations

from pathlib import Path

from bayesid.identifiability.advice import WORST
from bayesid.identifiability.base_parameters import BaseParameters
from bayesid.identifiability.practical_identifiability import Practical
from bayesid.inference.predicted_readings import integration_error_at
from bayesid.report import figures
from bayesid.report.document import Document
from bayesid.report.identification_report import add_joints
from bayesid.report.sentences import identifiability_sentences as sentences
from bayesid.report.sentences.model_assumptions import model_sentences
from bayesid.report.tables import identifiability_tables as tables

__all__ = ["identifiability_report"]

SHOWN = 20
"""Largest number of directions in the table, from the worst known."""


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
    document.paragraph(sentences.structure_sentence(structure))
    document.paragraph(statement)
    if result is not None:
        document.items([*sentences.practical_sentences(result), *sentences.advice_sentences(result)])
        _add_directions(document, result)
        _add_parameters(document, result)
        _add_advice(document, result)
    _add_structure(document, structure)
    if result is not None:
        document.section("Method and assumptions")
        error = integration_error_at(result.posterior, result.optimum.z)
        document.items([*sentences.method_sentences(result), *model_sentences(result.posterior, error)])
        add_joints(document, result.posterior)
    document.write(file)


def _add_directions(document: Document, result: Practical) -> None:
    document.section("Directions")
    document.figure(
        figures.direction_widths(result.directions),
        "Share of the prior's width that is left in every direction, from the worst known to the best. At one the data "
        "said nothing.",
    )
    shown = min(SHOWN, len(result.directions))
    document.table(
        ["no.", "left", "verdict", "direction"],
        tables.direction_rows(result, shown),
        f"The {shown} worst known of {len(result.directions)} directions: the share of the prior's width that is left, "
        "and the largest parts of the displacement that the data cannot resolve.",
        ["right", "right", "left", "left"],
    )
    document.figure(
        figures.displacements(result.directions, result.knowledge.prior_sd),
        "Displacement of the parameters along the worst known directions by one posterior sd, in units of the "
        "parameter's prior sd. Parameters that none of these moves are left out.",
    )


def _add_parameters(document: Document, result: Practical) -> None:
    document.section("Parameters")
    document.items(sentences.confidence_sentences(result))
    header = ["parameter", "unit", "value ± sd", "prior sd", "learnt", "verdict", "confused with", "95 % profile"]
    rows = tables.parameter_rows(result)
    align = ["left", "left", "right", "right", "right", "left", "left", "left"]
    kept = [column for column in range(len(header)) if any(row[column] for row in rows)]
    document.table(
        [header[column] for column in kept],
        [[row[column] for column in kept] for row in rows],
        "Parameters of the bodies to identify, in the axes of the link, inertias about the body's centre of mass: "
        "value and sd of the normal approximation, prior sd, and learnt, which is one minus sd over prior sd; if there "
        "are any, parameters with which the correlation is above 0.9 in size, and the profile interval where the "
        "posterior is not normal.",
        [align[column] for column in kept],
    )


def _add_advice(document: Document, result: Practical) -> None:
    document.section("Recommended measurements")
    document.items(sentences.advice_sentences(result))
    worst = min(result.parameters, key=lambda item: item.shrinkage)
    numbers = [f"no. {number}" for number in range(1, WORST + 1)]
    document.table(
        ["with", *numbers, f"sd of {worst.name}", "nats"],
        tables.advice_rows(result, worst),
        "Candidates to add to the study, each alone, pulses and swings to every recording: the share of the prior's "
        "width that each would leave in the presently worst directions, the standard deviation it would give to the "
        "presently worst known parameter, and the information on all parameters that it would add.",
        ["left", *["right"] * (WORST + 2)],
    )


def _add_structure(document: Document, structure: BaseParameters) -> None:
    document.section("Structure of the robot")
    document.paragraph(
        "This section holds for any motion and any sensors, and for known torques or actions. The standard parameters "
        "of a body are its mass, the first moment of mass (first.x, y, z) and the inertia about the origin of the "
        "link, in the link's axes. Not all can be told apart: the dependent ones act only in sums with others."
    )
    rows, alone = tables.regrouping_rows(structure)
    document.table(
        ["base parameter", "regrouped with dependent parameters"],
        rows,
        f"Base parameters that stand for sums. Coefficients follow from the geometry [m, m²]; the "
        f"{len(structure.dependent)} dependent parameters are {', '.join(structure.dependent)}.",
    )
    if alone:
        document.paragraph(f"These stand for themselves: {', '.join(alone)}.")
