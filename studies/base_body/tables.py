"""Tables of the report, each as its header and its rows, sentences on the sampled posterior, and figures."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure

from bayesid.inference import Identification
from bayesid.inference.body_quantities import BODY_QUANTITIES
from bayesid.report.figures.figure_style import AFTER, BEFORE, COLOURS, TRUTH, shared_legend, styled, wide_figure
from bayesid.report.numbers import NO_VALUE, format_number, format_percent
from studies.base_body import paper
from studies.base_body.analysis import GRADES, BaseBody
from studies.common.ets7 import BASE
from studies.common.quantities import LABELS, squared_distances

Table = tuple[list[str], list[list[str]]]

# names of the noise-free cases in words
CASES = {
    "well": "well exciting",
    "poor": "poorly exciting",
    "well, no gradient": "well exciting, no gravity gradient in the model",
    "poor, no gradient": "poorly exciting, no gravity gradient in the model",
    "well, rate unknown": "well exciting, initial rate unknown",
    "well, arm 1/7": "well exciting, arm of 1/7 of the base's mass",
}

# relative errors of the results that the paper prints
PAPER = {
    "the paper, well exciting": paper.RESULT_WELL / paper.TRUTH - 1.0,
    "the paper, poorly exciting": paper.RESULT_POOR / paper.TRUTH - 1.0,
}


def case_table(result: BaseBody) -> Table:
    """Return the worst errors and the misfit of every noise-free case, those of the paper first."""
    cases = [
        *((name, error, NO_VALUE) for name, error in PAPER.items()),
        *((CASES[name], case.error, format_number(case.misfit, 2)) for name, case in result.noise_free.items()),
    ]
    groups = (slice(0, 1), slice(1, 4), slice(4, 7), slice(7, 10))
    rows = [
        [name, *(format_percent(float(np.abs(error[group]).max()), 1) for group in groups), misfit]
        for name, error, misfit in cases
    ]
    return ["manoeuvre, model", "mass", "centre of mass", "moments", "products", "misfit"], rows


def precision_table(result: BaseBody) -> Table:
    """Return the relative standard deviation of every quantity by speed and knowledge of the arm."""
    columns = result.precision
    rows = [
        [label, *(format_number(100.0 * float(column[index]), 2) for column in columns.values())]
        for index, label in enumerate(LABELS)
    ]
    return ["quantity", *(f"{_flown(name, result)} [%]" for name in columns)], rows


def _flown(name: str, result: BaseBody) -> str:
    """Return a speed and what is known of the arm, as figures and tables call them."""
    speed, _, arm = name.partition(", arm ")
    speed = "permitted speed" if speed == "permitted" else f"{result.slowness:.1f} times faster"
    return f"{speed}, arm {arm if arm == 'exact' else f'uncertain by {arm}'}"


def squared_distance(identified: Identification) -> float:
    """Return the squared distance of the truth from the posterior's mean, in the posterior's metric."""
    body = identified.bodies[BASE]
    return float(squared_distances(body.mean - paper.TRUTH, np.cov(body.values.T)))


def sampler_sentence(name: str, identified: Identification) -> str:
    """Return how the sampler did."""
    chains = identified.chains
    return (
        f"Arm {name}: {identified.posterior.size} unknowns, {chains.effective_samples:.0f} effective samples from "
        f"{chains.evaluations} evaluations, R-hat {chains.r_hat:.4f}, {'' if chains.converged else 'not '}converged; "
        f"chi² is {identified.optimum.chi2:.0f} for {identified.posterior.samples} samples. "
        + (" ".join(identified.disagreements) or "Mode, importance sampling and ensembles agree.")
    )


def estimates(result: BaseBody) -> Iterator[tuple[object, ...]]:
    """Yield the rows of all estimates without noise, the paper's included: case, quantity, truth, estimate, error."""
    values_of = {"paper, well": paper.RESULT_WELL, "paper, poor": paper.RESULT_POOR}
    values_of |= {name: case.estimate for name, case in result.noise_free.items()}
    for name, values in values_of.items():
        for key, truth, value in zip(BODY_QUANTITIES, paper.TRUTH, values, strict=True):
            yield name, key, truth, value, value / truth - 1.0


def grades(result: BaseBody) -> Iterator[tuple[object, ...]]:
    """Yield the rows of the accelerometers' grades: what is known, noise [m/s2], quantity, relative deviation."""
    for name, widths in result.grades.items():
        for grade, row in zip(GRADES, widths, strict=True):
            for key, value in zip(BODY_QUANTITIES, row, strict=True):
                yield f"arm {name}", grade, key, value


def readings(result: BaseBody) -> Iterator[tuple[object, ...]]:
    """Yield the rows of what every unit would mean that the paper's sigmas may have."""
    for reading in result.readings:
        yield reading.sigma, reading.unit, reading.fraction, reading.mass, reading.moment, reading.manoeuvres


REACH = 7.0  # half-height of the panel of mass, centre of mass and moments [%]; points beyond are marked at its edge


@styled
def precision_figure(result: BaseBody) -> Figure:
    """Draw the relative standard deviation of every quantity by speed and knowledge of the arm."""
    figure = wide_figure(2.9)
    axes = figure.subplots()
    looks = {
        "permitted, arm exact": (AFTER, "o"),
        "permitted, arm 5 %": (AFTER, "s"),
        "faster, arm exact": (COLOURS[5], "^"),
        "faster, arm 5 %": (COLOURS[5], "v"),
    }
    place = np.arange(len(LABELS))
    for shift, (name, values) in zip((-0.24, -0.08, 0.08, 0.24), result.precision.items(), strict=True):
        colour, marker = looks[name]
        face = colour if name.endswith("exact") else "white"
        label = _flown(name, result)
        axes.plot(place + shift, 100.0 * values, marker, color=colour, label=label, markersize=5, mfc=face)
    axes.set(yscale="log", ylabel="relative sd [%]")
    axes.set_xticks(place, LABELS)
    shared_legend(figure, axes, 2)
    return figure


@styled
def error_figure(result: BaseBody) -> Figure:
    """Draw the relative errors of the ten quantities, the paper's and those of this study."""
    figure = wide_figure(3.7)
    axes = figure.subplots()
    series = {
        **PAPER,
        **{CASES[name]: case.error for name, case in result.noise_free.items()},
    }
    place = np.arange(len(LABELS))
    for index, (name, error) in enumerate(series.items()):
        marker = "os^vDPX*"[index % 8]
        colour = BEFORE if name in PAPER else COLOURS[index % len(COLOURS)]
        axes.plot(place + 0.06 * (index - 3.5), np.abs(error), marker, color=colour, label=name, markersize=4)
    axes.axhline(1e-6, color="black", linewidth=0.8, linestyle="--")
    axes.text(place[-1] + 0.4, 1.2e-6, "goal", ha="right", va="bottom")
    axes.set(yscale="log", ylabel="relative error")
    axes.set_xticks(place, LABELS)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=2)
    return figure


@styled
def posterior_figure(result: BaseBody) -> Figure:
    """Draw posterior means and standard deviations beside what the paper printed, relative to the truth."""
    figure = wide_figure(3.0)
    panels = figure.subplots(1, 2, width_ratios=(7, 3))
    for axes, pick in ((panels[0], slice(0, 7)), (panels[1], slice(7, 10))):
        place = np.arange(10)[pick]
        for index, (name, identified) in enumerate(result.sampled.items()):
            body = identified.bodies[BASE]
            axes.errorbar(
                place + 0.15 * (2 * index - 1),
                100.0 * (body.mean / paper.TRUTH - 1.0)[pick],
                100.0 * (body.sd / np.abs(paper.TRUTH))[pick],
                fmt="o",
                markersize=3,
                capsize=2,
                color=(AFTER, COLOURS[5])[index],
                label=f"posterior, arm {name if name == 'exact' else f'uncertain by {name}'}",
            )
        for (name, printed), marker in zip(PAPER.items(), "x+", strict=True):
            error = 100.0 * printed[pick]
            axes.plot(place, error, marker, color=BEFORE, label=name, markersize=5)
            for x, value in zip(place, error, strict=True):
                if axes is panels[0] and abs(value) > REACH:
                    text = f"{format_number(float(value), 2)} %"
                    edge = float(np.copysign(REACH, value))
                    axes.plot(x, 0.97 * edge, "v" if value < 0.0 else "^", color=BEFORE, markersize=4)
                    axes.annotate(text, (x, 0.97 * edge), (5, 0), textcoords="offset points", color=BEFORE, va="center")
        axes.axhline(0.0, color=TRUTH, linewidth=0.8)
        axes.set_xticks(place, LABELS[pick])
    panels[0].set(ylabel="difference from the truth [%]", ylim=(-REACH, REACH))
    panels[1].set(ylabel="difference from the truth [%]")
    panels[0].legend(ncols=2, loc="upper right")
    return figure
