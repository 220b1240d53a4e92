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

import jax.numpy as jnp
import numpy as np

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats, Integers
from bayesid.diagnosis.candidates.catalogue_signatures import group_names
from bayesid.diagnosis.candidates.initial_rate_signatures import INITIAL_RATE
from bayesid.diagnosis.candidates.vibration_signatures import coupling_matrix, slosh_entries
from bayesid.diagnosis.evidence.amplitude_posterior import AmplitudePosterior
from bayesid.diagnosis.evidence.gram import GaussianBlock
from bayesid.diagnosis.noise.noise_fault import FittedFault
from bayesid.diagnosis.response.effect_functions import physical
from bayesid.diagnosis.response.perturbed_model import CLOSE, Fit, PerturbedModel
from bayesid.diagnosis.search.linearisation import Linearisation
from bayesid.diagnosis.settings import DEFAULT_SETTINGS
from bayesid.inference.mode import fit as fit_mode
from bayesid.inference.noise_changes import without_left_out
from bayesid.inference.posterior import Posterior
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.mass_shift import MassShift
from bayesid.simulation.instant import Resonance
from bayesid.simulation.joint_torques import TorqueSensor

__all__ = [
    "Hypothesis",
    "exactly_fitted",
    "extended_posterior",
    "extended_start",
    "fit_hypothesis",
    "fit_in_amplitudes",
]

MOST_STARTS = 6
"""Most starting points of the fit of a hypothesis."""

ROUNDS = 6
"""Simulations after which motion and perturbations agree at given unknowns."""

LIGHTEST = 0.25
"""Smallest share of a mode's mass that the compliance of the base is taken to leave at the start of a fit."""


@dataclass(frozen=True)
class Hypothesis:
    """The present model with some causes added, fitted.

    Attributes
    ----------
    perturbed : PerturbedModel
        Whose noise has the faults.
    fit : Fit
    faults : tuple of FittedFault
    """

    perturbed: PerturbedModel
    fit: Fit
    faults: tuple[FittedFault, ...] = ()

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of its causes."""
        released = (INITIAL_RATE,) if len(self.fit.released) else ()
        return (*(effect.candidate for effect in self.fit.effects), *released, *(fault.label for fault in self.faults))


def fit_in_amplitudes(
    point: Linearisation,
    effects: Sequence[Effect],
    released: bool = False,
    restart_from: float = DEFAULT_SETTINGS.restart_from,
) -> tuple[Fit, float]:
    """Fit causes that are linear in their amplitudes, with all unknowns and the scales that the Gram finds likeliest.

    Where the fit does not end where the linear model says, it is started from the prior's centre as well, since the
    unknowns of the present model may have strayed too far to imitate what it lacks.

    Parameters
    ----------
    point : Linearisation
        From whose Gram the scales and the start follow.
    effects : sequence of Effect
        The causes, none of which vibrates.
    released : bool
        Whether the initial rates that the study takes to be zero are among the causes.
    restart_from : float
        Difference from the predicted cost beyond which the fit is started anew [nats].

    Returns
    -------
    fit : Fit
        With the effects in amplitudes; released rates are no unknowns of it, but keep their values.
    expected : float
        Cost that the linear model predicts for it: where both agree, the linear evidence holds.
    """
    evidence = point.evidence
    names = sorted([*(effect.label for effect in effects), *([INITIAL_RATE] if released else [])])
    columns, deviations = evidence.most_probable(names, evidence.forms(names))
    mean, gain = _mode(point, names, columns, deviations)
    scaled, start = [], []
    sizes = dict(zip(columns.tolist(), zip(deviations, mean, strict=True), strict=True))
    for effect in effects:
        linear = copy.copy(effect.in_amplitudes())
        if linear.parameters:
            places = _places(linear, effect, evidence.gram.groups)
            count = len(linear.parameters)
            sigma = np.array([sizes[place][0] for place in places])
            linear.parameters = tuple(
                parameter._replace(sigma=float(own), mean=0.0)
                for parameter, own in zip(linear.parameters, sigma[:count], strict=True)
            )
            start.append(np.array([sizes[place][1] for place in places]) / sigma)
        else:
            start.append(np.zeros(0))
        scaled.append(linear)
    perturbed, z = _freed(point, released)
    frozen = point.perturbed.frozen
    expected = point.predicted_cost - gain
    fit = perturbed.fit(scaled, start, z=z, operating=None if released else point.fit.operating)
    if abs(fit.cost - expected) > restart_from and not point.far:  # far from the data no fit finds them from the centre
        fresh = perturbed.fit(scaled, [np.zeros_like(own) for own in start])
        fit = fresh if fresh.cost < fit.cost else fit
    if not released:
        return fit, expected
    known = np.delete(fit.own, np.searchsorted(perturbed.free, frozen), axis=1)
    return replace(fit, own=known, released=np.zeros(0, dtype=int), frozen=frozen), expected


def _freed(point: Linearisation, released: bool) -> tuple[PerturbedModel, Floats]:
    """Return the perturbed model and the unknowns to start from, with or without the initial rates freed."""
    perturbed, z, frozen = point.perturbed, point.fit.z.copy(), point.perturbed.frozen
    if released:
        perturbed = perturbed.released()
        z[frozen] = perturbed.posterior.starting_point()[frozen]
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
            own = gram.groups[evidence.causes[name].groups[0].name]
            gain -= float(gram.score[own].sum() + 0.5 * gram.matrix[np.ix_(own, own)].sum())
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
        If no start of the fit has a motion.
    """
    faulty = {fault.label for fault in faults}
    names = [name for name in causes if name not in faulty]
    named = [effect for effect in effects if effect.label in names]
    chosen = [_with_instants(effect, point, names) for effect in named]
    perturbed, z = _freed(point, INITIAL_RATE in names)
    nearby = point.with_bodies_fixed() if point.far else point  # about large causes free bodies would take their place
    starts = [_starts(effect, nearby, names) for effect in named]
    along = point.fit.operating if point.far else None
    best: Fit | None = None
    problem = InputError("a hypothesis cannot be fitted", remedy="Name another")
    for start in list(product(*starts))[:MOST_STARTS]:
        try:
            fit = perturbed.fit(chosen, start, z=z, operating=along, hopeless=hopeless)
        except InputError as error:  # no motion from this start
            problem = error
            continue
        if best is None or fit.cost < best.cost:
            best = fit
    if best is None:
        raise problem
    return Hypothesis(perturbed, best, tuple(faults))


def _starts(effect: Effect, point: Linearisation, names: Sequence[str]) -> Sequence[Floats]:
    """Return starting points of one effect beside the others of a set."""
    if not effect.modes_count:
        linear = effect.in_amplitudes()
        if linear is effect and effect.parameters:
            mean = _amplitudes(effect.label, point, names)  # recording after recording, where each has its own
            return [mean / np.resize([parameter.sigma for parameter in effect.parameters], mean.shape)]
        return effect.starts
    amplitudes = _amplitudes(effect.label, point, names)
    entries = slosh_entries() @ amplitudes if len(amplitudes) == slosh_entries().shape[1] else amplitudes
    tone = next(item.tone for item in point.bank.signatures if item.name == _first_group(effect, point, names))
    frequency, damping = (0.1, 0.01) if tone is None else tone
    coupling = coupling_matrix(entries)
    (start,) = effect.starts_near([Resonance(frequency, coupling, damping)], False)
    fixed_base = frequency * _fixed_to_free(effect, start, point)
    return effect.starts_near([Resonance(fixed_base, coupling, damping)], False)


def _fixed_to_free(effect: Effect, start: Floats, point: Linearisation) -> float:
    """Return the frequency of a vibration with the base fixed, relative to that which is seen with the base free.

    The base yields to the spring, as if the modes were lighter by their coupling through the base's compliance.
    """
    modes = effect.modes(jnp.asarray(physical(effect, start)))
    coupling = np.concatenate([np.asarray(modes.linear), np.asarray(modes.angular)], axis=-1)
    compliance = point.fit.operating.vibration.compliance.mean(axis=(0, 1))
    lighter = np.linalg.eigvalsh(np.eye(len(coupling)) - coupling @ compliance @ coupling.T)
    return float(np.sqrt(np.clip(lighter, LIGHTEST, 1.0).mean()))


def _with_instants(effect: Effect, point: Linearisation, names: Sequence[str]) -> Effect:
    """Return a jump at the instants of its most probable form; other effects as they are."""
    if not isinstance(effect, MassShift):
        return effect
    group = _first_group(effect, point, names)
    instants = next(item.instants for item in point.bank.signatures if item.name == group)
    assert instants is not None
    return MassShift(instants).attach(point.perturbed.posterior.model.robot)


def _first_group(effect: Effect, point: Linearisation, names: Sequence[str]) -> str:
    """Return the name of the first group of amplitudes in an effect's most probable form beside others."""
    form = point.evidence.forms(names)[effect.label]
    return point.evidence.causes[effect.label].variants[form].groups[0].name


def _amplitudes(label: str, point: Linearisation, names: Sequence[str]) -> Floats:
    """Return the mean amplitudes of one cause beside the others of a set, in the order of its columns."""
    free = [name for name in names if not point.evidence.causes[name].fixed]
    posterior = AmplitudePosterior.of(point.evidence, free)
    forms = point.evidence.forms(free)
    groups = point.evidence.causes[label].variants[forms[label]].groups
    return np.concatenate([posterior.mean[posterior.amplitudes[label, group.name]] for group in groups])


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
    model = replace(fit.posterior.model, torque=torque)
    for effect in (*(effect.tuned(fit.values(index)) for index, effect in enumerate(fit.effects)), *added):
        model = model.extend(effect)
    if hypothesis.perturbed.frozen.size:
        model = replace(model, rate_sigma=0.0)
    return Posterior.of(model, without_left_out(fit.posterior))


def extended_start(hypothesis: Hypothesis, posterior: Posterior) -> Floats:
    """Mode of a hypothesis in the coordinates of its own posterior."""
    fit = hypothesis.fit
    z = np.delete(fit.z, hypothesis.perturbed.frozen)
    return np.concatenate([z, *fit.coordinates]) if posterior.size else np.zeros(0)


def exactly_fitted(hypothesis: Hypothesis) -> Hypothesis:
    """Return a hypothesis at the mode of its own simulation, or as it is where that is worse or does not exist."""
    found = hypothesis.fit
    try:
        posterior = extended_posterior(hypothesis)
    except InputError:  # no motion at the prior's centre of the extended model
        return hypothesis
    if posterior.residual_shape != found.posterior.residual_shape:  # outliers left out: derivatives have other rows
        return hypothesis
    mode = fit_mode(posterior, extended_start(hypothesis, posterior)).z
    free = len(found.own_coordinates)
    ends = np.cumsum([free, *(own.size for own in found.coordinates)])
    coordinates = [mode[first:last] for first, last in pairwise(ends)]
    z = found.z.copy()
    z[np.setdiff1d(np.arange(len(z)), found.frozen)] = mode[:free]
    perturbed, operating = hypothesis.perturbed, found.operating
    for _ in range(ROUNDS):
        exact = perturbed.fit(found.effects, coordinates, z=z, operating=operating, iterations=0)
        operating = perturbed.operating(z, perturbed.pushes(found.effects, coordinates, operating, vibrations=False))
    if exact.cost > found.cost + CLOSE:
        return hypothesis
    columns = posterior.jacobian(mode)[: exact.residual.size]
    own, *added = np.split(columns, ends[:-1], axis=1)
    return replace(hypothesis, fit=replace(exact, own=own, added=tuple(added)))
