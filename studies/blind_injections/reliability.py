"""Reliability diagram: how often named causes were hidden, against the probability stated for them."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from matplotlib.figure import Figure
from scipy import stats

from bayesid.report.figures.figure_style import AFTER, TRUTH, styled, wide_figure
from studies.blind_injections.rows import reliable_pairs
from studies.blind_injections.trials import Trial

__all__ = ["reliability_figure"]


@styled
def reliability_figure(trials: Iterable[Trial]) -> Figure:
    """Draw the share of verdicts that held, with its interval, over the mean stated probability of each range."""
    figure = wide_figure(1.9)
    axes = figure.subplots()
    axes.plot([0.0, 1.0], [0.0, 1.0], color=TRUTH, linewidth=0.8)
    for pairs in reliable_pairs(trials).values():
        stated, right = float(np.mean([pair[0] for pair in pairs])), sum(held for _, held in pairs)
        interval = stats.binomtest(right, len(pairs)).proportion_ci(method="wilson")
        axes.plot([stated, stated], [interval.low, interval.high], color=AFTER, linewidth=1.0)
        axes.plot(stated, right / len(pairs), "o", color=AFTER, markersize=4)
    axes.set(xlim=(0.0, 1.02), ylim=(-0.03, 1.03), xlabel="stated probability", ylabel="share right")
    return figure
