"""Lines at a multiple of a wheel's speed: an imbalance, whose order is one unless the scale of the speed is wrong.

The bank holds the line of order one. Other orders are sought in what the most probable other causes leave: the residual
is summed against the wheel's angle (order tracking: Fyfe and Munck 1997), which a Fourier transform does for all orders
at once, and the strongest orders are placed exactly in Gram space. Half of the prior belongs to order one, the other
half to all orders that the recordings could tell apart, so that the search is charged for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.diagnosis.candidates.cause_kind import Bounds, CauseKind
from bayesid.diagnosis.candidates.linear_cause import amplitude_signatures
from bayesid.diagnosis.candidates.linear_model import Linearisation, Remaining, SignatureBank, Signatures
from bayesid.diagnosis.evidence.cause_sets import SetProbabilities
from bayesid.diagnosis.evidence.scales import AmplitudeGroup, CandidateCause
from bayesid.diagnosis.response.perturbed_model import Fit, PerturbedModel
from bayesid.inference.residual_view import ResidualView
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import PhysicalBound, Quantity
from bayesid.simulation.effects.wheel_faults import WheelImbalance

__all__ = ["OrderLineCause", "order_spectrum"]

LOWEST, HIGHEST = 0.2, 5.0
"""Orders that are sought: wrong counts of poles, teeth or lines are seldom wrong by more."""

OVERSAMPLED = 4
"""Orders of the scan per order that the longest recording tells apart."""

STRONGEST = 3
"""Orders that are placed in Gram space and weighed."""

ROUNDS, POINTS = 2, 4
"""Rounds of the placing, and orders that are tried on either side in each."""

SHARE = 0.5
"""Prior probability of order one."""


class OrderLineCause(CauseKind):
    """Causes whose effect has an order as a constant, and else is linear in amplitudes of each recording."""

    name = "order-line"
    linearised_beside = True

    def signatures(
        self, perturbed: PerturbedModel, fit: Fit, effects: Sequence[Effect], bounds: Bounds
    ) -> SignatureBank:
        """Return the bank of the lines of order one."""
        banks = []
        for effect in effects:
            lines = _line(perturbed, fit, effect, 1.0)
            cause = CandidateCause(effect.label, _groups(lines, bounds[effect.label]))
            banks.append(SignatureBank(tuple(lines.values()), (cause,)))
        return SignatureBank.joined(banks)

    def refined(
        self,
        point: Linearisation,
        probabilities: SetProbabilities,
        effects: Sequence[Effect],
        bounds: Bounds,
        least: float,
    ) -> Linearisation:
        """Return the linear model with the strongest orders among the forms of each line."""
        for effect in effects:
            if isinstance(effect, WheelImbalance):
                others = [name for name in probabilities.sets[0].names if name != effect.label]
                point = self._tuned(point, effect, others, bounds[effect.label])
        return point

    def with_form(self, effect: Effect, point: Linearisation, names: Sequence[str]) -> Effect:
        """Return the effect with its most probable order."""
        order = point.most_probable_form(effect.label, names).order
        return effect.with_order(order) if isinstance(effect, WheelImbalance) and order is not None else effect

    def starts(self, effect: Effect, point: Linearisation, names: Sequence[str]) -> Sequence[Floats]:
        """Return the mean amplitudes by the linear model, those of each recording together."""
        by_unit = point.mean_amplitudes(effect.label, names).reshape(2, -1, 2)
        sigma = np.array([parameter.sigma for parameter in effect.parameters])
        return [(np.moveaxis(by_unit, 0, 1).reshape(-1, 4) / sigma).ravel()]

    def quantities(self, effects: Sequence[Effect]) -> dict[str, tuple[Quantity, ...]]:
        """Return the components of the static imbalance of each effect, whose columns come first."""
        return {effect.label: tuple(effect.amplitude_quantities[:2]) for effect in effects}

    def _tuned(
        self, point: Linearisation, effect: WheelImbalance, others: Sequence[str], bounds: Sequence[PhysicalBound]
    ) -> Linearisation:
        left = Remaining.of(point, others, point.evidence.forms(others))
        orders, power, apart = order_spectrum(ResidualView.of(point.fit.posterior, left.residual), point.fit, effect)
        if not len(orders):
            return point
        cause = next(cause for cause in point.bank.causes if cause.name == effect.label)
        signatures: list[Signatures] = []
        forms = [cause.groups]
        for first in _peaks(orders, power):
            order, reach = float(orders[first]), 1.0 / apart
            for _ in range(ROUNDS):
                tried = order + reach * np.arange(-POINTS, POINTS + 1) / POINTS
                order = max(map(float, tried), key=lambda one: _gain(point, effect, left, one))
                reach /= POINTS
            lines = _line(point.perturbed, point.fit, effect, order)
            signatures += lines.values()
            forms.append(_groups(lines, bounds))
        share = (1.0 - SHARE) / max(apart * (HIGHEST - LOWEST), 1.0)
        tuned = replace(cause, others=tuple(forms[1:]), shares=(SHARE, *(share,) * (len(forms) - 1)))
        kept = [one for one in point.bank.signatures if not _is_line(one, effect) or one.order == 1.0]
        causes = tuple(tuned if one is cause else one for one in point.bank.causes)
        return point.with_bank(replace(point.bank, signatures=(*kept, *signatures), causes=causes))


def order_spectrum(view: ResidualView, fit: Fit, effect: WheelImbalance) -> tuple[Floats, Floats, float]:
    """Return orders (n,), the power of a residual at each, (n,), and how many orders per one can be told apart.

    Every channel is weighed with the square of the wheel's speed, as the force of an imbalance is, under a Hann window,
    and summed against the angle; white noise gives each order a power of two per channel and recording on average.
    There are no orders where the wheel hardly turns.

    Parameters
    ----------
    view : ResidualView
    fit : Fit
        Whose trajectory has the wheel's angle.
    effect : WheelImbalance
    """
    course = np.asarray(fit.operating.sample.environment.wheels)[:, :, effect.index]
    angles, speeds = course[..., 0], course[..., 1]
    times = np.asarray(fit.operating.sample.environment.time)
    turned = max(float(np.ptp(angle)) for angle in angles)
    apart = turned / (2.0 * np.pi)
    if apart < 1.0:
        return np.zeros(0), np.zeros(0), apart
    count = 1 << int(np.ceil(np.log2(OVERSAMPLED * 2.0 * HIGHEST * apart)))
    width = OVERSAMPLED * turned / count
    power = np.zeros(count // 2)
    for r, whitening in enumerate(fit.posterior.whitenings):
        rows, known = fit.posterior.data.times(r)[whitening.rows], times[r]
        angle, speed = np.interp(rows, known, angles[r]), np.interp(rows, known, speeds[r])
        place = np.rint((angle - angles[r].min()) / width).astype(int) % count
        window = np.hanning(len(rows) + 2)[1:-1]
        for channel in range(view.values.shape[2]):
            there = view.mask[r, : len(rows), channel]
            weight = window * np.abs(speed) ** 2 * there
            if not weight.any():
                continue
            binned = np.bincount(place, weight * view.values[r, : len(rows), channel], minlength=count)
            power += 2.0 * np.abs(np.fft.rfft(binned)[: len(power)]) ** 2 / (weight**2).sum()
    orders = np.arange(len(power)) / (OVERSAMPLED * apart)
    fastest = [float(np.abs(speed).max()) * step / np.pi for speed, step in zip(speeds, _steps(fit), strict=True)]
    within = (orders >= LOWEST) & (orders <= min(HIGHEST, 1.0 / max(min(fastest), 1e-12)))
    return orders[within], power[within], apart


def _steps(fit: Fit) -> list[float]:
    """Return the median interval between the samples of each recording [s]."""
    return [float(np.median(np.diff(fit.posterior.data.times(r)))) for r in range(len(fit.posterior.manoeuvres))]


def _peaks(orders: Floats, power: Floats) -> list[int]:
    """Return the places of the strongest orders that are not beside a stronger one."""
    chosen: list[int] = []
    for place in np.argsort(-power).tolist():
        if all(abs(place - other) > 3 * OVERSAMPLED for other in chosen):
            chosen.append(place)
        if len(chosen) == STRONGEST:
            break
    return chosen


def _line(perturbed: PerturbedModel, fit: Fit, effect: Effect, order: float) -> dict[str, Signatures]:
    """Return the signatures of a line by the units of its amplitudes."""
    assert isinstance(effect, WheelImbalance)
    recordings = len(fit.posterior.manoeuvres)
    at = effect.with_order(order)
    (columns,) = perturbed.columns([(at, np.zeros(recordings * len(at.parameters)))], fit.operating, fit.z, fit.data)
    by_unit = amplitude_signatures(at, columns, recordings)
    return {
        unit: replace(line, name=f"{effect.label} of order {order:.8g} [{unit}]", order=order)
        for unit, line in by_unit.items()
    }


def _is_line(signatures: Signatures, effect: Effect) -> bool:
    return signatures.name.startswith(f"{effect.label} of order ")


def _groups(lines: dict[str, Signatures], bounds: Sequence[PhysicalBound]) -> tuple[AmplitudeGroup, ...]:
    sizes = {bound.unit: bound.largest for bound in bounds}
    return tuple(AmplitudeGroup(line.name, sizes[unit]) for unit, line in lines.items())


def _gain(point: Linearisation, effect: Effect, left: Remaining, order: float) -> float:
    """Return by how much the line of an order lowers what the other causes leave, in twice the log likelihood."""
    lines = _line(point.perturbed, point.fit, effect, order)
    columns = np.concatenate([line.columns for line in lines.values()], axis=1)
    columns = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    gram = left.gram(columns, "line")
    return float(gram.score @ np.linalg.solve(gram.matrix + 1e-6 * np.eye(len(gram.matrix)), gram.score))
