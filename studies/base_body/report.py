"""The study's report."""

from __future__ import annotations

from pathlib import Path

from bayesid.report import Document
from bayesid.report.numbers import format_number
from bayesid.simulation.sensors import Kind
from studies.base_body import paper, rows
from studies.base_body.result import BaseBody
from studies.base_body.setting import limits_broken
from studies.base_body.texts import ARM, ASSUMED, GRADES, NOISE, READINGS, SAMPLED
from studies.common.ets7 import PERIOD, RAMP, extended_wrist

__all__ = ["write"]


def write(result: BaseBody, output: Path) -> None:
    """Write the report as PDF; draws on the figures of the result, which it uses up."""
    document = Document(
        "Base body of ETS-VII", "Section 4.1 of Lampariello and Hirzinger (IDETC 2005), beside the paper"
    )
    _goals(document, result)
    _assumed(document, result)
    _noise_free(document, result)
    _sampled(document, result)
    _grades(document, result)
    _readings(document, result)
    _arm(document, result)
    document.write(output)


def _goals(document: Document, result: BaseBody) -> None:
    document.section("What was asked, and what came out")
    document.table(["question", "answer"], rows.goal_rows(result))


def _assumed(document: Document, result: BaseBody) -> None:
    document.section("Assumed where the paper is silent")
    limits = "; ".join(
        f"joint {joint} from {format_number(low)} to {format_number(high)} rad" for joint, low, high in limits_broken()
    )
    wrist = ", ".join(format_number(value) for value in extended_wrist())
    peak = result.fast.peak
    values = {
        "limits": limits,
        "wrist": wrist,
        "period": f"{PERIOD:g}",
        "ramp": f"{RAMP:g}",
        "slow": f"{result.slowness:.1f}",
    }
    kinds = {kind.value: format_number(value, 2) for kind, value in peak.items()}
    document.items([text.format(**values, **kinds) for text in ASSUMED])
    document.figure(
        result.figures["motion"],
        "The paper's figure 4 with the assumptions made here: motion of the base in its own axes, relative to inertial "
        "space. Beside it the poor manoeuvre, in the same scale.",
    )


def _noise_free(document: Document, result: BaseBody) -> None:
    document.section("Without noise and without prior")
    document.paragraph(NOISE[0])
    well, poor = result.noise_free["well"], result.noise_free["poor"]
    document.table(*rows.printed_table(well, paper.RESULT_WELL), caption="Well exciting manoeuvre.", align=rows.PRINTED)
    document.table(
        *rows.printed_table(poor, paper.RESULT_POOR), caption="Poorly exciting manoeuvre.", align=rows.PRINTED
    )
    document.paragraph(
        NOISE[1].format(peak=", ".join(f"{1e3 * value:.2f}" for value in poor.peak), **rows.widths(result))
    )
    document.figure(
        result.figures["errors"], "Relative errors without noise. The paper's are those of its printed digits."
    )
    document.table(*rows.case_table(result), caption=NOISE[2], align=rows.CASES)
    document.paragraph(NOISE[3].format(**rows.blindness(result)))


def _sampled(document: Document, result: BaseBody) -> None:
    document.section("The posterior with realistic sensors")
    if not result.sampled:
        document.paragraph("Not evaluated: only the full study samples the posterior.")
        return
    document.paragraph(SAMPLED)
    document.table(
        *rows.posterior_table(result), caption="Posterior mean and standard deviation.", align=rows.POSTERIOR
    )
    document.items(rows.sampler_sentences(result))
    document.figure(
        result.figures["posterior"], "Posterior mean and standard deviation beside the results that the paper printed."
    )
    document.figure(result.figures["corner"], "Joint posterior of the base with an exactly known arm.")


def _grades(document: Document, result: BaseBody) -> None:
    document.section("Sensor grades of section 4.3")
    document.paragraph(GRADES)
    document.table(
        *rows.grade_table(result), caption="Relative standard deviation of mass / of the worst principal moment."
    )
    document.figure(
        result.figures["grades"], "Width of the posterior against the accelerometer's grade; better to the right."
    )


def _readings(document: Document, result: BaseBody) -> None:
    document.section("Sigma 0.04 and 0.009")
    document.paragraph(READINGS[0])
    document.table(*rows.reading_table(result), caption=READINGS[1], align=rows.READINGS)
    document.items(rows.reading_sentences(result))


def _arm(document: Document, result: BaseBody) -> None:
    document.section("How well the arm is known")
    document.paragraph(ARM[0].format(ratio=format_number(result.arm_ratio, 2)))
    document.table(*rows.arm_table(result), caption="Relative standard deviation [%].")
    document.paragraph(ARM[1])
    if result.slow is not None:
        document.paragraph(
            ARM[2].format(slow=f"{result.slowness:.1f}", rate=format_number(1e3 * result.slow.peak[Kind.RATE], 2))
        )
