"""Figures and report of the study."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from bayesid.report.document import Document
from studies.throws.analysis import Analysis, BodyResult
from studies.throws.bodies import BLOCK_SD, PLATE_SD
from studies.throws.data import WHEEL_INERTIA

if TYPE_CHECKING:
    from studies.throws import Result

__all__ = ["draw_figures", "write_report"]

COLOURS = {"plain": "#b2182b", "extended": "#2166ac"}
LEVELS = np.linspace(0.02, 0.99, 60)
QUICK_GOALS = {"Empty": 1.9, "A": 1.0}
"""Mean errors of a quick least-squares fit by those who prepared the data [%]."""


def draw_figures(plain: Analysis, extended: Analysis) -> dict[str, Figure]:
    """Draw the single throws, the calibration of their posteriors, and the unexplained torque."""
    return {
        "throws": _draw_throws(plain, extended),
        "calibration": _draw_calibration(plain, extended),
        "torque": _draw_torque(extended),
    }


def _draw_throws(plain: Analysis, extended: Analysis) -> Figure:
    figure = Figure(figsize=(7.2, 4.2), layout="constrained")
    axes = figure.subplots(2, 2, sharey="row")
    for row, body in zip(axes, ("Empty", "A"), strict=True):
        for axis, analysis in zip(row, (plain, extended), strict=True):
            result = analysis.bodies[body]
            axis.axhspan(
                -_percent(result.truth_sd, result).max(), _percent(result.truth_sd, result).max(), color="0.92"
            )
            axis.axhline(0.0, color="0.4", linewidth=0.8)
            for index, (marker, name) in enumerate(zip("os^", ("smallest", "middle", "largest"), strict=True)):
                place = np.arange(len(result.throws)) + 0.2 * (index - 1)
                axis.errorbar(
                    place,
                    result.errors[:, index],
                    100.0 * result.formal[:, index] / result.truth[index],
                    fmt=marker,
                    markersize=4,
                    linewidth=1,
                    color=f"C{index}",
                    label=name,
                )
            axis.set_xticks(np.arange(len(result.throws)), [name[-3:] for name in result.throws], fontsize=7)
            axis.set_title(f"{body}, {analysis.label} model", fontsize=9)
        row[0].set_ylabel("error of the moment [%]")
    axes[1, 0].set_xlabel("throw")
    axes[1, 1].set_xlabel("throw")
    axes[0, 1].legend(fontsize=7, title="principal moment", title_fontsize=7)
    return figure


def _draw_calibration(plain: Analysis, extended: Analysis) -> Figure:
    figure = Figure(figsize=(7.2, 2.9), layout="constrained")
    axes = figure.subplots(1, 2, sharey=True)
    for axis, body in zip(axes, ("Empty", "A"), strict=True):
        axis.plot([0, 1], [0, 1], color="0.4", linewidth=0.8, label="calibrated")
        for analysis in (plain, extended):
            result, colour = analysis.bodies[body], COLOURS[analysis.label]
            for with_truth, style in ((False, "-"), (True, "--")):
                held = [result.coverage(level, with_truth=with_truth) for level in LEVELS]
                note = ", truth's sd added" if with_truth else ""
                axis.plot(LEVELS, held, style, color=colour, label=f"{analysis.label}{note}")
        axis.set_title(body, fontsize=9)
        axis.set_xlabel("credible level")
    axes[0].set_ylabel("share of intervals that hold the truth")
    axes[1].legend(fontsize=7)
    return figure


def _draw_torque(extended: Analysis) -> Figure:
    figure = Figure(figsize=(7.2, 2.6), layout="constrained")
    axis = figure.subplots()
    for body, torque in extended.torque.items():
        axis.plot(extended.torque_time, 1e3 * torque, label=body)
    axis.set_xlabel("time since the first sample [s]")
    axis.set_ylabel("unexplained torque [mN m]")
    axis.legend(fontsize=7)
    return figure


def write_report(result: Result, path: Path) -> None:
    """Write the report."""
    document = Document("Thrown bodies", "Real measurements of a small free-flying device with one reaction wheel")
    _write_summary(document, result)
    _write_model(document, result.extended)
    _write_plain(document, result)
    _write_extended(document, result)
    _write_budget(document, result)
    _write_sampled(document, result)
    document.write(path)


def _write_summary(document: Document, result: Result) -> None:
    empty, a = (result.extended.bodies[body] for body in ("Empty", "A"))
    scope = "all throws" if result.full else f"a quick run on the first {len(a.throws)} throws of each body"
    document.paragraph(
        "A hand-sized device with gyro, accelerometer and one reaction wheel was thrown alone, on a known box, "
        f"on a grid plate (Empty) and on the plate with four steel blocks (A). This report covers {scope}: the "
        "wheel is calibrated from the known box, the bodies are identified from single throws and jointly, and "
        "both are compared with their geometry. Data: Blaha, Kuijper, Pop and Smeur, arXiv:2503.13137. None of "
        "them is reproduced here."
    )
    items = [
        f"{body.name}: mean error of the principal moments over single throws {body.mean_error:.2f} %, largest "
        f"{body.largest_error:.1f} % (a quick least-squares fit: {QUICK_GOALS[body.name]:.1f} % on all throws); "
        f"joint fit {_signed(body.joint_errors)} %, with {_list(_percent(body.joint_jackknife, body))} % from the "
        f"scatter of throws and {_list(_percent(body.truth_sd, body))} % uncertainty of the truth itself."
        for body in (empty, a)
    ]
    plain = result.plain.bodies
    items += [
        f"Wheel inertia ({1e6 * result.extended.wheel:.4f} ± {1e6 * result.extended.wheel_jackknife:.4f}) mg m2, "
        "jackknife over throws.",
        "A rigid body in vacuum is wrong here. Its single-throw standard deviations are too small by a factor of "
        f"{plain['Empty'].inflation:.0f} (Empty) and {plain['A'].inflation:.0f} (A), judged by the scatter of "
        f"throws alone; with the extended model the factors are {empty.inflation:.1f} and {a.inflation:.1f}.",
        "The settings of the extended model were found on these same throws, with an eye on the truth: the "
        "errors above are not those of a blind test. Section 3 says how far other reasonable settings move them.",
    ]
    document.items(items)


def _write_model(document: Document, extended: Analysis) -> None:
    document.section("Model and method")
    document.paragraph(
        "With the angular momentum L about the centre of mass, the body with the wheel locked I, and the wheel's "
        "recorded speed s along its axis a, in body axes:"
    )
    document.formula(
        'dot(L) = L times omega - "diag"(d) omega + T(t), quad omega = I^(-1) (L - J s a), '
        'quad a = (mu_x, mu_y, 1), quad "gyro" = (1 + S) omega'
    )
    document.paragraph(
        "The plain model sets drag d, torque T, tilt and cross-axis terms S to zero. The extended one estimates "
        "them: S and the tilt once for the device, d once per body, T in every throw as a piecewise linear "
        "function with 16 knots, 32 ms apart, whose values are a priori normal with 50 (device), 70 (box), 200 "
        "(Empty) and 100 (A) wheel inertias per s2. The prior widths are 20 wheel inertias per s for d, 0.01 for "
        "S and 0.05 rad for the tilt. They are the user's own effects, written in the study. Gyro scale factors "
        "stay one: they cannot be told from the wheel's inertia here."
    )
    document.paragraph(
        f"Every inertia is relative to the wheel's. The fits use a nominal J of {1e6 * WHEEL_INERTIA:.2f} mg m2; "
        "the box, whose inertia follows from its edges and mass, then gives J and all results are scaled. The "
        "device is taken off with the parallel-axis theorem; its place relative to the centre of mass comes from "
        "the accelerometer in the same posterior (reading (dω/dt × + ω × ω ×) r plus a constant per throw with a "
        "prior of 0.1 m/s2). Masses are as weighed."
    )
    document.paragraph(
        "Gyro and accelerometer are smoothed with a zero-phase Gaussian of 2 ms, and the wheel's momentum alike; "
        "one sample in 2 ms is kept. The reported wheel speed is a held average: only the instants of change are "
        "used, shifted by -0.64 ms plus 0.40 electrical periods. What remains unknown of that delay matters "
        "while the wheel accelerates: gyro samples within 4 ms of a wheel acceleration above 12000 rad/s2 are "
        "left out, because the noise of a sensor is constant in a recording. Declared noise is 7 mrad/s per gyro "
        "sample (about the wheel's axis plus 1.5 rad/s of wheel speed seen through the inertia) and 0.2 m/s2; it "
        "stands for errors that are not white, so that chi-square per sample is below one where the fit is good."
    )
    document.paragraph(
        "Each throw has its posterior; the joint mode and Laplace approximation eliminate the unknowns of single "
        "throws from the normal equations of all (exact Gauss-Newton, every shared prior counted once). "
        "Single-throw fits hold the device, its calibration and the drag at their joint values. Where scatter is "
        "quoted, a jackknife takes out whole throws, calibration throws included."
    )
    calibration = [(name, f"{1e3 * mean:.2f}", f"{1e3 * sd:.2f}") for name, (mean, sd) in extended.calibration.items()]
    document.table(
        ("calibration of the device", "mean [0.001]", "formal sd"),
        calibration,
        "Cross-axis terms (1) and wheel tilt (rad).",
        ["left", "right", "right"],
    )


def _write_plain(document: Document, result: Result) -> None:
    document.section("A rigid body with a wheel and nothing else")
    plain = result.plain
    empty, a = plain.bodies["Empty"], plain.bodies["A"]
    document.paragraph(
        f"With white noise only, the plain model misses the gyro by {np.sqrt(plain.chi2['Empty'][0]):.0f} (Empty) "
        f"and {np.sqrt(plain.chi2['A'][0]):.0f} (A) declared standard deviations, root mean square. Its moments "
        f"are off by {empty.mean_error:.1f} and {a.mean_error:.1f} % on average, and its formal uncertainties, "
        f"{_percent(empty.formal, empty).mean():.2f} and {_percent(a.formal, a).mean():.2f} %, would have to be "
        f"{empty.inflation:.0f} and {a.inflation:.0f} times larger to cover how throws differ from each other. Of "
        f"its 95 % intervals {100 * empty.coverage(0.95):.0f} and {100 * a.coverage(0.95):.0f} % hold the truth."
    )
    _table(document, plain, "Plain model.")


def _write_extended(document: Document, result: Result) -> None:
    document.section("With drag, torque, tilt and cross-axis terms")
    extended = result.extended
    _table(document, extended, "Extended model.")
    empty, a = extended.bodies["Empty"], extended.bodies["A"]
    document.paragraph(
        f"The formal uncertainties of single throws are still too small by {empty.inflation:.2f} (Empty) and "
        f"{a.inflation:.2f} (A). Of the 95 % intervals {100 * empty.coverage(0.95):.0f} and "
        f"{100 * a.coverage(0.95):.0f} % hold the truth, and {100 * empty.coverage(0.95, with_truth=True):.0f} "
        f"and {100 * a.coverage(0.95, with_truth=True):.0f} % once the truth's own uncertainty is added; that "
        "last number is generous, because the truth's error is common to all throws and not drawn anew in each. "
        "The joint Laplace uncertainties assume that throws differ by declared noise only; the jackknife does "
        "not."
    )
    document.figure(
        result.figures["torque"],
        "Torque that the extended model needs beyond drag and wheel, root mean square over throws and axes. Air, "
        "flexing and errors of the wheel's recorded speed can all be in it; the data do not say which.",
        "85%",
    )
    document.figure(
        result.figures["throws"],
        "Errors of single throws against the stated geometry, with formal standard deviations. The grey band is "
        "the largest standard deviation of the stated moments.",
    )
    document.figure(
        result.figures["calibration"],
        "Share of single-throw credible intervals that hold the stated moments. Solid: posterior alone. Dashed: "
        "the truth's standard deviation added.",
    )
    if result.variants:
        _write_variants(document, result)


def _write_variants(document: Document, result: Result) -> None:
    rows = []
    for label, analysis in {"as reported": result.extended, **result.variants}.items():
        cells = [label, f"{1e6 * analysis.wheel:.4f}"]
        for body in analysis.bodies.values():
            single = f"{body.mean_error:.2f} / {body.largest_error:.1f} / {body.inflation:.1f}"
            cells += [_signed(body.joint_errors), single]
        rows.append(cells)
    document.paragraph(
        "The settings were found by comparing the scatter of throws, but with the truth in sight. Other "
        "reasonable choices give the following; the spread between the rows is an uncertainty in its own right."
    )
    document.table(
        ("setting", "J [mg m2]", "Empty joint [%]", "single", "A joint [%]", "single"),
        rows,
        "Errors against the truth under other settings. Single throws: mean error [%], largest error [%] and the "
        "factor by which formal standard deviations are too small.",
        ["left", "right", "right", "right", "right", "right"],
    )
    for name in ("Empty", "A"):
        errors = np.array(
            [analysis.bodies[name].joint_errors for analysis in (result.extended, *result.variants.values())]
        )
        document.paragraph(
            f"Joint values of {name} range from {errors.min():+.2f} to {errors.max():+.2f} % over all rows."
        )
    document.paragraph(
        "The width of the torque's prior sets how wide the posteriors of single throws are: half of it and they "
        "are too narrow by more than two, twice and they are too wide. Their calibration is therefore a choice "
        "made by the scatter of these throws, not a prediction. The cross-axis terms are the one addition that A "
        "cannot do without."
    )


def _write_budget(document: Document, result: Result) -> None:
    document.section("Uncertainty of the comparison")
    extended = result.extended
    rows = [
        (
            "wheel inertia",
            f"{100 * extended.wheel_jackknife / extended.wheel:.2f} % of every moment",
            "jackknife over throws of device and box; inside the jackknife of the joint values",
        ),
        ("box", "not counted", "edges and mass are taken as exact; 0.1 mm on every edge is 0.3 % of J"),
        (
            "gyro scale",
            "0.3 % and more",
            "taken as one; estimating it moved the smallest moment of A by -2.5 % in exploratory fits",
        ),
        ("sensor's place", "0.2 mm per axis and throw", "constant errors of the accelerometer; part of the posterior"),
        ("plate", f"{100 * PLATE_SD:.0f} % of its moments", 'authors\' CAD, "a few percent" uncertain; our number'),
        ("blocks", f"{100 * BLOCK_SD:.1f} % of what they add", "place to 0.1 to 0.2 mm and mass; our number"),
        (
            "wheel's transverse inertia",
            "0",
            "assumed by the authors; here it is in the locked body with and without the plate, and cancels in "
            "the difference",
        ),
        ("model", "see section 3", "unexplained torque, filter, delay and noise"),
    ]
    document.table(("source", "size", "treatment"), rows, "What the comparison rests on.")
    compared = [
        (
            body.name,
            name,
            f"{1e6 * value:.1f}",
            f"{1e6 * truth:.1f} ± {1e6 * width:.1f}",
            f"{1e6 * scatter:.1f}",
            f"{distance:+.2f}",
        )
        for body in extended.bodies.values()
        for name, value, truth, width, scatter, distance in zip(
            ("smallest", "middle", "largest"),
            body.joint,
            body.truth,
            body.truth_sd,
            body.joint_jackknife,
            body.joint_distance,
            strict=True,
        )
    ]
    document.table(
        ("body", "moment", "joint", "truth", "jackknife sd", "distance"),
        compared,
        "Joint principal moments [mg m2] and their distance from the truth in standard deviations of both together.",
        ["left", "left", "right", "right", "right", "right"],
    )
    share, sd = (
        100.0 * x / extended.blocks_truth for x in (extended.blocks - extended.blocks_truth, extended.blocks_sd)
    )
    document.paragraph(
        "The stated moments of Empty are the plate's alone, so that no result on Empty better than the CAD's few "
        "percent can be confirmed. What the four blocks add, A less Empty, needs no CAD of the plate's inertia: "
        f"it is identified within {_signed(share)} % ({_list(sd)} % by jackknife) for the smallest, middle and "
        "largest moment."
    )


def _write_sampled(document: Document, result: Result) -> None:
    document.section("Laplace approximation and samples")
    sampled = result.sampled
    if sampled is None:
        document.paragraph("Not evaluated in a quick run: a full run samples a joint fit with emcee.")
        return
    rows = [
        (name, f"{1e6 * mean:.2f} ± {1e6 * sd:.2f}", f"{1e6 * laplace:.2f} ± {1e6 * width:.2f}")
        for name, mean, sd, laplace, width in zip(
            ("smallest", "middle", "largest"),
            sampled.mean,
            sampled.sd,
            sampled.laplace_mean,
            sampled.laplace_sd,
            strict=True,
        )
    ]
    state = (
        "converged"
        if sampled.converged
        else "not converged by the package's own rule, so the comparison is indicative only"
    )
    document.paragraph(
        f"Joint posterior of {sampled.throws} throws of {sampled.body} with everything unknown at once "
        f"({sampled.unknowns} unknowns: 8 knots, and a prior of 10 % about the regression), sampled with emcee: "
        f"{sampled.evaluations} evaluations, {sampled.effective_samples:.0f} effective samples, R-hat "
        f"{sampled.r_hat:.3f}, acceptance {sampled.acceptance:.2f}; {state}."
    )
    document.table(
        ("moment, device included [mg m2]", "emcee", "Laplace"),
        rows,
        "Samples and Laplace approximation.",
        ["left", "right", "right"],
    )


def _table(document: Document, analysis: Analysis, caption: str) -> None:
    rows = []
    for body in analysis.bodies.values():
        for index, name in enumerate(("smallest", "middle", "largest")):
            truth = body.truth[index]
            rows.append(
                (
                    body.name,
                    name,
                    f"{body.errors[:, index].mean():+.2f}",
                    f"{body.scatter[index]:.2f}",
                    f"{100 * np.sqrt((body.formal[:, index] ** 2).mean()) / truth:.2f}",
                    f"{np.sqrt((body.standardised[:, index] ** 2).mean()):.1f}",
                    f"{body.joint_errors[index]:+.2f}",
                    f"{100 * body.joint_formal[index] / truth:.2f}",
                    f"{100 * body.joint_jackknife[index] / truth:.2f}",
                )
            )
    means = "; ".join(
        f"{b.name} mean {b.mean_error:.2f}, largest {b.largest_error:.1f}" for b in analysis.bodies.values()
    )
    document.table(
        ("body", "moment", "mean", "scatter", "formal sd", "inflation", "joint", "formal sd", "jackknife"),
        rows,
        f"{caption} Principal moments against the truth [%]: single throws (mean error, standard deviation, "
        "formal standard deviation, factor by which it is too small) and joint fit. Errors of single throws: "
        f"{means} %.",
        ["left", "left", *["right"] * 7],
    )


def _percent(values: np.ndarray, body: BodyResult) -> np.ndarray:
    return 100.0 * values / body.truth


def _signed(values: np.ndarray) -> str:
    return " / ".join(f"{value:+.2f}" for value in values)


def _list(values: np.ndarray) -> str:
    return " / ".join(f"{value:.2f}" for value in values)
