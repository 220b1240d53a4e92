"""What nobody listed that also changes the data along what listed causes would change.

An error of the accelerometer that grows with the square of the reading, say, follows the motion as a wrong place of
the sensor does. A course that is smooth in time imitates neither, so that the cause would be named for the part that
it explains, however little of the whole that is. A smooth disturbance may therefore also have a part in the space of
the linear causes of its kind: those that change one sensor's readings alone for an error of that sensor, and all
others for a torque or a force. The expected square of the signal there is that of its course, in every direction alike.
Beside a large remainder a cause is then named only if its signal exceeds what such a remainder may have in its
directions, while a cause that leaves nothing is worth as much as before.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayesid.diagnosis.candidates.further_forms import Chosen, with_further_forms
from bayesid.diagnosis.candidates.linear_model import Linearisation, Signatures
from bayesid.diagnosis.evidence.cause_sets import SetProbabilities
from bayesid.diagnosis.evidence.gram import Gram
from bayesid.diagnosis.evidence.scales import Variant
from bayesid.inference.posterior import Posterior
from bayesid.simulation.sensors import SensorKind

__all__ = ["with_imitations"]

SUFFIX = " that imitates causes"
"""What follows the name of a disturbance's group in that of its form with a part in the directions of causes."""

ALONE = 1e-6
"""Largest share of a signature's square in the readings of other sensors for it to be a change of one alone."""


def with_imitations(point: Linearisation, probabilities: SetProbabilities) -> Linearisation:
    """Return the linear model in which smooth disturbances may imitate causes, or the same if that could not matter.

    Parameters
    ----------
    point : Linearisation
    probabilities : SetProbabilities
    """
    if not probabilities.sets[0].names:
        return point
    names = {group.name for cause in point.bank.causes if not (cause.generic or cause.fixed) for group in cause.groups}
    linear = [one for one in point.bank.signatures if one.name in names and one.is_linear and one.recording is None]
    changed = [_sensor(point.fit.posterior, one) for one in linear]
    directions: list[Signatures] = []
    unions: dict[str, tuple[str, ...]] = {}
    for cause in point.bank.causes:
        courses = {group.name for groups, _ in cause.variants for group in groups if group.spread is not None}
        if cause.generic and courses:
            first = next(one for one in point.bank.signatures if one.name in courses)
            sensor, name = _sensor(point.fit.posterior, first), f"directions of {cause.name}"
            like = [replace(one, name=name) for one, own in zip(linear, changed, strict=True) if own is sensor]
            directions += like
            unions |= {f"{group}{SUFFIX}": (group, name) if like else (group,) for group in sorted(courses)}
    bank = replace(
        point.bank,
        signatures=(*point.bank.signatures, *directions),
        unions={**point.bank.unions, **unions},
    )
    extended = point.with_bank(bank)
    gram = extended.evidence.gram
    information = np.diag(gram.matrix)

    def choose(variant: Variant, _: Gram) -> Chosen:
        (group,) = variant.groups
        columns, there = (information[gram.groups[name]] for name in (group.name, f"{group.name}{SUFFIX}"))
        spread, there = np.ones(len(columns)) if group.spread is None else group.spread, there[len(columns) :]
        visible = there > 0.0
        each = float(spread @ columns) / max(int(visible.sum()), 1)
        along = np.divide(each, there, out=np.zeros_like(there), where=visible)
        return Chosen(np.concatenate([spread, along]), variant.log_weight)

    further = with_further_forms(extended, probabilities, choose, SUFFIX)
    return point if further is extended else further


def _sensor(posterior: Posterior, signatures: Signatures) -> SensorKind | None:
    """Return the sensor whose readings alone some signatures change, or none."""
    squares = signatures.columns.reshape(-1, posterior.residual_shape[-1], signatures.columns.shape[1]) ** 2
    channels, total = posterior.model.channels, float(squares.sum())
    shares = ((kind, float(squares[:, channels.of(kind)].sum())) for kind in channels.kinds)
    return next((kind for kind, share in shares if share >= (1.0 - ALONE) * total), None)
