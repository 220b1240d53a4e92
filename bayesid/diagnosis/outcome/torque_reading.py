"""What recorded joint torques say, read once the motion has its verdict.

Friction of a joint, and a constant error of its torque sensor, change the torques and nothing else, since the motion of
the joints is measured. Motion and torques are therefore fitted together with the causes that the motion has named, and
what acts on the torques is weighed beside that fit, in which it is linear: by the evidence of its Gram, as are the
causes of the motion, with an unknown torque of each joint as the candidate that names nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.diagnosis.candidates.generic_cause import error_signatures
from bayesid.diagnosis.candidates.linear_cause import amplitude_signatures
from bayesid.diagnosis.candidates.linear_model import SignatureBank, SignatureProducts
from bayesid.diagnosis.evidence.amplitude_posterior import AmplitudePosterior
from bayesid.diagnosis.evidence.cause_sets import CausePrior, SetProbabilities, enumerate_sets
from bayesid.diagnosis.evidence.evidence_alarm import EvidenceAlarm
from bayesid.diagnosis.evidence.gram import GaussianBlock
from bayesid.diagnosis.evidence.scales import AmplitudeGroup, CandidateCause
from bayesid.diagnosis.evidence.set_evidence import SetEvidence
from bayesid.diagnosis.evidence.verdict import UNKNOWN, ProbableVerdict, Rest, Status, probable_verdict
from bayesid.diagnosis.search.fitted_set import Hypothesis, extended_posterior, extended_start
from bayesid.diagnosis.settings import DEFAULT_SETTINGS, DiagnosisSettings
from bayesid.inference.mode import fit
from bayesid.inference.posterior import Posterior
from bayesid.inference.residual_view import ResidualView
from bayesid.simulation.effects import PhysicalBound, bounds_by_label
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import Quantity
from bayesid.simulation.effects.register import known_effects
from bayesid.simulation.model import Model

__all__ = ["TorqueCause", "TorqueReading", "TorquesNotRead", "read_torques", "torque_candidates", "torques_beside"]


@dataclass(frozen=True)
class TorqueCause:
    """One candidate that acts on the torques.

    Attributes
    ----------
    name : str
    probability : float
        Probability that it is at work, whatever accompanies it.
    quantities : tuple of Quantity
        Its amplitudes.
    mean, sd : arrays
        Of the amplitudes, given that it is at work together with all causes that the verdict names.
    """

    name: str
    probability: float
    quantities: tuple[Quantity, ...]
    mean: Floats
    sd: Floats


@dataclass(frozen=True)
class TorqueReading:
    """What the joint torques add to the verdict on the motion.

    Attributes
    ----------
    verdict : ProbableVerdict
        Of the torques alone; the causes that the motion has named are in the model.
    probabilities : SetProbabilities
    p_value : float
        Family-wise p-value of all candidates on the torques together.
    causes : tuple of TorqueCause
        Every candidate of the catalogue, the most probable first.
    chi2_per_sample : tuple of float
        Of the torques, without and with the causes that the verdict names.
    """

    verdict: ProbableVerdict
    probabilities: SetProbabilities
    p_value: float
    causes: tuple[TorqueCause, ...]
    chi2_per_sample: tuple[float, float]


@dataclass(frozen=True)
class TorquesNotRead:
    """Joint torques that were recorded but not evaluated.

    Attributes
    ----------
    reason : str
        The reason, as a sentence.
    """

    reason: str


def torques_beside(
    verdict: ProbableVerdict,
    hypothesis: Hypothesis,
    model: Model,
    prior: CausePrior,
    rng: np.random.Generator,
    bounds: Mapping[str, Sequence[PhysicalBound]] | None = None,
    settings: DiagnosisSettings = DEFAULT_SETTINGS,
) -> TorqueReading | TorquesNotRead:
    """Return what the joint torques say beside a verdict on the motion.

    Torques depend on the motion of the base. Where something without a name moves it, a torque that the model does not
    have would say no more than the motion did.

    Parameters
    ----------
    verdict : ProbableVerdict
        On the motion.
    hypothesis, model, prior, rng, bounds, settings : as for `read_torques`
    """
    nameless = any(UNKNOWN in names for names in verdict.ambiguous_with)
    open_question = verdict.status in (Status.UNKNOWN, Status.UNRESOLVED)
    if nameless or open_question or verdict.remainder.verdict is Rest.PRESENT:
        return TorquesNotRead("The motion contains something that has no name, and torques depend on the motion.")
    try:
        return read_torques(hypothesis, model, prior, rng, bounds, settings)
    except InputError as error:
        return TorquesNotRead(f"{error.problem[0].upper()}{error.problem[1:]}.")


@dataclass(frozen=True)
class _TorqueFit:
    """Motion and torques about their common fit, where no candidate acts on the torques.

    Attributes
    ----------
    posterior : Posterior
    residual : (N,) array
    own : (N, n) array
        Derivatives in all unknowns but the candidates'.
    own_coordinates : (n,) array
        Those unknowns.
    columns : (N, m) array
        Derivatives in the candidates' coordinates.
    """

    posterior: Posterior
    residual: Floats
    own: Floats
    own_coordinates: Floats
    columns: Floats

    @staticmethod
    def of(hypothesis: Hypothesis, model: Model, known: Sequence[Effect], candidates: Sequence[Effect]) -> _TorqueFit:
        """Fit motion and torques with all candidates, in which the residual is linear, and take these out again."""
        added = [*known, *(effect.in_amplitudes() for effect in candidates)]
        posterior = extended_posterior(hypothesis, torque=model.torque, added=added)
        start = extended_start(hypothesis, posterior)
        z = fit(posterior, np.concatenate([start, np.zeros(posterior.size - len(start))])).z
        residual = posterior.residuals(z).ravel()
        slopes = posterior.jacobian(z)[: len(residual)]
        last = posterior.size - sum(len(effect.in_amplitudes().parameters) for effect in candidates)
        columns = slopes[:, last:]
        return _TorqueFit(posterior, residual - columns @ z[last:], slopes[:, :last], z[:last], columns)

    def chi2_per_sample(self, change: Floats | float = 0.0) -> float:
        """Return chi-square per sample of the torques after a change of the residual, the unknowns fitted anew."""
        residual = self.residual + change
        unknowns = GaussianBlock.of(self.own.T @ self.own)
        step = unknowns.mean(self.own.T @ residual + self.own_coordinates)
        left = ResidualView.of(self.posterior, residual + self.own @ step)
        torques = self.posterior.model.channels.torques
        return float((left.values[..., torques] ** 2).sum()) / int(left.mask[..., torques].sum())


def torque_candidates(model: Model) -> list[Effect]:
    """Return every effect on the joint torques alone that the model does not have."""
    present = {effect.label for effect in model.effects}
    everywhere = [effect for kind in known_effects().values() for effect in kind.instances(model)]
    return [
        effect.attach(model.robot) for effect in everywhere if effect.uses("friction") and effect.label not in present
    ]


def read_torques(
    hypothesis: Hypothesis,
    model: Model,
    prior: CausePrior,
    rng: np.random.Generator,
    bounds: Mapping[str, Sequence[PhysicalBound]] | None = None,
    settings: DiagnosisSettings = DEFAULT_SETTINGS,
) -> TorqueReading:
    """Weigh what acts on the joint torques.

    Parameters
    ----------
    hypothesis : Hypothesis
        The extended model of the motion, or the present one where nothing is named.
    model : Model
        The model of the study, with the sensors of the torques and the effects on them that it knows of.
    prior : CausePrior
        Prior of the number of causes, and of something generic.
    rng : Generator
        For the p-value.
    bounds : mapping of str to sequence of PhysicalBound, optional
        Largest plausible size of each candidate, by default what the effects state.
    settings : DiagnosisSettings, optional

    Raises
    ------
    InputError
        If a cause of the motion is not carried into the torques.
    """
    known = [effect for effect in model.effects if effect.uses("friction")]
    candidates = torque_candidates(model)
    fitted = _TorqueFit.of(hypothesis, model, known, candidates)
    bank = _bank(fitted, candidates, bounds_by_label(candidates, model) if bounds is None else bounds)
    evidence = SetEvidence(SignatureProducts.of(bank.signatures, fitted).gram(), bank.causes)
    alarm = EvidenceAlarm.of(evidence, rng)
    probabilities = enumerate_sets(evidence, prior)
    silent = alarm.silent(settings.alarm_level)
    verdict = probable_verdict(probabilities, [(effect.label,) for effect in candidates], silent, settings)
    named = [name for name in verdict.causes if name in evidence.catalogue]
    change: Floats | float = 0.0
    if named:
        columns = {signature.name: signature.columns for signature in bank.signatures if signature.recording is None}
        posterior = AmplitudePosterior.of(evidence, named)
        change = sum(columns[group] @ posterior.mean[places] for (_, group), places in posterior.amplitudes.items())
    inclusion = probabilities.inclusion
    rows = [_cause(effect, inclusion[effect.label], named, evidence) for effect in candidates]
    return TorqueReading(
        verdict,
        probabilities,
        float(np.exp(alarm.log_p_value)),
        tuple(sorted(rows, key=lambda row: (-round(row.probability, 6), row.name))),
        (fitted.chi2_per_sample(), fitted.chi2_per_sample(change)),
    )


def _bank(
    fitted: _TorqueFit, candidates: Sequence[Effect], bounds: Mapping[str, Sequence[PhysicalBound]]
) -> SignatureBank:
    """Return the signatures of the candidates, and of an unknown torque of each joint."""
    sizes = [len(effect.in_amplitudes().parameters) for effect in candidates]
    ends = np.cumsum(sizes)
    banks = []
    for effect, size, end in zip(candidates, sizes, ends, strict=True):
        columns = fitted.columns[:, end - size : end]
        largest = {bound.unit: bound.largest for bound in bounds[effect.label]}
        signatures = amplitude_signatures(effect, columns, 1)
        groups = tuple(AmplitudeGroup(signature.name, largest[unit]) for unit, signature in signatures.items())
        banks.append(SignatureBank(tuple(signatures.values()), (CandidateCause(effect.label, groups),)))
    channels = fitted.posterior.model.channels
    for place, joint in enumerate(channels.joints, channels.torques.start):
        banks.append(error_signatures(fitted.posterior, f"torque of {joint}", slice(place, place + 1)))
    return SignatureBank.joined(banks)


def _cause(effect: Effect, probability: float, named: Sequence[str], evidence: SetEvidence) -> TorqueCause:
    """Return the row of one candidate."""
    posterior = AmplitudePosterior.of(evidence, sorted({*named, effect.label}))
    groups = evidence.causes[effect.label].groups
    places = np.concatenate([posterior.amplitudes[effect.label, group.name] for group in groups])
    spread = np.sqrt(np.diag(posterior.covariance)[places])
    return TorqueCause(effect.label, probability, tuple(effect.amplitude_quantities), posterior.mean[places], spread)
