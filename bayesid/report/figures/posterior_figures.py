"""Figures of a posterior: distributions, correlations, directions, widths over the prior's, agreement of ensembles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike
from scipy.ndimage import gaussian_filter, gaussian_filter1d

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.identifiability.directions import Direction
from bayesid.inference.body_quantities import BODY_QUANTITIES, CONTRACTED, PRIOR_ONLY, BodyDraws, ContractionVerdict
from bayesid.inference.identification import Identification
from bayesid.report.figures.figure_style import (
    BAND,
    COLOURS,
    FILL,
    WIDTH,
    PageFigure,
    curve_style,
    panels_of,
    shared_legend,
    styled,
    wide_figure,
)
from bayesid.report.numbers import format_fixed, format_number, format_quantity, format_unit

__all__ = [
    "convergence",
    "correlations",
    "direction_widths",
    "displacements",
    "plot_posterior",
    "prior_to_posterior",
]

REACH = 3.5  # half-width of a corner plot's axes in posterior standard deviations

CELLS = 35  # number of cells of a corner plot's histograms along one axis

LABELS, VALUES = 36, 16
"""Largest numbers of parameters of which a matrix of correlations has room for every name, and for every value."""

SHOWN = 3  # number of coordinates drawn, those in which the ensembles agree least

RANK_BINS = 20  # number of bins of the histograms of ranks

WORST, MOST_ROWS = 12, 44  # largest numbers of directions and of parameters in the map of displacements

VISIBLE = 0.1  # displacement over the largest of its direction from which on a parameter counts as moved

LOOK = {
    ContractionVerdict.CONTRACTED: COLOURS[2],
    ContractionVerdict.WEAKLY: COLOURS[4],
    ContractionVerdict.NOT: COLOURS[1],
}
"""Colour of each verdict."""


@styled
def plot_posterior(result: Identification | BodyDraws, name: str | None = None, *, axes: Any = None) -> Figure:
    """Draw the joint distributions of one body's ten quantities about their means, in posterior standard deviations.

    The contours contain 50 % and 90 % of the draws.

    Parameters
    ----------
    result : Identification or BodyDraws
        Result of `identify`, or draws of a body.
    name : str, optional
        Name of the link or load, by default the first that was identified.
    axes : (10, 10) array_like of Axes, optional
        Panels to draw in, by default those of a new figure; those above the diagonal are hidden.
    """
    bodies = result.bodies if isinstance(result, Identification) else {result.name: result}
    name = next(iter(bodies), "") if name is None else name
    if name not in bodies:
        remedy = f"Choose one of {', '.join(bodies)}" if bodies else "Name a body to identify"
        raise InputError(f"no body {name!r} was identified", remedy=remedy)
    body = bodies[name]
    mean, sd = body.mean, body.sd
    scaled = (body.values - mean) / np.where(sd > 0.0, sd, 1.0)
    count = scaled.shape[1]
    if axes is None:
        figure: Figure = PageFigure(figsize=(WIDTH, 6.2))
        figure.subplots_adjust(left=0.075, right=0.88, bottom=0.08, top=0.935, wspace=0.08, hspace=0.08)
        places = [(i, j) for i in range(count) for j in range(i + 1)]
        panels = {(i, j): figure.add_subplot(count, count, i * count + j + 1) for i, j in places}
    else:
        figure, given = panels_of(axes, count, count, 6.2)
        panels = {(i, j): given[i, j] for i in range(count) for j in range(i + 1)}
        for above in given[np.triu_indices(count, 1)]:
            above.set_visible(False)
    for (row, column), axes in panels.items():
        if column == row:
            _draw_marginal(axes, scaled[:, row])
        else:
            _draw_pair(axes, scaled[:, column], scaled[:, row])
        _corner_ticks(axes, row, column, count)
    for index, (name, unit) in enumerate(BODY_QUANTITIES.items()):
        text = f"{name}\n{format_quantity(mean[index], sd[index])}\n{format_unit(unit)}"
        axes = panels[index, index]
        axes.text(0.0, 1.06, text, transform=axes.transAxes, fontsize=7, va="bottom", linespacing=1.1)
        label = name.replace(".", "\n")
        panels[count - 1, index].set_xlabel(label, labelpad=2)
        if index:
            panels[index, 0].set_ylabel(label, labelpad=2)
    return figure


def _draw_marginal(axes: Axes, values: Floats) -> None:
    density, edges = np.histogram(values, bins=CELLS, range=(-REACH, REACH), density=True)
    centres = 0.5 * (edges[1:] + edges[:-1])
    axes.fill_between(centres, gaussian_filter1d(density, 0.8), color=FILL, linewidth=0.0)
    axes.set_ylim(0.0, None)


def _draw_pair(axes: Axes, across: Floats, up: Floats) -> None:
    density, edges, _ = np.histogram2d(across, up, bins=CELLS, range=[[-REACH, REACH]] * 2)
    density = gaussian_filter(density.T, 1.2)
    ordered = np.sort(density.ravel())[::-1]
    total = np.cumsum(ordered)
    levels = [float(ordered[np.searchsorted(total, share * total[-1])]) for share in (0.9, 0.5)]
    if not 0.0 < levels[0] < levels[1] < ordered[0]:
        axes.plot(across, up, ".", color=COLOURS[0], markersize=1.0, rasterized=True)
        return
    centres = 0.5 * (edges[1:] + edges[:-1])
    axes.contourf(centres, centres, density, levels=[*levels, float(ordered[0])], colors=["#cfe3f1", "#5a9fcb"])
    axes.contour(centres, centres, density, levels=levels, colors=COLOURS[0], linewidths=0.5)


def _corner_ticks(axes: Axes, row: int, column: int, count: int) -> None:
    axes.grid(False)
    axes.set_xlim(-REACH, REACH)
    axes.set_xticks([-2, 0, 2])
    axes.tick_params(length=1.5, pad=1.5, labelbottom=row == count - 1, labelleft=column == 0 and row > 0)
    if column < row:
        axes.set_ylim(-REACH, REACH)
        axes.set_yticks([-2, 0, 2])
    else:
        axes.set_yticks([])


@styled
def correlations(names: Sequence[str], covariance: ArrayLike) -> Figure:
    """Draw the correlations of a covariance matrix, with their values where they fit.

    Parameters
    ----------
    names : sequence of str
    covariance : (n, n) array_like
    """
    matrix = np.atleast_2d(np.asarray(covariance, dtype=float))
    sd = np.sqrt(np.diag(matrix))
    values = matrix / np.outer(np.where(sd > 0.0, sd, 1.0), np.where(sd > 0.0, sd, 1.0))
    count = len(values)
    width = min(WIDTH, 1.6 + 0.34 * count)
    figure = Figure(figsize=(width, 0.88 * width), layout="constrained")
    axes = figure.subplots()
    axes.grid(False)
    image = axes.imshow(values, vmin=-1.0, vmax=1.0, cmap="RdBu_r", interpolation="nearest")
    labelled = range(0, count, -(-count // LABELS))
    shown = [names[place] for place in labelled]
    axes.set_xticks(labelled, shown, rotation=45, ha="right", rotation_mode="anchor")
    axes.set_yticks(labelled, shown)
    if count <= VALUES:
        for row in range(count):
            for column in range(count):
                value = float(values[row, column])
                colour = "white" if abs(round(value, 2)) > 0.6 else "black"
                axes.text(column, row, format_fixed(value, 2), ha="center", va="center", color=colour, fontsize=6)
    figure.colorbar(image, ax=axes, label="correlation", shrink=0.8, aspect=30)
    return figure


@styled
def prior_to_posterior(result: Identification) -> Figure:
    """Draw posterior width over prior width of every reported quantity, on a logarithmic scale."""
    names = list(result.widths)
    ratio = np.array([posterior / prior for prior, posterior in result.widths.values()])
    figure = wide_figure(0.7 + 0.17 * len(names))
    axes = figure.subplots()
    rows = np.arange(len(names))
    low = 10.0 ** np.floor(np.log10(min(float(ratio.min()), 0.5)) - 0.1)
    axes.barh(rows, np.log10(ratio / low), left=np.zeros(len(names)), color="#5a9fcb", height=0.7)
    exponents = np.arange(round(float(np.log10(low))), max(1, int(np.ceil(np.log10(ratio.max()))) + 1))
    axes.set_xticks(exponents - np.log10(low), [f"$10^{{{exponent}}}$" for exponent in exponents])
    axes.axvline(-np.log10(low), color="black", linewidth=0.8)
    for row, value in zip(rows, ratio, strict=True):
        axes.text(float(np.log10(value / low)), float(row), f" {format_number(value, 2)}", va="center")
    axes.set_xlim(0.0, max(-np.log10(low), float(np.log10(ratio.max() / low))) + 0.35)
    axes.set_yticks(rows, names)
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.grid(False, axis="y")
    axes.set_xlabel("width of the posterior / width of the prior (half the central 68 % range)")
    return figure


@styled
def convergence(result: Identification) -> Figure:
    """Draw running means and ranks of the ensembles, for the coordinates in which they agree least.

    Ensembles that sample the same distribution have running means that meet at zero and ranks spread evenly.
    """
    chains, r_hat = result.chains, np.array(list(result.r_hat.values()))
    worst = np.argsort(r_hat)[::-1][:SHOWN]
    figure = wide_figure(0.75 + 1.35 * len(worst))
    panels = figure.subplots(len(worst), 2, squeeze=False, gridspec_kw={"width_ratios": [1.5, 1.0]})
    for row, coordinate in enumerate(worst):
        draws = chains.z[:, :, coordinate]
        _draw_running_means(panels[row, 0], draws, chains.walkers, chains.autocorrelation)
        _draw_ranks(panels[row, 1], draws)
        panels[row, 0].set_title(f"{result.posterior.unknowns.names[coordinate]}, R-hat {r_hat[coordinate]:.4f}")
        panels[row, 0].set_ylabel("running mean [sd]")
        panels[row, 1].set_ylabel("relative density")
    panels[-1, 0].set_xlabel("step after burn-in")
    panels[-1, 1].set_xlabel("rank among all draws")
    text = (
        f"autocorrelation time {format_number(chains.autocorrelation)} steps, largest R-hat {chains.r_hat:.4f}, "
        f"{chains.effective_samples:.0f} effective samples"
    )
    figure.suptitle(text, fontsize=7.5)
    shared_legend(figure, panels[0, 0], columns=len(chains.z) + 1, place="outside lower center")
    return figure


def _draw_running_means(axes: Axes, draws: Floats, walkers: int, autocorrelation: float) -> None:
    steps = draws.shape[1] // walkers
    per_step = draws[:, : steps * walkers].reshape(len(draws), steps, walkers).mean(axis=2)
    running = np.cumsum(per_step, axis=1) / np.arange(1, steps + 1)
    scale = float(draws.std()) or 1.0
    step = np.arange(1, steps + 1)
    error = np.sqrt(np.maximum(autocorrelation, 1.0) / (step * walkers))
    axes.fill_between(step, -2.0 * error, 2.0 * error, **BAND, label="95 % expected")
    for number, values in enumerate((running - draws.mean()) / scale):
        axes.plot(step, values, linewidth=0.8, label=f"ensemble {number + 1}", **curve_style(number))
    reach = 4.0 * float(error[min(len(error) - 1, max(1, len(error) // 20))])
    axes.set_ylim(-reach, reach)
    axes.set_xlim(1, max(steps, 2))


def _draw_ranks(axes: Axes, draws: Floats) -> None:
    from scipy.stats import rankdata

    rank = (rankdata(draws.ravel()) - 0.5).reshape(draws.shape) / draws.size
    edges = np.linspace(0.0, 1.0, RANK_BINS + 1)
    for number, values in enumerate(rank):
        density = np.histogram(values, edges, density=True)[0]
        axes.stairs(density, edges, color=curve_style(number)["color"], linewidth=0.8)
    axes.axhline(1.0, color="black", linewidth=0.6)
    axes.set_ylim(0.0, 2.0)
    axes.set_xlim(0.0, 1.0)


@styled
def direction_widths(directions: Sequence[Direction]) -> Figure:
    """Draw posterior sd over prior sd of every direction."""
    figure = wide_figure(2.1)
    axes = figure.subplots()
    ratio = np.array([item.sd / item.prior_sd for item in directions])
    numbers = np.arange(1, len(ratio) + 1)
    for verdict, colour in LOOK.items():
        chosen = np.array([item.verdict is verdict for item in directions])
        if chosen.any():
            axes.semilogy(numbers[chosen], ratio[chosen], "o", markersize=3.5, color=colour, label=verdict.value)
    axes.axhline(1.0 - CONTRACTED, color="black", linewidth=0.5, linestyle=":")
    axes.axhline(1.0 - PRIOR_ONLY, color="black", linewidth=0.5, linestyle=":")
    axes.set_ylim(0.5 * float(ratio.min()), 2.0)
    axes.set_xlim(0.3, len(ratio) + 0.7)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("direction")
    axes.set_ylabel("posterior sd / prior sd")
    axes.legend(loc="lower left")
    return figure


@styled
def displacements(directions: Sequence[Direction], prior_sd: Floats) -> Figure:
    """Draw the displacements of the worst known directions in units of the prior's widths, parameters down."""
    shown = directions[:WORST]
    moved = np.stack([item.displacement / prior_sd for item in shown], axis=1)
    # each direction is divided by its largest displacement: otherwise the well-known ones would be white
    largest = np.abs(moved).max(axis=0)
    strength = (np.abs(moved) / largest).max(axis=1)
    rows = np.sort(np.argsort(-strength)[:MOST_ROWS])
    rows = rows[strength[rows] > VISIBLE]
    names = [directions[0].names[row] for row in rows]
    figure = wide_figure(0.9 + 0.155 * len(rows))
    axes = figure.subplots()
    axes.grid(False)
    image = axes.imshow(
        moved[rows] / largest, vmin=-1.0, vmax=1.0, cmap="RdBu_r", interpolation="nearest", aspect="auto"
    )
    axes.set_yticks(range(len(rows)), names)
    labels = [f"{number}\n{size:.2g}" for number, size in enumerate(largest, start=1)]
    axes.set_xticks(range(len(shown)), labels)
    axes.set_xlabel("direction, and its largest displacement in prior sd")
    for body in range(1, len(rows)):
        if names[body].split(".")[0] != names[body - 1].split(".")[0]:
            axes.axhline(body - 0.5, color="black", linewidth=0.5)
    figure.colorbar(image, ax=axes, label="displacement / largest displacement", aspect=30)
    return figure
