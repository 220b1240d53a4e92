"""The evidence in a diagnosis' report: residuals, candidates, hypotheses, causes, disturbance."""

from __future__ import annotations

from bayesid.diagnosis import Diagnosis, Frame, Status, Unexplained
from bayesid.diagnosis.test_suite import FALSE_ALARM
from bayesid.report import diagnosis_tables as rows
from bayesid.report import diagnosis_text as text
from bayesid.report import figures
from bayesid.report.diagnosis_advice import moves_with
from bayesid.report.document import Document
from bayesid.report.residual_series import Residuals

__all__ = ["add_candidates", "add_causes", "add_disturbance", "add_hypotheses", "add_residuals"]

CANDIDATES = 15
"""Rows of the table of candidates."""

BARS = 20
"""Bars of the figure of candidates."""

HYPOTHESES = 12

RECORDINGS = 6
"""Recordings whose residuals are drawn over time."""


def _sides(result: Diagnosis) -> list[Residuals]:
    sides = [Residuals.of(result.before)]
    return [*sides, Residuals.of(result.after)] if result.verdict.causes else sides


def add_residuals(document: Document, result: Diagnosis) -> None:
    """Show what the simulation leaves over time and by frequency, before and after."""
    sides = _sides(result)
    document.section("What the simulation leaves")
    document.paragraph(
        "Residuals are in units of their noise σ and freed of their correlation, so that a right model leaves "
        "independent values of standard deviation one. "
        + ("Before: the present model. After: with the named causes, all unknowns fitted again. " if sides[1:] else "")
        + "The grey band of the histories is ± 2 σ; the line is a running mean over a fortieth of the recording."
    )
    names = [manoeuvre.recording.name for manoeuvre in result.before.fit.posterior.manoeuvres]
    for index, name in enumerate(names[:RECORDINGS]):
        document.figure(figures.residual_histories(sides, index), f"Residuals in {name}, sensor axes.")
    if len(names) > RECORDINGS:
        document.paragraph(f"Of {len(names)} recordings the first {RECORDINGS} are drawn.")
    document.figure(
        figures.residual_spectra(sides),
        "Spectra of the residuals, all recordings pooled, frequencies gathered in bins of equal width: white noise has "
        "level one. The lowest bins hold what a disturbance or a wrong body leaves.",
    )


def add_candidates(document: Document, result: Diagnosis) -> None:
    """Rank the candidates."""
    document.section("Candidates")
    document.paragraph(
        "Each candidate is taken alone, on top of the present model. Refitted: the candidate and all unknowns of the "
        "model were fitted together; linear: the figures come from the response at the present fit, which is enough "
        "where the candidate does little. The signal-to-noise ratio is the root of what chi-square loses, less the "
        "candidate's degrees of freedom. The p-value is adjusted for the number of tests. The Bayes factor is against "
        "the present model, natural logarithm. Power is the probability that a candidate drawn from its prior "
        "would have raised the alarm. Sizes are given where they are seen, and otherwise the magnitudes that "
        "they stay below with 95 %."
    )
    ranked = sorted(result.candidates, key=lambda row: (-row.signal_to_noise, -(row.log_bayes_factor or 0.0)))
    drawn = ranked[:BARS]
    document.figure(
        figures.candidate_strengths(drawn, result.verdict.causes, FALSE_ALARM),
        f"Signal-to-noise ratio of the {len(drawn)} strongest of {len(ranked)} candidates, each alone. Several can "
        "stand out for one cause, since they explain parts of the same residual.",
    )
    document.table(
        ["candidate", "signal to noise", "p, adjusted", "log Bayes factor", "size, or 95 % limit", "power", "from"],
        rows.candidate_rows(ranked[:CANDIDATES], FALSE_ALARM),
        f"The {min(CANDIDATES, len(ranked))} strongest of {len(ranked)} candidates; of many quantities those "
        "furthest from zero. An empty cell is a figure that was not evaluated. All are in diagnosis.json.",
        ["left", "right", "right", "right", "left", "right", "left"],
    )


def add_hypotheses(document: Document, result: Diagnosis) -> None:
    """Table the hypotheses that were fitted."""
    tried = result.search.tried
    document.section("Hypotheses tried")
    if len(tried) == 1:
        document.paragraph("The present model passes every test; no other hypothesis was fitted.")
        return
    document.paragraph(
        "Sets of causes fitted together with all unknowns, and put to the same tests as the present model. A set is "
        "adequate if what it leaves raises no alarm. The Bayes factor counts against a set that it has more freedom."
    )
    shown = [tried[0], *tried[1:HYPOTHESES]]
    if result.after not in shown:
        shown[-1] = result.after
    document.table(
        [
            "causes",
            "log Bayes factor",
            "chi-square per sample",
            "p of what is left",
            "most significant test",
            "adequate",
        ],
        rows.hypothesis_rows(shown, result.before),
        f"The most probable of {len(tried)} hypotheses.",
        ["left", "right", "right", "right", "left", "left"],
    )


def add_causes(document: Document, result: Diagnosis) -> None:
    """Table the size of the named causes with their priors."""
    document.section("The named causes")
    if table := rows.cause_rows(result):
        document.table(
            ["quantity", "unit", "prior", "value ± sd", "from zero"],
            table,
            "Size of the named causes, fitted together with all unknowns. Priors are mean ± standard deviation, or a "
            "range that holds 68 %, and were set before any data were seen. Changes of a link are in the link's axes, "
            "its inertia about its own centre of mass; all other vectors are in base or sensor axes.",
            ["left", "left", "right", "right", "right"],
        )
    else:
        document.paragraph("The named causes have no free parameter: their size is physics.")


def _may_be_disturbance(result: Diagnosis) -> bool:
    """Whether a named cause acts on the motion, or is blamed on noise, behind which a disturbance could hide."""
    hooks = ("wrench", "momentum", "table", "modes")
    return bool(result.after.faults) or any(effect.uses(hook) for effect in result.after.fit.effects for hook in hooks)


def add_disturbance(document: Document, result: Diagnosis) -> None:
    """Show the torque and force that the residual would take; nothing where only readings are at fault."""
    if result.verdict.status is Status.ADEQUATE or (result.verdict.causes and not _may_be_disturbance(result)):
        return
    named = bool(result.verdict.causes)
    wrench = result.verdict.disturbance if named else result.unexplained
    document.section("The disturbance, reconstructed")
    document.paragraph(
        ("Without the named causes, the residual would take this disturbance of the base" if named else "The residual")
        + (": " if named else " as a disturbance of the base: ")
        + "torque about and force through the common centre of mass, any smooth course in time, its size learnt from "
        "the data. Bands are ± 1 standard deviation. What the model's unknowns can take on is not in it."
    )
    document.paragraph(text.wrench_sentence(wrench))
    if wrench.signal_to_noise == 0.0:
        return
    _add_wrench(document, result, wrench, not named)
    if named:
        document.paragraph(f"What the named causes leave. {text.wrench_sentence(result.unexplained)}")


def _add_wrench(document: Document, result: Diagnosis, wrench: Unexplained, whole: bool) -> None:
    axes = {Frame.BASE: "base", Frame.ORBIT: "orbit (zenith, along-track, normal)", Frame.INERTIAL: "inertial"}
    in_orbit = result.before.fit.posterior.model.orbit is not None
    for frame, name in axes.items():
        if frame is Frame.BASE or (whole and (in_orbit or frame is Frame.INERTIAL)):
            document.figure(figures.wrench_histories(wrench, frame), f"Reconstructed torque and force, {name} axes.")
    if whole:
        document.figure(
            figures.wrench_spectrum(wrench),
            "Amplitude of the reconstructed torque by frequency, base axes. Above the range drawn it is not resolved.",
        )
    if moving := moves_with(wrench, result.before):
        document.table(
            ["component, base axes", "moves with", "correlation"],
            [[axis, name, f"{value:+.2f}".replace("-", "−")] for axis, name, value in moving],
            "What the reconstructed torque moves with: the largest correlations, all recordings pooled. The series are "
            "smooth, so that a correlation of half can be chance.",
            ["left", "left", "right"],
        )
