"""Loop of section 3.3 of the paper: plan a manoeuvre, execute it, identify the bodies, and repeat until all is known.

Every manoeuvre is designed from the posterior of those before it, and flown only if its limits hold with 99 %
probability under that posterior. Where the recordings are reviewed, the loop stops as soon as they show that the model
is wrong: more of them would only make a wrong answer sharp. All random numbers follow from one seed and the step's
number, and all data between two stages pass through files of the folder. An interrupted loop therefore continues to
exactly the same result.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bayesid._io.errors import InputError
from bayesid._io.progress import Progress, silent
from bayesid._io.store import content_key
from bayesid.design.design_problem import Problem
from bayesid.design.design_result import sample_times
from bayesid.design.go_no_go import plan_to_go
from bayesid.design.knowledge_update import (
    Identifier,
    Sampled,
    bodies_of_draws,
    describe_bodies,
    known_of,
    updated_model,
)
from bayesid.design.loop_goals import Goal, RelativePrecision, Reviewer, StepKnowledge, goal_dict
from bayesid.design.loop_history import History
from bayesid.design.plan import Plan
from bayesid.design.predicted_posterior import Encoder
from bayesid.design.search_starts import adapted_to_family
from bayesid.design.simulated_spacecraft import Spacecraft, plan_recording
from bayesid.design.trajectory_search import Search, Store
from bayesid.inference.conventions import refuse_conventions
from bayesid.inference.data import RecordedSamples
from bayesid.inference.posterior import Posterior
from bayesid.inference.posterior_as_prior import InertialDraws
from bayesid.inference.wrong_units import refuse_wrong_units
from bayesid.recording.joint_motion import MeasuredMotion
from bayesid.recording.plausibility import refuse_impossible_motion
from bayesid.recording.recording import Recording
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.sensors import SensorKind

__all__ = ["Loop", "NotFlown", "flown"]

# factor on a star sensor's noise for an initial attitude from its first sample, as the fit uses that sample again
LOOSE = 10.0
# largest relative width of a prior at which readings ten times too large mean wrong units and not another body
NARROW = 0.5


class NotFlown(Exception):  # noqa: N818  (nothing went wrong)
    """Signal from a spacecraft that the recording of a plan will be available only later."""


@dataclass(frozen=True)
class Loop:
    """Loop that plans, executes and identifies manoeuvres, each from the posterior of the earlier ones.

    Parameters
    ----------
    problem : Problem
        Family of manoeuvres, limits and criteria, of which the first is used; the model of its plan is the initial
        knowledge.
    encoder : Encoder
        Noise of the joints' encoders.
    seed : int
        Seed of all random numbers.
    goals : sequence of Goal
        Goals, all of which must be reached for the loop to stop; by default a relative precision of 1 %.
    at_most : int
        Largest number of manoeuvres.
    search : Search
        Effort of each design.
    identifier : Identifier
        Method of the identification.
    reviewer : Reviewer, optional
        Method by which the recordings so far are reviewed after each step. If they indicate a wrong model, the loop
        stops, unless a goal asks for the cause.
    """

    problem: Problem
    encoder: Encoder
    seed: int = 0
    goals: Sequence[Goal] = (RelativePrecision(),)
    at_most: int = 5
    search: Search = Search(starts=8, iterations=60)  # noqa: RUF009  (immutable)
    identifier: Identifier = Sampled()  # noqa: RUF009  (immutable)
    reviewer: Reviewer | None = None

    def __post_init__(self) -> None:
        if self.reviewer is None and any(goal.diagnosed for goal in self.goals):
            problem = "a goal requires the probability of a cause, but the steps are not reviewed"
            raise InputError(problem, place="goals", remedy="Give a reviewer, such as DiagnosisReview")

    def run(self, spacecraft: Spacecraft | None, folder: Path, progress: Progress = silent) -> History:
        """Run the loop until its goals are reached, the limit of steps, a wrong model, a no-go, or `NotFlown`.

        Parameters
        ----------
        spacecraft : Spacecraft or None
            Spacecraft that executes the plans; None where it is flown elsewhere, and its recordings are put into the
            folder.
        folder : Path
            Folder of ``step-N-plan.csv``, ``step-N-recording.csv``, ``step-N-posterior.nc``, ``step-N-diagnosis.json``
            where the steps are reviewed, and ``loop.json``.
        progress : Progress
            Receiver of the fraction done.

        Raises
        ------
        InputError
            If a plan is impossible or a recording does not fit.
        """
        history = History.open(folder, self._key(), reviewed=self.reviewer is not None)
        first = adapted_to_family(self.problem, np.random.default_rng([self.seed, 0]))
        problem, model = first, first.plan.model
        for number in range(1, self.at_most + 1):
            progress((number - 1) / self.at_most, f"step {number}: planning")
            if not self._plan(history, number, problem, progress):
                history.close("no-go")
                return history
            progress((number - 0.5) / self.at_most, f"step {number}: executing")
            try:
                self._execute(history, number, spacecraft)
            except NotFlown:
                history.close("waiting")
                return history
            progress((number - 0.4) / self.at_most, f"step {number}: identifying")
            self._identify(history, number, model)
            progress((number - 0.2) / self.at_most, f"step {number}: reviewing")
            trusted = self._review(history, number)
            draws = InertialDraws.read(history.path(number, "identification"))
            model = updated_model(self.problem.plan.model, draws)
            reached = self._assess(history, number, model, draws)
            if number == len(history.steps) and not trusted:
                history.close("wrong-model")
                return history
            if number == len(history.steps) and reached:
                history.close("reached")
                return history
            problem = first.knowing(known_of(self.problem.plan.unknowns, draws))
        history.close("at-most")
        return history

    def _plan(self, history: History, number: int, problem: Problem, progress: Progress) -> bool:
        """Plan a step unless it is planned already, and return whether it may be flown."""
        entry = history.entry(number, "plan")
        if entry is not None:
            return bool(entry["go"])
        plan, criterion, stem = problem.plan, problem.criteria[0], f"step-{number}"
        store = Store.open(history.folder / f".{stem}-search.json", history.key)
        attempts = plan_to_go(
            problem, criterion, np.random.SeedSequence([self.seed, number, 0]), self.search, store, progress
        )
        best = attempts[-1]
        motion = plan.family.motion(best.optimum.parameters)
        time = sample_times(plan.family.duration, plan.interval)
        plan_recording(motion, plan.model.robot, time, stem, plan.wheels).write(history.path(number, "plan"))
        content = {
            "go": best.go,
            "criterion": criterion.name,
            "cost": best.optimum.cost,
            "parameterisation": plan.family.name,
            "parameters": dict(zip(plan.family.names, map(float, best.optimum.parameters), strict=True)),
            "limits": {
                reached.name: {"limit": reached.limit, "largest": reached.largest, "unit": reached.unit}
                for reached in best.reached
            },
            "attempts": [attempt.to_dict() for attempt in attempts],
        }
        history.record(number, "plan", content)
        store.remove()
        return best.go

    def _execute(self, history: History, number: int, spacecraft: Spacecraft | None) -> None:
        """Have a step executed unless its recording exists."""
        file = history.path(number, "recording")
        if not file.is_file():
            if spacecraft is None:
                raise NotFlown
            plan = replace(Recording.read(history.path(number, "plan")), name=f"step-{number}")
            recording = spacecraft.execute(plan)
            self._check(recording)
            recording.write(file)

    def _check(self, recording: Recording) -> None:
        """Refuse a recording that does not allow an identification, before it is written."""
        model = self.problem.plan.model
        manoeuvre = flown(self.problem.plan, recording, self.encoder)
        refuse_impossible_motion(recording, model.robot)
        RecordedSamples.of(model, manoeuvre)

    def _identify(self, history: History, number: int, model: Model) -> None:
        """Identify the bodies from the recording of a step unless it is done already."""
        if history.entry(number, "identification") is not None:
            return
        file = history.path(number, "identification")
        recording = Recording.read(history.path(number, "recording"))
        self._check(recording)
        manoeuvre = flown(self.problem.plan, recording, self.encoder)
        refuse_conventions(model, [manoeuvre])
        posterior = Posterior.of(model, [manoeuvre])
        if all(prior.spread <= NARROW for prior in model.priors):
            refuse_wrong_units(posterior)
        if history.entry(number, "recording") is None:
            history.record(number, "recording", {})
        seed = int(np.random.SeedSequence([self.seed, number, 1]).generate_state(1)[0])
        fit = self.identifier.identify(posterior, seed, file)
        bodies = bodies_of_draws(model, InertialDraws.read(file))
        history.record(number, "identification", {**fit, "bodies": describe_bodies(bodies)})

    def _review(self, history: History, number: int) -> bool:
        """Review the recordings so far unless it is done already, and return whether the loop may go on."""
        if self.reviewer is None:
            return True
        entry = history.entry(number, "diagnosis")
        if entry is None:
            manoeuvres = [self._flown(history, step) for step in range(1, number + 1)]
            seed = int(np.random.SeedSequence([self.seed, number, 2]).generate_state(1)[0])
            file = history.path(number, "diagnosis")
            entry = self.reviewer.review(self.problem.plan.model, manoeuvres, seed, file).to_dict()
            history.record(number, "diagnosis", entry)
        return entry["trusted"] or any(goal.diagnosed for goal in self.goals)

    def _assess(self, history: History, number: int, model: Model, draws: InertialDraws) -> bool:
        """Note the values of all goals after a step, and return whether they are reached."""
        review = history.entry(number, "diagnosis")
        knowledge = StepKnowledge(
            model,
            bodies_of_draws(self.problem.plan.model, draws),
            self._flown(history, number),
            {} if review is None else review["probabilities"],
            int(np.random.SeedSequence([self.seed, number, 3]).generate_state(1)[0]),
        )
        assessed = [(goal, goal.value(knowledge)) for goal in self.goals]
        history.note(number, "goals", [goal_dict(goal, value) for goal, value in assessed])
        return all(goal.reached(value) for goal, value in assessed)

    def _flown(self, history: History, number: int) -> Manoeuvre:
        """Return the manoeuvre of a step as it was recorded."""
        return flown(self.problem.plan, Recording.read(history.path(number, "recording")), self.encoder)

    def _key(self) -> str:
        """Return the key of everything that the results depend on; when the loop stops is not part of it."""
        plan, limits = self.problem.plan, self.problem.applied
        model = plan.model
        return content_key(
            model.robot.to_urdf(),
            [(prior.name, prior.spread, prior.nuisance, prior.centre.vector.tolist()) for prior in model.priors],
            (
                model.mixing,
                model.sensors,
                model.orbit,
                [(effect.label, effect.parameters) for effect in model.effects],
                model.rate_sigma,
            ),
            (plan.family.name, plan.family.names, plan.family.duration, plan.interval, plan.tip.name),
            plan.family.posture_at_rest,
            [(w.name, w.axis, w.inertia, w.position) for w in model.robot.wheels],
            [(name, curve.time, curve.values) for name, curve in plan.wheel_speeds.items()],
            (plan.attitude.tolist(), plan.attitude_sigma, plan.argument_of_latitude, plan.step, plan.thinning),
            [(limit.name, limit.bound) for limit in limits],
            (self.problem.criteria[0], self.seed, self.search, self.identifier, dict(self.encoder), self.reviewer),
        )


def flown(plan: Plan, recording: Recording, encoder: Encoder) -> Manoeuvre:
    """Return a recording as a manoeuvre with smoothed joint motion.

    The initial attitude is that of the plan, or what a star sensor of the model reads at time 0. The initial positions
    of joints that are recorded by speed alone are those of the plan.

    Parameters
    ----------
    plan : Plan
    recording : Recording
        Recording with all joints and sensors.
    encoder : Encoder
        Noise of the encoders.
    """
    attitude, sigma = plan.attitude, plan.attitude_sigma
    star = plan.model.sensor(SensorKind.ATTITUDE)
    if star is not None and star.kind.columns[0] in recording.channels:
        time, values = recording.vector(star.kind.value, star.kind.axes)
        if time[0] == 0.0:
            attitude, sigma = values[0], max(sigma, LOOSE * float(np.max(star.noise.sigma(plan.interval))))
    names = [joint.name for joint in plan.model.robot.joints]
    start = dict(zip(names, plan.family.posture_at_rest.tolist(), strict=True))
    motion = MeasuredMotion.from_recording(recording, plan.model.robot, sigma=encoder, start=start)
    return Manoeuvre(recording, motion, attitude, attitude_sigma=sigma, argument_of_latitude=plan.argument_of_latitude)
