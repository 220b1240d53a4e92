"""Sections of a diagnosis report that hold its evidence: residuals, candidates, hypotheses, causes, disturbance."""

from __future__ import annotations

from bayesid.diagnosis import Diagnosis, Frame, Hypothesis, Status, Unexplained
from bayesid.diagnosis.test_suite import FALSE_ALARM
from bayesid.diagnosis.wrench_correlations import torque_correlations
from bayesid.inference.residual_series import Residuals
from bayesid.report import figures
from bayesid.report.document import Document
from bayesid.report.sentences.diagnosis_sentences import wrench_sentence
from bayesid.report.tables import diagnosis_tables as tables

__all__ = ["add_candidates", "add_causes", "add_disturbance", "add_hypotheses", "add_residuals"]

CANDIDATES = 15
"""Largest number of rows of the table of candidates."""

BARS = 20
"""Largest number of bars of the figure of candidates."""

HYPOTHESES = 12
"""Largest number of rows of the table of hypotheses."""

RECORDINGS = 6
"""Largest number of recordings whose residuals are drawn over time."""

AXES = {Frame.BASE: "base", Frame.ORBIT: "orbit (zenith, along-track, normal)", Frame.INERTIAL: "inertial"}
"""Names of the axes in which a disturbance is drawn."""


def add_residuals(document: Document, result: Diagnosis) -> None:
    """Add the residuals over time and by frequency, before and after."""
    sides = [_residuals(result.before)]
    if result.verdict.causes:
        sides.append(_residuals(result.after))
    document.section("Residuals of the simulation")
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


def _residuals(hypothesis: Hypothesis) -> Residuals:
    """Return the residuals of a hypothesis at its mode."""
    posterior = hypothesis.fit.posterior
    return Residuals(posterior, hypothesis.fit.residual.reshape(posterior.residual_shape))


def add_candidates(document: Document, result: Diagnosis) -> None:
    """Add the candidates, ranked by their signal-to-noise ratio."""
    document.section("Candidates")
    document.paragraph(
        "Each candidate is taken alone, in addition to the present model. Refitted: the candidate and all unknowns of "
        "the model were fitted together; linear: the numbers come from the response at the present fit, which is "
        "enough where the candidate has little effect. The signal-to-noise ratio is the root of the decrease of "
        "chi-square, less the candidate's degrees of freedom. The p-value is adjusted for the number of tests. The "
        "Bayes factor is that over the present model, as a natural logarithm. Power is the probability that a "
        "candidate drawn from its prior would have raised the alarm. Sizes are given of candidates that "
        "are seen; of the others, the magnitudes that they stay below with 95 %."
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
        tables.candidate_rows(ranked[:CANDIDATES], FALSE_ALARM),
        f"The {min(CANDIDATES, len(ranked))} strongest of {len(ranked)} candidates; of many quantities, those furthest "
        "from zero. A cell is empty where the number was not evaluated. All candidates are in diagnosis.json.",
        ["left", "right", "right", "right", "left", "right", "left"],
    )


def add_hypotheses(document: Document, result: Diagnosis) -> None:
    """Add the hypotheses that were fitted."""
    tried = result.search.tried
    document.section("Hypotheses tried")
    if len(tried) == 1:
        document.paragraph("The present model passes every test; no other hypothesis was fitted.")
        return
    document.paragraph(
        "Each hypothesis is a set of causes fitted together with all unknowns, and put to the same tests as the "
        "present model. It is adequate if its residual raises no alarm. The Bayes factor penalises the freedom that it "
        "adds."
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
        tables.hypothesis_rows(shown, result.before),
        f"The most probable of {len(tried)} hypotheses.",
        ["left", "right", "right", "right", "left", "left"],
    )


def add_causes(document: Document, result: Diagnosis) -> None:
    """Add the sizes of the named causes with their priors."""
    document.section("The named causes")
    if rows := tables.cause_rows(result):
        document.table(
            ["quantity", "unit", "prior", "value ± sd", "from zero"],
            rows,
            "Size of the named causes, fitted together with all unknowns. Priors are mean ± standard deviation, or a "
            "range that holds 68 %, and were set before any data were seen. Changes of a link are in the link's axes, "
            "with its inertia about its centre of mass; all other vectors are in base or sensor axes.",
            ["left", "left", "right", "right", "right"],
        )
    else:
        document.paragraph("The named causes have no free parameter: physics fixes their size.")


def add_disturbance(document: Document, result: Diagnosis) -> None:
    """Add the torque and force that would explain the residual; nothing where only readings are at fault."""
    if result.verdict.status is Status.ADEQUATE or (result.verdict.causes and not _may_be_disturbance(result)):
        return
    named = bool(result.verdict.causes)
    wrench = result.verdict.disturbance if named else result.unexplained
    document.section("The disturbance, reconstructed")
    document.paragraph(
        f"This disturbance of the base would explain the residual{' without the named causes' if named else ''}: "
        "torque about and force through the common centre of mass, smooth in time, with a size estimated from the "
        "data. Bands are ± 1 standard deviation. The part that the model's unknowns can explain is not in it."
    )
    document.paragraph(wrench_sentence(wrench))
    if wrench.signal_to_noise == 0.0:
        return
    _add_wrench(document, result, wrench, not named)
    if named:
        document.paragraph(f"What the named causes leave. {wrench_sentence(result.unexplained)}")


def _may_be_disturbance(result: Diagnosis) -> bool:
    """Return whether a named cause acts on the motion, or is a fault of the noise that could hide a disturbance."""
    hooks = ("wrench", "momentum", "table", "modes")
    return bool(result.after.faults) or any(effect.uses(hook) for effect in result.after.fit.effects for hook in hooks)


def _add_wrench(document: Document, result: Diagnosis, wrench: Unexplained, whole: bool) -> None:
    """Add the figures of a wrench and the table of its correlations; the whole of it in further axes too."""
    in_orbit = result.before.fit.posterior.model.orbit is not None
    for frame, name in AXES.items():
        if frame is Frame.BASE or (whole and (in_orbit or frame is Frame.INERTIAL)):
            document.figure(figures.wrench_histories(wrench, frame), f"Reconstructed torque and force, {name} axes.")
    if whole:
        document.figure(
            figures.wrench_spectrum(wrench),
            "Amplitude of the reconstructed torque by frequency, base axes, up to the frequency that is resolved.",
        )
    if rows := tables.correlation_rows(torque_correlations(wrench, result.before)):
        document.table(
            ["component, base axes", "moves with", "correlation"],
            rows,
            "Largest correlations of the reconstructed torque with known series, all recordings pooled. The series are "
            "smooth, so that a correlation of one half can be chance.",
            ["left", "left", "right"],
        )
