"""The search for causes: which sets of effects and noise faults leave nothing but noise.

From the present model outwards: every candidate alone, then the best of them with one more, then with two more. The
gate is the calibrated test of what a fit leaves (`TestSuite`); evidence ranks what passes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import product

import numpy as np

from bayesid._io.errors import InputError
from bayesid._io.progress import Progress, silent
from bayesid._math.arrays import Floats
from bayesid.diagnosis.fit_starts import starts_of
from bayesid.diagnosis.noise_faults import NoiseFault, noise_fault, refined
from bayesid.diagnosis.perturbation import OperatingTrajectory
from bayesid.diagnosis.perturbed_fit import Engine, Fit
from bayesid.diagnosis.score_tests import chi2_log_sf
from bayesid.diagnosis.test_suite import FALSE_ALARM, SuiteOutcome, TestSuite
from bayesid.inference.noise_changes import relinearised
from bayesid.inference.posterior import Posterior
from bayesid.simulation.effects.effect import Effect

__all__ = ["CauseSearch", "Hypothesis"]

MOST_CAUSES = 3
BEAM = (4, 3)
"""Hypotheses carried on from one cause to two, and from two to three."""

TRIED = (12, 7, 5)
"""Additions tried to each hypothesis, by its number of causes."""

NEAR = 0.75
"""A candidate is worth a fit if it takes this share of what the best takes: what is left is significant otherwise."""

FAR = 2.5
"""Prior standard deviations from which a body's unknown may be imitating something; fits then also start at zero."""

BARELY, DECISIVE = 1e-3, 2.7
"""Causes that leave this much are given one more only if that makes them more probable by this logarithm."""

HOPELESS = -60.0
"""Logarithm of the p-value of what coloured noise leaves, below which its size is not refined."""

SPARE = 60.0
"""And whatever it takes, if less than this is left."""


class HypothesisKind(Enum):
    """Kinds of causes in the order in which they are tried: noise is blamed last."""

    FORCE = "effect without inner motion"
    VIBRATION = "hidden vibration"
    NOISE = "fault of the noise"


@dataclass(frozen=True)
class Hypothesis:
    """The present model with some causes added, fitted and tested.

    Attributes
    ----------
    engine : Engine
        Whose noise has the faults.
    fit : Fit
    faults : tuple of NoiseFault
    outcome : Outcome
    """

    engine: Engine
    fit: Fit
    faults: tuple[NoiseFault, ...]
    outcome: SuiteOutcome

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of its causes."""
        return tuple(effect.label for effect in self.fit.effects) + tuple(fault.label for fault in self.faults)

    @property
    def log_evidence(self) -> float:
        """Laplace approximation."""
        return self.fit.log_evidence

    @property
    def noisy(self) -> bool:
        """Whether the noise has a fault."""
        return any(fault.label != "initial-rate" for fault in self.faults)

    @property
    def adequate(self) -> bool:
        """Whether it leaves nothing but noise."""
        return self.outcome.adequate


class CauseSearch:
    """Fits and tests of hypotheses for one study.

    Parameters
    ----------
    posterior : Posterior
        The present model, with initial rates free.
    frozen : sequence of int
        Coordinates held at zero (`Engine`).
    candidates : sequence of Effect
    seed : int
    progress : Progress, optional
    """

    def __init__(
        self,
        posterior: Posterior,
        frozen: Sequence[int],
        candidates: Sequence[Effect],
        seed: int,
        progress: Progress = silent,
    ) -> None:
        self.candidates = {effect.label: effect for effect in candidates}
        self.seed = seed
        self._tell = progress
        self._batteries: dict[tuple[str, ...], TestSuite] = {}
        self._done: dict[frozenset[str], Hypothesis] = {}
        engine = Engine(posterior, frozen)
        self._tell(0.0, "compiling the simulation")
        engine.compile()
        self._tell(0.02, "fitting the present model")
        first = engine.fit()
        engine = engine.with_posterior(relinearised(posterior, first.z))
        fit = engine.fit(z=first.z)
        self._tell(0.1, "testing what it leaves")
        self.suite = self._battery_of(engine, fit, ())
        self.base = Hypothesis(engine, fit, (), self.suite.outcome(fit))

    def run(self) -> list[Hypothesis]:
        """Return the adequate hypotheses with fewest causes, best first; empty where none is found."""
        if self.base.adequate:
            return [self.base]
        beam, simpler = [self.base], list[Hypothesis]()
        for count in range(1, MOST_CAUSES + 1):
            found: list[Hypothesis] = []
            for parent, kind in [(parent, kind) for kind in HypothesisKind for parent in beam]:
                if kind is not HypothesisKind.FORCE and any(hypothesis.adequate for hypothesis in found):
                    break  # the simplest that explains the residual is taken
                additions = self._additions(parent, kind, TRIED[count - 1])
                for number, label in enumerate(additions):
                    key = frozenset((*parent.labels, label))
                    if key in self._done:
                        continue
                    share = (beam.index(parent) + number / len(additions)) / len(beam)
                    self._tell(0.1 + 0.6 * (count - 1 + share) / MOST_CAUSES, f"trying {' + '.join(sorted(key))}")
                    hypothesis = self.extend(parent, label)
                    if hypothesis is not None:
                        self._done[key] = hypothesis
                        found.append(hypothesis)
            found.sort(key=lambda h: -h.log_evidence)
            adequate = [hypothesis for hypothesis in found if hypothesis.adequate]
            if adequate:
                return (
                    simpler if simpler and adequate[0].log_evidence - simpler[0].log_evidence < DECISIVE else adequate
                )
            simpler = [hypothesis for hypothesis in found if hypothesis.outcome.p_value >= BARELY]
            if not found or count == MOST_CAUSES:
                return []
            beam = found[: BEAM[count - 1]]
        return []

    @property
    def tried(self) -> list[Hypothesis]:
        """Every hypothesis fitted, the present model first, then best first."""
        return [self.base, *sorted(self._done.values(), key=lambda h: -h.log_evidence)]

    def extend(self, parent: Hypothesis, label: str) -> Hypothesis | None:
        """Fit and test a hypothesis with one more cause."""
        if label in self.candidates:
            return self._with_effect(parent, self.candidates[label])
        if label == "initial-rate":
            return self._released(parent)
        return self._with_fault(parent, label)

    def predicted(self, parent: Hypothesis) -> dict[str, float]:
        """Chi-square that each candidate would take from a hypothesis, to first order; vibrations at their best."""
        taken = {
            label: item.statistic - item.degrees
            for label, item in parent.outcome.scores.items()
            if label in self.candidates
        }
        shaking = [item for name, item in parent.outcome.scores.items() if name.startswith("vibration")]
        best = max((item.statistic - item.degrees for item in shaking), default=0.0)
        for label, effect in self.candidates.items():
            if effect.modes_count and label not in parent.labels and shaking:
                taken[label] = best
        return taken

    def _additions(self, parent: Hypothesis, kind: HypothesisKind, most: int) -> list[str]:
        """Candidates of one kind that are worth adding, most promising first."""
        if kind is HypothesisKind.NOISE and (parent.noisy or len(parent.labels) > 1):
            return []  # noise explains anything if it may be combined at will
        if kind is not HypothesisKind.NOISE and parent.noisy and len(parent.labels) > 1:
            return []
        if kind is HypothesisKind.NOISE:
            return [
                label
                for label, log_p in parent.outcome.log_p.items()
                if ("noise" in label or label.startswith(("outliers", "quantisation")))
                and self.suite.calibration.adjusted(log_p) < FALSE_ALARM
                and label not in parent.labels
            ]
        taken = self.predicted(parent)
        best = max(taken.values(), default=0.0)
        worth = [
            label
            for label, gain in sorted(taken.items(), key=lambda item: -item[1])
            if gain > 6.0 and (gain > NEAR * best or best - gain < SPARE or (parent.labels and gain > 0.3 * best))
        ]
        chosen = [
            label for label in worth if (self.candidates[label].modes_count > 0) == (kind is HypothesisKind.VIBRATION)
        ]
        if kind is HypothesisKind.FORCE and self.base.engine.frozen.size and "initial-rate" not in parent.labels:
            chosen.insert(0, "initial-rate")
        if kind is HypothesisKind.FORCE and _strayed(
            parent.fit
        ):  # a score at the wrong place says little of an effect's size
            sure = [label for label, effect in self.candidates.items() if not effect.parameters]
            chosen = [label for label in sure if label not in (*chosen, *parent.labels)] + chosen
        return chosen[:most]

    def _with_effect(self, parent: Hypothesis, effect: Effect) -> Hypothesis | None:
        best: Fit | None = None
        places: list[tuple[Floats | None, OperatingTrajectory | None]] = [(parent.fit.z, parent.fit.operating)]
        if _strayed(parent.fit):
            places.append((None, None))
        starts = starts_of(effect, parent.fit, self._battery(parent))
        for (z, operating), start in product(places, starts):
            try:
                fit = parent.engine.fit(
                    (*parent.fit.effects, effect), (*parent.fit.coordinates, start), z=z, operating=operating
                )
            except InputError:  # no motion from this start
                continue
            if best is None or fit.cost < best.cost:
                best = fit
        if best is None:
            return None
        return Hypothesis(parent.engine, best, parent.faults, self._battery(parent).outcome(best))

    def _released(self, parent: Hypothesis) -> Hypothesis:
        """Free the initial rates."""
        engine = parent.engine.released()
        z = parent.fit.z.copy()
        measured = engine.posterior.starting_point()
        z[parent.engine.frozen] = measured[parent.engine.frozen]
        fit = engine.fit(parent.fit.effects, parent.fit.coordinates, z=z)
        marker = NoiseFault("initial-rate", (), np.zeros(0), np.zeros(0), engine.posterior)
        faults = (*parent.faults, marker)
        return Hypothesis(engine, fit, faults, self._battery_of(engine, fit, ("initial-rate",)).outcome(fit))

    def _with_fault(self, parent: Hypothesis, label: str) -> Hypothesis | None:
        fit, engine = parent.fit, parent.engine
        fault = noise_fault(label, fit)
        if fault is None:
            return None
        labels = tuple(sorted((*(item.label for item in parent.faults), label)))
        engine = engine.with_posterior(fault.posterior)
        fit = engine.fit(fit.effects, fit.coordinates, z=fit.z)
        if label.startswith("coloured-noise"):
            outcome = self._battery_of(engine, fit, labels).outcome(fit)
            if outcome.log_p[outcome.worst] > HOPELESS:
                fault = refined(fault, engine, fit)
                engine = engine.with_posterior(fault.posterior)
                fit = engine.fit(fit.effects, fit.coordinates, z=fit.z)
        if label.startswith("outliers"):  # those that the first fit hid
            fault = noise_fault(label, fit)
            if fault is None:
                return None
            again = engine.with_posterior(fault.posterior)
            fit, engine = again.fit(fit.effects, fit.coordinates, z=fit.z), again
        faults = (*parent.faults, fault)
        return Hypothesis(engine, fit, faults, self._battery_of(engine, fit, labels).outcome(fit))

    def _battery(self, hypothesis: Hypothesis) -> TestSuite:
        return self._battery_of(hypothesis.engine, hypothesis.fit, tuple(sorted(f.label for f in hypothesis.faults)))

    def _battery_of(self, engine: Engine, fit: Fit, faults: tuple[str, ...]) -> TestSuite:
        if faults not in self._batteries:
            self._batteries[faults] = TestSuite(engine, fit, list(self.candidates.values()), self.seed)
        return self._batteries[faults]


def _strayed(fit: Fit) -> bool:
    """Whether the model's own unknowns went so far from their prior that they may imitate what is missing."""
    return bool(np.abs(fit.z[fit.posterior.unknowns.layout.all_bodies]).max(initial=0.0) > FAR)


def log_bayes_factor(hypothesis: Hypothesis, base: Hypothesis) -> float:
    """Logarithm of the Bayes factor against another hypothesis."""
    return hypothesis.log_evidence - base.log_evidence


def significance(hypothesis: Hypothesis, parent: Hypothesis) -> tuple[float, float]:
    """Return signal-to-noise ratio and log p-value of the improvement over a hypothesis with fewer causes, refitted."""
    improvement = 2.0 * (parent.fit.cost - hypothesis.fit.cost)
    degrees = max(hypothesis.fit.known.shape[1] - parent.fit.known.shape[1], 1)
    return float(np.sqrt(max(improvement - degrees, 0.0))), chi2_log_sf(max(improvement, 0.0), degrees)
