"""The trials: what is hidden and what the diagnosis says of it, kept in a store."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from itertools import cycle, islice, product
from pathlib import Path
from typing import Any

import numpy as np

from bayesid._math.arrays import Floats
from bayesid._math.kept_jit import forget_executables
from bayesid.app.compilation_cache import keep_compiled
from bayesid.app.schema import Study
from bayesid.app.study_to_model import load_manoeuvres, load_model
from bayesid.diagnosis import Diagnosis, Frame, Status, diagnose
from bayesid.diagnosis.evidence.verdict import UNKNOWN, ProbableVerdict
from bayesid.diagnosis.outcome.candidate_table import effect_amplitude
from bayesid.diagnosis.outcome.inseparable_causes import parting_ratio
from bayesid.inference.perturbed_posterior import residual_of
from bayesid.inference.posterior import Posterior
from studies.blind_injections.limits import Limits, limits_of, what_is_left
from studies.common.monte_carlo import Workers, read_store, run_trials
from studies.truth import hidden_causes
from studies.truth.basilisk.cases import BASILISK_CASES, BasiliskCase
from studies.truth.mujoco import Study as Written

# fraction of the strength in the data with which a trial is compared to measure the size of a hidden effect
WEAKER = 0.1

EXPLAINING = ("explained", "partly-explained")  # statuses in which causes are named without rivals

MATTERS = 0.01  # probability above which a cause is kept with its trial
WEAK_TO_STRONG, OUTSIDE = (0.1, 1.5), (0.3, 2.0)  # least and largest strength of causes of the catalogue and of others

# seed of the first trial of the small and of the full plan; those of tests, of development and of earlier campaigns are
# others
FIRST_SEED = {False: 200, True: 400_000}

# numbers of trials of the full plan with a cause of the catalogue, with one outside it and with nothing hidden, and how
# many of these fly in Basilisk
COUNTS = {"effect": 1000, "unknown": 400, "adequate": 1000}
IN_BASILISK = {"effect": 75, "unknown": 0, "adequate": 75}

# causes that are easily taken for each other, without what follows a colon in their names
ALIKE = (
    "thruster-leak",
    "thruster-pulses",
    "kicks",
    "thermal-snap",
    "wheel-history",
    "mass-shift",
    "joint-backlash",
)

AnyCase = hidden_causes.Case | hidden_causes.WheelCase | BasiliskCase

_MUJOCO = tuple(case for case in hidden_causes.CASES if case.name not in hidden_causes.NOW_LISTED)
_CURRENT: tuple[AnyCase, ...] = (*_MUJOCO, *hidden_causes.FURTHER_CASES, *BASILISK_CASES)
_EARLIER = tuple(case for case in hidden_causes.CASES if case.name in hidden_causes.NOW_LISTED)

CASES: dict[str, AnyCase] = {case.name: case for case in (*_CURRENT, *_EARLIER)}  # all cases by name
_NOT_SEEN = Limits(None, None, None)  # limits where what is hidden does not change the mean of the data
SPOILT = ("outliers", "quantisation")  # beginnings of the names of causes that do not change the mean of the data


@dataclass(frozen=True)
class Plan:
    """One trial to be made: name of a case, seed, and strength of what is hidden."""

    case: str
    seed: int
    strength: float = 1.0


@dataclass(frozen=True)
class Trial:
    """One trial that was made."""

    # values of the trial's plan
    case: str
    seed: int
    strength: float
    kind: str  # kind of what is hidden: "effect", "adequate" (nothing) or "unknown" (outside the catalogue)
    hidden: tuple[str, ...]  # hidden causes
    # other names by which the hidden causes may be named; outside the catalogue, causes that come close
    accept: tuple[str, ...]
    status: str  # status of the verdict
    causes: tuple[str, ...]  # named causes
    # named causes and all other explanations that the verdict gives, equivalents included; "unknown" among the names
    # stands for something outside the catalogue, and nothing is left out
    sets: tuple[tuple[str, ...], ...]
    # root of the noncentrality of what is hidden, after the model's unknowns have taken their share; None for faults of
    # the noise, which do not change the mean. For outside effects, what the best set of causes leaves of it.
    signal_to_noise: float | None
    # limits of theory: probability of an alarm by the test of the hidden effect alone, and share of simulated data in
    # which the Bayes decision with all rivals names what is hidden alone
    detection: float | None
    naming: float | None
    p_value: float  # family-wise p-value of what the present model leaves
    # stated probability that all named causes are at work, each with its equivalents, whatever accompanies them
    probability: float | None
    probabilities: dict[str, float]  # probability of each cause to be at work, above one per cent
    # probabilities of something outside the catalogue, and of nothing
    unknown: float
    nothing: float
    # errors of the amplitudes of causes named rightly, in the stated standard deviations
    amplitude_errors: tuple[float, ...]
    # errors of the base's ten parameters after the extension, in the stated standard deviations
    body_errors: tuple[float, ...]
    # axes in which an outside wrench is fixed, as the diagnosis says and in truth
    frame: str | None
    true_frame: str | None
    correlation: float | None  # correlation of the reconstructed outside torque with the true one
    seconds: dict[str, float]  # time of the diagnosis by phase, and "total" with the files read [s]
    # whether anything remains beside the named causes, as the verdict says ("none", "undecided", "present"); None in
    # trials of the second release, which did not say
    remainder: str | None = None
    # signal-to-noise ratio from which a single hidden cause of `ALIKE` parts from each other of them, None where never
    parting: dict[str, float | None] = field(default_factory=dict)

    @property
    def alarmed(self) -> bool:
        """True if the diagnosis says that anything is hidden."""
        return self.status != "adequate"

    @property
    def named_rightly(self) -> bool:
        """True if the hidden set is the one named."""
        return self.status in EXPLAINING and self._right(self.causes)

    @property
    def holds(self) -> bool:
        """True if the named causes are all hidden, each by itself or by an equivalent that the verdict gives.

        That is what their stated probability says, whatever else is hidden.
        """
        names = set(self.hidden) | set(self.accept)
        said = self.sets if self.status in EXPLAINING else (self.causes,)
        return bool(self.causes) and any(set(labels) <= names for labels in said)

    @property
    def in_set(self) -> bool:
        """True if the hidden set is among those reported."""
        return self.status in (*EXPLAINING, "ambiguous") and any(self._right(labels) for labels in self.sets)

    @property
    def misnamed(self) -> bool:
        """True if causes are named, but the hidden set is neither named nor among the other explanations."""
        return self.status in (*EXPLAINING, "ambiguous") and not self.in_set

    def _right(self, labels: Sequence[str]) -> bool:
        names = set(self.hidden) | set(self.accept)
        if self.kind == "unknown":
            return UNKNOWN in labels or set(labels) <= names
        return len(labels) == len(self.hidden) and set(labels) <= names


def plan(full: bool) -> list[Plan]:
    """Return the plans of all trials, each with a seed of its own, in random order.

    A run that was stopped has thus made a random sample of its plan. The small plan has one trial of every case; the
    full one has `COUNTS` trials, in which the cases of each kind take turns. The strengths are log-uniform between ends
    that give signal-to-noise ratios of about 3 to 80.
    """
    draw = np.random.default_rng(3)
    plans: list[Plan] = []
    for kind, ends in (("effect", WEAK_TO_STRONG), ("unknown", OUTSIDE), ("adequate", None)):
        for name in _cases_of(kind, full):
            strength = 1.0 if ends is None else float(f"{np.exp(draw.uniform(*np.log(ends))):.3g}")
            plans.append(Plan(name, FIRST_SEED[full] + len(plans), strength))
    return [plans[number] for number in draw.permutation(len(plans))]


def _cases_of(kind: str, full: bool) -> list[str]:
    """Return the names of the cases of the trials of a kind."""
    flown = [case.name for case in BASILISK_CASES if case.status == kind]
    others = [case.name for case in _CURRENT if case.status == kind and case.name not in flown]
    if not full:
        return [*others, *flown]
    counts = (COUNTS[kind] - IN_BASILISK[kind], IN_BASILISK[kind])
    return [name for names, count in zip((others, flown), counts, strict=True) for name in islice(cycle(names), count)]


def run(
    plans: Sequence[Plan], kept: Path, progress: Callable[[str], None] = lambda text: None, workers: Workers = 1
) -> list[Trial]:
    """Make the trials that the store does not hold yet.

    Parameters
    ----------
    plans : sequence of Plan; plans of the trials
    kept : path; store of the trials, see `studies.common.monte_carlo`
    progress : callable, optional; receives one line per finished trial
    workers : int or Executor; number of processes

    Raises
    ------
    RuntimeError
        If a trial has failed; the others are kept.
    """
    made = run_trials(_weighed_trial, plans, kept, workers=workers, progress=progress)
    return [_trial(content) for content in made.complete()]


def read(kept: Path) -> list[Trial]:
    """Read the trials made so far; those that failed, were cut off or state no probabilities are left out."""
    return [_trial(line["result"]) for line in read_store(kept) if "probabilities" in line.get("result", {})]


def _weighed_trial(plan: Plan, rng: np.random.Generator) -> dict[str, Any]:
    """Make a trial, whose random numbers follow from the seed of its plan.

    What was compiled for its robot, recordings and causes stays on disk alone: the memory of a long run would fill.
    """
    keep_compiled()  # trials may run in processes of their own
    try:
        return asdict(make(plan))
    finally:
        forget_executables()


def _trial(content: Mapping[str, Any]) -> Trial:
    """Return a trial from what JSON has of it; earlier versions let rounding lift sums of probabilities above one."""
    tuples = {key: tuple(content[key]) for key in ("hidden", "accept", "causes", "amplitude_errors", "body_errors")}
    probabilities = {name: min(value, 1.0) for name, value in content["probabilities"].items()}
    stated = ("probability", "unknown", "nothing")
    singles = {key: None if content[key] is None else min(content[key], 1.0) for key in stated}
    sets = tuple(tuple(labels) for labels in content["sets"])
    return Trial(**{**content, **tuples, **singles, "probabilities": probabilities, "sets": sets})


def make(plan: Plan) -> Trial:
    """Make one trial: hide, diagnose and compare."""
    case = CASES[plan.case]
    began = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        written = case.write(Path(folder) / "study", plan.seed, plan.strength)
        study = Study.load(written.file)
        model = load_model(study)
        knows = all(section.argument_of_latitude is not None for section in study.recordings)
        result = diagnose(model, load_manoeuvres(study, model.robot), plan.seed, knows_latitude=knows)
        total = time.perf_counter() - began
        weaker = case.make(Path(folder) / "weaker", plan.seed, WEAKER * plan.strength) if _visible(case) else None
        size = _NOT_SEEN if weaker is None else _limits(result, case, plan.seed, _signal(result, Study.load(weaker)))
    wrench = case if isinstance(case, hidden_causes.Case) and case.frame is not None else None
    probabilities = result.probabilities
    return Trial(
        case=plan.case,
        seed=plan.seed,
        strength=plan.strength,
        kind=case.status,
        hidden=case.causes,
        accept=case.accept,
        status=result.verdict.status.value,
        causes=result.verdict.causes,
        sets=_sets(result),
        p_value=result.alarm.p_value,
        probability=result.probability_of(result.verdict.causes) if result.verdict.causes else None,
        probabilities={c: p for c in probabilities.causes if (p := probabilities.inclusion[c]) > MATTERS},
        unknown=probabilities.unknown,
        nothing=probabilities.nothing,
        amplitude_errors=_amplitude_errors(result, case.amplitudes(plan.seed, plan.strength)),
        body_errors=_body_errors(result, written),
        frame=None if result.unexplained.fixed_in is None else result.unexplained.fixed_in.value,
        true_frame=None if wrench is None else wrench.frame,
        correlation=None if wrench is None else _correlation(result, wrench, plan, written),
        seconds={**result.seconds, "total": total},
        remainder=result.remainder.verdict.value,
        parting=_parting(result, case),
        **vars(size),
    )


def _parting(result: Diagnosis, case: AnyCase) -> dict[str, float | None]:
    """Return from which signal-to-noise ratio the hidden cause parts from others like it; empty if it is not one."""
    evidence, hidden = result.search.searches[0].point.evidence, case.causes[0] if len(case.causes) == 1 else ""
    if family(hidden) not in ALIKE or hidden not in evidence.causes:
        return {}
    least: dict[str, float] = {}
    for name in evidence.causes:
        if family(name) in ALIKE and family(name) != family(hidden):
            ratio = parting_ratio(evidence, hidden, name)
            least[family(name)] = min(ratio, least.get(family(name), np.inf))
    return {name: ratio if np.isfinite(ratio) else None for name, ratio in least.items()}


def family(cause: str) -> str:
    """Return the name of a cause without its link, joint or axis."""
    return cause.partition(":")[0]


def _visible(case: AnyCase) -> bool:
    """Return whether what is hidden changes the mean of the data."""
    return case.status != "adequate" and not any("noise" in c or c.startswith(SPOILT) for c in case.causes)


def _signal(result: Diagnosis, weaker: Study) -> Floats:
    """Return how what is hidden changes the whitened residual, from data with the same noise and less of it."""
    fit, perturbed = result.before.fit, result.before.perturbed
    arrays, model = fit.posterior.data.arrays, fit.posterior.model
    # what is hidden may lie in the study's own words, such as the place of a sensor
    model = replace(model, sensors=load_model(weaker).sensors)
    like = Posterior.of(model, load_manoeuvres(weaker, model.robot), step=fit.posterior.step)
    other = like.data.arrays._replace(weights=arrays.weights, start=arrays.start)
    return (perturbed.residual(fit.z, arrays) - residual_of(like, fit.z, other).ravel()) / (1.0 - WEAKER)


def _limits(result: Diagnosis, case: AnyCase, seed: int, change: Floats) -> Limits:
    if case.status == "unknown":
        return replace(_NOT_SEEN, signal_to_noise=what_is_left(result, change))
    names = set(case.causes) | set(case.accept)

    def right(verdict: ProbableVerdict) -> bool:
        alone = len(verdict.causes) == len(case.causes) and set(verdict.causes) <= names
        return alone and verdict.status is Status.EXPLAINED

    return limits_of(result, case.causes, change, right, np.random.default_rng(seed))


def _amplitude_errors(result: Diagnosis, truth: Mapping[str, Floats]) -> tuple[float, ...]:
    errors: list[float] = []
    for index, effect in enumerate(result.after.fit.effects if result.verdict.causes else ()):
        name = effect.label if effect.label in truth else effect.name  # a jump's label holds its instants
        if name in truth:
            mean, sd = effect_amplitude(result.after, index)
            errors += ((mean - truth[name]) / sd).tolist()
    return tuple(errors)


def _body_errors(result: Diagnosis, written: Written) -> tuple[float, ...]:
    bodies = result.gain.after.bodies
    return tuple(((bodies.mean[:10] - written.base.quantities) / bodies.sd[:10]).tolist())


def _correlation(result: Diagnosis, case: hidden_causes.Case, plan: Plan, written: Written) -> float:
    """Return the correlation of the reconstructed with the true torque, all axes and recordings together."""
    estimated, true = [], []
    for time_, torque, truth in zip(
        result.unexplained.time, result.unexplained.torque[Frame.BASE], written.truths, strict=True
    ):
        there = case.torque(plan.seed, plan.strength, truth)
        true += [np.interp(time_, truth.times, there[:, axis]) for axis in range(3)]
        estimated += list(torque.T)
    return float(np.corrcoef(np.concatenate(estimated), np.concatenate(true))[0, 1])


def _sets(result: Diagnosis) -> tuple[tuple[str, ...], ...]:
    verdict = result.verdict
    sets = [verdict.causes, *verdict.ambiguous_with]
    choices = [[(name, *verdict.equivalent_to.get(name, ())) for name in labels] for labels in sets if labels]
    return tuple(labels for each in choices for labels in product(*each))
