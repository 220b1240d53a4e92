"""Fit of a named set of causes: in their amplitudes, as the Gram sees them, or with the catalogue's effects.

Both fits start from what the Gram says of the causes; the first keeps its scales, the second their priors. They perturb
one compiled simulation along the motion of the last fit. What an unknown of the model changes in a perturbation through
the motion is left out of their derivatives, which moves their end where a cause is as large as a wheel that turns the
base by radians. The extended model's own simulation has all derivatives.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, product

import numpy as np

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats, Integers
from bayesid.diagnosis.candidates.cause_kind import cause_kinds, kind_of
from bayesid.diagnosis.candidates.linear_cause import group_names
from bayesid.diagnosis.candidates.linear_model import Linearisation
from bayesid.diagnosis.evidence.gram import GaussianBlock
from bayesid.diagnosis.noise.noise_fault import FittedFault
from bayesid.diagnosis.response.perturbed_model import CLOSE, Fit, PerturbedModel
from bayesid.diagnosis.settings import DEFAULT_SETTINGS
from bayesid.inference.mode import fit as fit_mode
from bayesid.inference.noise_changes import without_left_out
from bayesid.inference.posterior import Posterior
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.joint_torques import TorqueSensor

__all__ = [
    "Hypothesis",
    "exactly_fitted",
    "extended_posterior",
    "extended_start",
    "fit_hypothesis",
    "fit_in_amplitudes",
    "gain_beyond_linear",
]

MOST_STARTS = 6
"""Most starting points of the fit of a hypothesis."""

WIDER = 30.0
"""Factor on the priors of a fit that is to show what the data alone say of its causes."""

ROUNDS = 6
"""Simulations after which motion and perturbations agree at given unknowns."""


@dataclass(frozen=True)
class Hypothesis:
    """The present model with some causes added, fitted.

    Attributes
    ----------
    perturbed : PerturbedModel
        Model whose noise includes the faults.
    fit : Fit
    faults : tuple of FittedFault
    """

    perturbed: PerturbedModel
    fit: Fit
    faults: tuple[FittedFault, ...] = ()

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of its causes."""
        effects = (effect.candidate for effect in self.fit.effects)
        others = (label for kind in cause_kinds() for label in kind.labels(self.fit))
        return (*effects, *others, *(fault.label for fault in self.faults))


def fit_in_amplitudes(
    point: Linearisation,
    causes: Sequence[str],
    effects: Sequence[Effect],
    restart_from: float = DEFAULT_SETTINGS.restart_from,
) -> tuple[Fit, float]:
    """Fit causes that are linear in their amplitudes, with all unknowns and the scales that the Gram finds likeliest.

    Where the fit does not end where the linear model says, it is started from the prior's centre as well, since the
    unknowns of the present model may have strayed too far to imitate what it lacks.

    Parameters
    ----------
    point : Linearisation
        From whose Gram the scales and the start follow.
    causes : sequence of str
        Causes of kinds that have one form.
    effects : sequence of Effect
        Candidates of the catalogue.
    restart_from : float
        Difference from the predicted cost beyond which the fit is started anew [nats].

    Returns
    -------
    fit : Fit
        With the effects in amplitudes; unknowns that a cause released are frozen again, but keep their values.
    expected : float
        Cost that the linear model predicts for it: where both agree, the linear evidence holds.
    """
    evidence = point.evidence
    names = sorted(causes)
    columns, deviations = evidence.most_probable(names, evidence.forms(names))
    mean, gain = _mode(point, names, columns, deviations)
    scaled, start = [], []
    sizes = dict(zip(columns.tolist(), zip(deviations, mean, strict=True), strict=True))
    for effect in effects:
        if effect.label not in names:
            continue
        linear = copy.copy(effect.in_amplitudes())
        if linear.parameters:
            places = _places(linear, effect, evidence.gram.groups)
            count = len(linear.parameters)
            sigma = np.array([sizes[place][0] for place in places])
            linear.parameters = tuple(
                parameter._replace(sigma=float(deviation), mean=0.0)
                for parameter, deviation in zip(linear.parameters, sigma[:count], strict=True)
            )
            start.append(np.array([sizes[place][1] for place in places]) / sigma)
        else:
            start.append(np.zeros(0))
        scaled.append(linear)
    perturbed, z = _prepared(point, names)
    same, frozen = perturbed is point.perturbed, point.perturbed.frozen
    expected = point.predicted_cost - gain
    fit = perturbed.fit(scaled, start, z=z, operating=point.fit.operating if same else None)
    if abs(fit.cost - expected) > restart_from and not point.far:  # far from the data no fit finds them from the centre
        fresh = perturbed.fit(scaled, [np.zeros_like(amplitudes) for amplitudes in start])
        fit = fresh if fresh.cost < fit.cost else fit
    if same:
        return fit, expected
    known = np.delete(fit.own, np.searchsorted(perturbed.free, frozen), axis=1)
    return replace(fit, own=known, released=np.zeros(0, dtype=int), frozen=frozen), expected


def _prepared(point: Linearisation, names: Sequence[str]) -> tuple[PerturbedModel, Floats]:
    """Return the model that is fitted with some causes, and the unknowns to start from."""
    perturbed, z = point.perturbed, point.fit.z
    for kind in cause_kinds():
        perturbed, z = kind.prepared(perturbed, z, names)
    return perturbed, z


def _places(linear: Effect, effect: Effect, groups: Mapping[str, Integers]) -> list[int]:
    """Return the columns of the Gram of each amplitude, recording after recording."""
    names = group_names(effect)
    waiting = {name: list(map(int, groups[name])) for name in set(names.values())}
    total = sum(len(columns) for columns in waiting.values())
    units = np.resize([parameter.unit for parameter in linear.parameters], total)
    return [waiting[names[str(unit)]].pop(0) for unit in units]


def _mode(point: Linearisation, names: Sequence[str], columns: Integers, deviations: Floats) -> tuple[Floats, float]:
    """Return the amplitudes at the mode, given their scales, and the decrease of the cost that they bring."""
    evidence = point.evidence
    gram, score = evidence.gram, evidence.score_beside(names)
    gain = 0.0
    for name in names:
        if evidence.causes[name].fixed:
            places = gram.groups[evidence.causes[name].groups[0].name]
            gain -= float(gram.score[places].sum() + 0.5 * gram.matrix[np.ix_(places, places)].sum())
    if not len(columns):
        return np.zeros(0), gain
    block = GaussianBlock.of(gram.matrix[np.ix_(columns, columns)], deviations)
    pull = block.share(score[columns])
    return block.mean(score[columns]), gain + 0.5 * float(pull @ pull)


def fit_hypothesis(
    point: Linearisation,
    faults: Sequence[FittedFault],
    causes: Sequence[str],
    effects: Sequence[Effect],
    hopeless: float = np.inf,
) -> Hypothesis:
    """Fit the present model with some causes of the catalogue.

    Parameters
    ----------
    point : Linearisation
        Under the noise that has the faults among the causes.
    faults : sequence of FittedFault
    causes : sequence of str
        Names of effects, of the initial rate and of the faults.
    effects : sequence of Effect
        Candidates of the catalogue.
    hopeless : float
        Cost at which a fit that nears its end is given up.

    Raises
    ------
    InputError
        If no start of the fit has a motion with finite derivatives.
    """
    faulty = {fault.label for fault in faults}
    names = [name for name in causes if name not in faulty]
    named = [effect for effect in effects if effect.label in names]
    chosen = [kind_of(effect).with_form(effect, point, names) for effect in named]
    perturbed, z = _prepared(point, names)
    nearby = point.with_bodies_fixed() if point.far else point  # about large causes free bodies would take their place
    starts = [kind_of(effect).starts(effect, nearby, names) for effect in named]
    along = point.fit.operating if point.far else None
    best: Fit | None = None
    problem = InputError("a hypothesis cannot be fitted", remedy="Name another")
    for start in list(product(*starts))[:MOST_STARTS]:
        try:
            fit = perturbed.fit(chosen, start, z=z, operating=along, hopeless=hopeless)
        except InputError as error:  # no motion from this start
            problem = error
            continue
        if np.isfinite(fit.cost) and (best is None or fit.cost < best.cost):
            best = fit
    if best is None:
        raise problem
    return Hypothesis(perturbed, best, tuple(faults))


def gain_beyond_linear(point: Linearisation, hypothesis: Hypothesis, agrees: float = DEFAULT_SETTINGS.agrees) -> float:
    """Return by how much the full fit of some causes follows the data better than the linear model says [nats].

    Both are compared without the priors of the causes' sizes, which differ. Where the fit seems worse, it is repeated
    with priors so wide that they pull at nothing: what is left is what the linear model allows and physics does not,
    such as a spring with a negative stiffness.

    Parameters
    ----------
    point : Linearisation
        From which the causes were fitted (`fit_hypothesis`).
    hypothesis : Hypothesis
        All of whose causes are effects or faults of the noise.
    agrees : float
        Difference that is none [nats].
    """
    fit = hypothesis.fit
    names = sorted(effect.candidate for effect in fit.effects)
    columns, deviations = point.evidence.most_probable(names, point.evidence.forms(names))
    mean, gain = _mode(point, names, columns, deviations)
    linear = point.predicted_cost - gain - 0.5 * float(((mean / deviations) ** 2).sum())

    def misfit(of: Fit) -> float:
        return of.cost - 0.5 * sum(float((values**2).sum()) for values in of.coordinates)

    if misfit(fit) - linear > agrees:
        wide, start = [], []
        for effect, values in zip(fit.effects, fit.coordinates, strict=True):
            wider = copy.copy(effect)
            wider.parameters = tuple(one._replace(sigma=WIDER * one.sigma) for one in effect.parameters)
            wide.append(wider)
            start.append(values / WIDER)
        along = fit.operating if point.far else None
        again = hypothesis.perturbed.fit(wide, start, z=fit.z, operating=along)
        fit = again if misfit(again) < misfit(fit) else fit
    better = linear - misfit(fit)
    return better if abs(better) > agrees and np.isfinite(better) else 0.0


def extended_posterior(
    hypothesis: Hypothesis, *, torque: TorqueSensor | None = None, added: Sequence[Effect] = ()
) -> Posterior:
    """Build the posterior of a hypothesis, its effects in the simulation itself.

    Parameters
    ----------
    hypothesis : Hypothesis
    torque : TorqueSensor, optional
        Sensors of the joints' torques, which a hypothesis of a diagnosis has not.
    added : sequence of Effect
        Further effects, whose coordinates are the last.

    Raises
    ------
    InputError
        If one of its effects is not carried into the torques.
    """
    fit = hypothesis.fit
    complete = not any(mask.any() for mask in fit.posterior.data.left_out)
    if complete and torque is None and not (fit.effects or added or hypothesis.perturbed.frozen.size):
        return fit.posterior
    model = replace(fit.posterior.model, torque=torque)
    for effect in (*(effect.tuned(fit.values(index)) for index, effect in enumerate(fit.effects)), *added):
        model = model.extend(effect)
    if hypothesis.perturbed.frozen.size:
        model = replace(model, rate_sigma=0.0)
    return Posterior.of(model, without_left_out(fit.posterior))


def extended_start(hypothesis: Hypothesis, posterior: Posterior) -> Floats:
    """Mode of a hypothesis in the coordinates of its own posterior.

    Parameters
    ----------
    hypothesis : Hypothesis
    posterior : Posterior
        Of the hypothesis (`extended_posterior`).
    """
    fit = hypothesis.fit
    z = np.delete(fit.z, hypothesis.perturbed.frozen)
    return np.concatenate([z, *fit.coordinates]) if posterior.size else np.zeros(0)


def exactly_fitted(hypothesis: Hypothesis) -> Hypothesis:
    """Return a hypothesis at the mode of its own simulation, or as it is where that is worse or does not exist."""
    start = hypothesis.fit
    try:
        posterior = extended_posterior(hypothesis)
    except InputError:  # no motion at the prior's centre of the extended model
        return hypothesis
    if posterior.residual_shape != start.posterior.residual_shape:  # outliers left out: derivatives have other rows
        return hypothesis
    mode = fit_mode(posterior, extended_start(hypothesis, posterior)).z
    free = len(start.own_coordinates)
    ends = np.cumsum([free, *(values.size for values in start.coordinates)])
    coordinates = [mode[first:last] for first, last in pairwise(ends)]
    z = start.z.copy()
    z[np.setdiff1d(np.arange(len(z)), start.frozen)] = mode[:free]
    perturbed, operating = hypothesis.perturbed, start.operating
    for _ in range(ROUNDS):
        exact = perturbed.fit(start.effects, coordinates, z=z, operating=operating, iterations=0)
        operating = perturbed.operating(z, perturbed.pushes(start.effects, coordinates, operating, vibrations=False))
    if exact.cost > start.cost + CLOSE:
        return hypothesis
    columns = posterior.jacobian(mode)[: exact.residual.size]
    columns_of_model, *added = np.split(columns, ends[:-1], axis=1)
    return replace(hypothesis, fit=replace(exact, own=columns_of_model, added=tuple(added)))
