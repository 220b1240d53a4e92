"""Fit of named causes with the catalogue's effects themselves, from what the Gram says of them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import jax.numpy as jnp
import numpy as np

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.diagnosis.candidates.initial_rate_signatures import INITIAL_RATE
from bayesid.diagnosis.candidates.vibration_signatures import coupling_matrix, slosh_entries
from bayesid.diagnosis.evidence.amplitude_posterior import AmplitudePosterior
from bayesid.diagnosis.noise.noise_states import NoiseState
from bayesid.diagnosis.response.effect_functions import physical
from bayesid.diagnosis.response.perturbed_model import Fit
from bayesid.diagnosis.search.hypothesis import Hypothesis
from bayesid.diagnosis.search.linearisation import Linearisation
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.mass_shift import MassShift
from bayesid.simulation.instant import Resonance

__all__ = ["fit_hypothesis"]

MOST_STARTS = 6
"""Most starting points of one fit."""

LIGHTEST = 0.25
"""Smallest share of a mode's mass that the yielding of the base is taken to leave at the start of a fit."""


def fit_hypothesis(
    state: NoiseState, causes: Sequence[str], effects: Sequence[Effect], hopeless: float = np.inf
) -> Hypothesis:
    """Fit the present model with some causes.

    Parameters
    ----------
    state : NoiseState
        With the fault of the noise that is among the causes, if any.
    causes : sequence of str
        Names of effects, of the initial rate and of the fault.
    effects : sequence of Effect
        Candidates of the catalogue.
    hopeless : float
        Cost at which a fit that nears its end is given up.

    Raises
    ------
    InputError
        If no start of the fit has a motion.
    """
    point, names = state.point, [name for name in causes if name not in state.names]
    wanted = [effect for effect in effects if effect.label in names]
    chosen = [_settled(effect, point, names) for effect in wanted]
    perturbed = point.perturbed.released() if INITIAL_RATE in names else point.perturbed
    z = point.fit.z.copy()
    if INITIAL_RATE in names:
        z[point.perturbed.frozen] = perturbed.posterior.starting_point()[point.perturbed.frozen]
    nearby = point.holding_bodies() if point.far else point  # about large causes free bodies would take their place
    starts = [_starts(effect, nearby, names) for effect in wanted]
    along = point.fit.operating if point.far else None
    best: Fit | None = None
    problem: InputError | None = None
    for start in list(product(*starts))[:MOST_STARTS]:
        try:
            fit = perturbed.fit(chosen, start, z=z, operating=along, hopeless=hopeless)
        except InputError as error:  # no motion from this start
            problem = error
            continue
        if best is None or fit.cost < best.cost:
            best = fit
    if best is None:
        raise problem if problem is not None else InputError("a hypothesis cannot be fitted", remedy="Name another")
    return Hypothesis(perturbed, best, state.faults)


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
    forms = point.evidence.forms(names)
    group = point.evidence.causes[effect.label].variants[forms[effect.label]].groups[0].name
    tone = next(item.tone for item in point.bank.signatures if item.name == group)
    frequency, damping = (0.1, 0.01) if tone is None else tone
    coupling = coupling_matrix(entries)
    (start,) = effect.starts_near([Resonance(frequency, coupling, damping)], False)
    held = frequency * _held_to_free(effect, start, point)
    return effect.starts_near([Resonance(held, coupling, damping)], False)


def _held_to_free(effect: Effect, start: Floats, point: Linearisation) -> float:
    """Return the frequency of a vibration with the base held, relative to the tone that is seen with the base free.

    The base yields to the spring, as if the modes were lighter by their coupling through the base's compliance.
    """
    modes = effect.modes(jnp.asarray(physical(effect, start)))
    coupling = np.concatenate([np.asarray(modes.linear), np.asarray(modes.angular)], axis=-1)
    compliance = point.fit.operating.vibration.compliance.mean(axis=(0, 1))
    lighter = np.linalg.eigvalsh(np.eye(len(coupling)) - coupling @ compliance @ coupling.T)
    return float(np.sqrt(np.clip(lighter, LIGHTEST, 1.0).mean()))


def _settled(effect: Effect, point: Linearisation, names: Sequence[str]) -> Effect:
    """Return an effect with what its most probable form settles: the instant of a jump."""
    if not isinstance(effect, MassShift):
        return effect
    form = point.evidence.forms(names)[effect.label]
    group = point.evidence.causes[effect.label].variants[form].groups[0].name
    instants = next(item.instants for item in point.bank.signatures if item.name == group)
    assert instants is not None
    return MassShift(instants).attach(point.perturbed.posterior.model.robot)


def _amplitudes(label: str, point: Linearisation, names: Sequence[str]) -> Floats:
    """Return the mean amplitudes of one cause beside the others of a set, in the order of its columns."""
    free = [name for name in names if not point.evidence.causes[name].fixed]
    posterior = AmplitudePosterior.of(point.evidence, free)
    forms = point.evidence.forms(free)
    groups = point.evidence.causes[label].variants[forms[label]].groups
    mean = posterior.mean
    return np.concatenate([mean[posterior.amplitudes[label, group.name]] for group in groups])
