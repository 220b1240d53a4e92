"""Agreement of the sampler's ensembles: running means and ranks."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bayesid._math.arrays import Floats
from bayesid.inference.identification import Identification
from bayesid.report.figures.figure_style import BAND, curve_style, shared_legend, styled, wide_figure
from bayesid.report.numbers import format_number

__all__ = ["convergence"]


SHOWN = 3
"""Number of coordinates drawn, those in which the ensembles agree least."""

RANK_BINS = 20
"""Number of bins of the histograms of ranks."""


@styled
def convergence(result: Identification) -> Figure:
    """Draw running means and ranks of the ensembles, for the coordinates in which they agree least.

    Ensembles that sample the same distribution have running means that meet at zero and ranks spread evenly.
    """
    import arviz as az  # here, as it takes a second that reports without samples save

    chains = result.chains
    r_hat = np.array([float(az.rhat(chains.z[:, :, k])) for k in range(chains.z.shape[2])])
    worst = np.argsort(r_hat)[::-1][:SHOWN]
    figure = wide_figure(0.75 + 1.35 * len(worst))
    panels = figure.subplots(len(worst), 2, squeeze=False, gridspec_kw={"width_ratios": [1.5, 1.0]})
    for row, coordinate in enumerate(worst):
        draws = chains.z[:, :, coordinate]
        _draw_running_means(panels[row, 0], draws, chains.walkers, chains.autocorrelation)
        _draw_ranks(panels[row, 1], draws)
        panels[row, 0].set_title(f"{result.posterior.unknowns.names[coordinate]}, R-hat {r_hat[coordinate]:.4f}")
        panels[row, 0].set_ylabel("running mean [sd]")
        panels[row, 1].set_ylabel("draws over even")
    panels[-1, 0].set_xlabel("step after burn-in")
    panels[-1, 1].set_xlabel("rank among all draws")
    text = (
        f"autocorrelation time {format_number(chains.autocorrelation)} steps, largest R-hat {chains.r_hat:.4f}, "
        f"accepted {100.0 * chains.acceptance:.0f} % of proposals, {chains.effective_samples:.0f} effective samples"
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
