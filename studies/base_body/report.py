"""The study's report."""

from __future__ import annotations

from pathlib import Path

from bayesid.report import Document
from bayesid.report.numbers import format_fixed, format_number
from bayesid.simulation.sensors import Kind
from studies.base_body import paper, rows, texts
from studies.base_body.result import BaseBody
from studies.base_body.setting import limits_broken
from studies.common.ets7 import PERIOD, RAMP, extended_wrist
from studies.common.tables import add_number_table

__all__ = ["write"]


def write(result: BaseBody, output: Path) -> None:
    """Write the report as PDF; this uses up the figures of the result."""
    document = Document(
        "Base body of ETS-VII", "Section 4.1 of Lampariello and Hirzinger (IDETC 2005), beside the paper"
    )
    document.section("Questions and answers")
    document.table(["question", "answer"], rows.goal_rows(result))
    _assumptions(document, result)
    _noise_free(document, result)
    _sampled(document, result)
    document.section("Sensor grades of section 4.3")
    document.paragraph(texts.GRADES)
    caption = "Relative standard deviations of the mass / of the worst moment of inertia."
    document.table(*rows.grade_table(result), caption=caption)
    document.figure(
        result.figures["grades"],
        "Width of the posterior against the accelerometer's grade, which improves to the right.",
    )
    document.section("Sigma 0.04 and 0.009")
    document.paragraph(texts.READINGS)
    caption = (
        "What each unit would mean: relative standard deviations from one manoeuvre at 2 Hz, without prior and with an "
        "exact arm."
    )
    add_number_table(document, *rows.reading_table(result), caption)
    document.items(rows.reading_sentences(result))
    document.section("How well the arm is known")
    document.paragraph(texts.ARM.format(ratio=format_number(result.arm_ratio, 2)))
    add_number_table(document, *rows.arm_table(result), "Relative standard deviations [%].")
    document.paragraph(texts.ARM_FLOOR)
    if result.slow is not None:
        rate = format_number(1e3 * result.slow.peak[Kind.RATE], 2)
        document.paragraph(texts.SLOW.format(slow=format_fixed(result.slowness, 1), rate=rate))
    document.write(output)


def _assumptions(document: Document, result: BaseBody) -> None:
    document.section("Assumptions where the paper is silent")
    values = {
        "limits": "; ".join(
            f"joint {joint} moves from {format_number(low)} to {format_number(high)} rad"
            for joint, low, high in limits_broken()
        ),
        "wrist": ", ".join(format_number(value) for value in extended_wrist()),
        "period": f"{PERIOD:g}",
        "ramp": f"{RAMP:g}",
        "slow": format_fixed(result.slowness, 1),
        **{kind.value: format_number(value, 2) for kind, value in result.fast.peak.items()},
    }
    document.items([text.format(**values) for text in texts.ASSUMPTIONS])
    document.figure(
        result.figures["motion"],
        "The paper's figure 4 with the assumptions of this study: motion of the base in its axes, relative to inertial "
        "space; at the top right the rate along the poorly exciting manoeuvre, in the same scale.",
    )


def _noise_free(document: Document, result: BaseBody) -> None:
    document.section("Without noise and without prior")
    document.paragraph(texts.NOISE_FREE)
    for name, title, printed in (("well", "Well", paper.RESULT_WELL), ("poor", "Poorly", paper.RESULT_POOR)):
        table = rows.printed_table(result.noise_free[name], printed)
        add_number_table(document, *table, f"{title} exciting manoeuvre.")
    document.paragraph(texts.POOR.format(**rows.poor_numbers(result)))
    document.figure(
        result.figures["errors"], "Relative errors without noise. The paper's are those of its printed digits."
    )
    caption = "Largest relative error in each group, and root mean square residual over 10⁻⁵ rad/s and 10⁻⁵ m/s²."
    add_number_table(document, *rows.case_table(result), caption)
    document.paragraph(texts.GRADIENT.format(**rows.gradient_numbers(result)))


def _sampled(document: Document, result: BaseBody) -> None:
    document.section("The posterior with realistic sensors")
    if not result.sampled:
        document.paragraph("This is not evaluated: only the full study samples the posterior.")
        return
    document.paragraph(texts.SAMPLED)
    add_number_table(document, *rows.posterior_table(result), "Posterior mean and standard deviation.")
    document.items(rows.sampler_sentences(result))
    document.figure(
        result.figures["posterior"], "Posterior mean and standard deviation beside the results that the paper printed."
    )
    document.figure(result.figures["corner"], "Joint posterior of the base with an exactly known arm.")
