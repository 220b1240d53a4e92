"""Figure of the report: what became of the spoilt files, by kind of change."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from bayesid.report.figures.figure_style import COLOURS, shared_legend, styled, wide_figure

__all__ = ["OUTCOMES", "answer_figure"]

OUTCOMES = {"refused": "refused with a clear message", "accepted": "accepted", "faulty": "unclear answer"}
"""Titles of the outcomes by their keys."""


@styled
def answer_figure(answers: Mapping[str, Mapping[str, int]]) -> Figure:
    """Draw the numbers of files by outcome, one bar for each kind of change."""
    figure = wide_figure(0.75 + 0.2 * len(answers))
    axes = figure.subplots()
    place, left = np.arange(len(answers)), np.zeros(len(answers))
    for (key, title), colour in zip(OUTCOMES.items(), COLOURS[2:5], strict=True):
        counts = np.array([found.get(key, 0) for found in answers.values()])
        axes.barh(place, counts, 0.65, left=left, color=colour, label=title)
        left = left + counts
    axes.set(xlabel="number of files", ylim=(len(answers) - 0.5, -0.5))
    axes.set_yticks(place, list(answers))
    shared_legend(figure, axes, len(OUTCOMES))
    return figure
