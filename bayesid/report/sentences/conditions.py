"""Conditions under which a verdict holds, in a few words."""

from __future__ import annotations

from bayesid.diagnosis import Hypothesis
from bayesid.report.numbers import format_percent, format_range
from bayesid.simulation.sensors import Coloured

__all__ = ["conditions_text"]


def conditions_text(hypothesis: Hypothesis) -> str:
    """Return what a hypothesis takes for granted of links, noise and attitude."""
    posterior = hypothesis.fit.posterior
    nuisance = [prior for prior in posterior.model.priors if prior.nuisance]
    links = "links exact"
    if nuisance:
        widths = [prior.spread for prior in nuisance]
        width = format_percent(widths[0]) if len(set(widths)) == 1 else f"{format_range(widths)} of their values"
        links = f"links uncertain by {width}"
    coloured = [sensor.kind.value for sensor in posterior.model.sensors if isinstance(sensor.noise, Coloured)]
    noise = f"noise of {', '.join(coloured)} coloured as named" if coloured else "noise white"
    if hypothesis.faults:
        noise += f", with {', '.join(fault.label for fault in hypothesis.faults)}"
    known = "geometry exact"
    return f"{links}, {known}, {noise}; bodies rigid but for the causes considered.".capitalize()
