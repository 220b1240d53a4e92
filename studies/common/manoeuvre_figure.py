"""Manoeuvres side by side as MuJoCo flies them: joints, speed of the tip beside the rule, rotation of the base."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from bayesid.recording.joint_motion import Motion
from bayesid.report.figures.figure_style import COLOURS, curve_style, shared_legend, styled, wide_figure
from studies.common import mission
from studies.common.ets7 import TIP_SPEED
from studies.common.tip_watch import flown_along

__all__ = ["manoeuvre_figure"]


@styled
def manoeuvre_figure(motions: Mapping[str, Motion]) -> Figure:
    """Draw manoeuvres, one column for each, by their titles."""
    figure = wide_figure(4.2)
    panels = figure.subplots(3, len(motions), sharex=True, sharey="row", squeeze=False)
    for column, ((top, middle, bottom), (title, motion)) in enumerate(zip(panels.T, motions.items(), strict=True)):
        course = flown_along(mission.ship(), motion, mission.DURATION)
        position = motion.evaluate(course.time).position
        for joint in range(6):
            top.plot(
                course.time, position[:, joint], label=None if column else f"joint {joint + 1}", **curve_style(joint)
            )
        middle.plot(course.time, 1e3 * course.tip_speed, color=COLOURS[0])
        middle.axhline(1e3 * TIP_SPEED, color="black", linestyle=":", linewidth=0.8)
        bottom.plot(course.time, np.degrees(course.base_rotation), color=COLOURS[0])
        top.set_title(title)
        bottom.set_xlabel("time [s]")
    for axes, label in zip(panels[:, 0], ("joints [rad]", "tip speed [mm/s]", "base turned [deg]"), strict=True):
        axes.set_ylabel(label)
    shared_legend(figure, panels[0, 0], 6)
    return figure
