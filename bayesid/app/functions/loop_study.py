"""Loop over a study: plan a manoeuvre, have it executed, identify, diagnose, plan again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

from bayesid._io.errors import InputError
from bayesid._io.files import claimed_folder
from bayesid._io.progress import Progress, silent
from bayesid._io.short_form import ShortForm, Summary
from bayesid.app.functions.study_source import StudySource, study_of
from bayesid.app.study_to_design import load_loop_problem
from bayesid.app.study_to_encoders import encoder_noise
from bayesid.app.study_to_model import loop_review
from bayesid.app.user_files import load_spacecraft
from bayesid.design import Loop, Sampled, Spacecraft
from bayesid.design.loop_goals import CauseProbability, Goal, QuantitySd, RelativePrecision, TipRegion
from bayesid.design.loop_history import History
from bayesid.inference.body_quantities import BodyDraws
from bayesid.inference.posterior_as_prior import InertialDraws
from bayesid.report.loop_report import loop_sentences
from bayesid.robot.inertial_parameters import mass_com_inertia
from bayesid.simulation.model import Model

__all__ = ["AssessedGoal", "LoopResult", "LoopStep", "loop"]


class AssessedGoal(NamedTuple):
    """What is wanted, and what a step reached.

    Attributes
    ----------
    goal : str
        What is wanted, in words.
    value, wanted : float
        Value after the step, and the one wanted.
    unit : str
        Unit of the quantity.
    reached : bool
    """

    goal: str
    value: float
    wanted: float
    unit: str
    reached: bool


@dataclass(frozen=True)
class LoopStep:
    """One step of a loop.

    Attributes
    ----------
    number : int
        Number of the step, from 1.
    plan, recording, posterior : Path
        Files of the joints' motion to fly, of what was recorded, and of the draws; the later ones may not exist yet.
    entry : dict
        Content of the step in loop.json.
    """

    number: int
    plan: Path
    recording: Path
    posterior: Path
    entry: dict[str, Any]

    @cached_property
    def bodies(self) -> dict[str, BodyDraws]:
        """Draws of the bodies after this step, empty before its identification."""
        names = list(self.entry.get("identification", {}).get("bodies", ()))
        if not names:
            return {}
        values = mass_com_inertia(InertialDraws.read(self.posterior).of_bodies(names).values)
        return {name: BodyDraws(name, values[:, index]) for index, name in enumerate(names)}

    @property
    def goals(self) -> tuple[AssessedGoal, ...]:
        """What is wanted beside what the step reached, empty before its identification."""
        return tuple(AssessedGoal(**goal) for goal in self.entry.get("goals", ()))

    @property
    def causes(self) -> tuple[str, ...]:
        """Causes by which the recordings so far are explained."""
        return tuple(self.entry.get("diagnosis", {}).get("causes", ()))


@dataclass(frozen=True, repr=False)
class LoopResult(ShortForm):
    """Result of `loop`.

    Attributes
    ----------
    title : str
        Title of the study.
    history : History
        Entries of loop.json, and the folder of its files.
    """

    title: str
    history: History

    @property
    def status(self) -> str:
        """How the loop ended: ``waiting`` (for a recording), ``reached``, ``at-most``, ``no-go`` or ``wrong-model``."""
        return self.history.status

    @cached_property
    def steps(self) -> tuple[LoopStep, ...]:
        """Steps so far."""
        return tuple(
            LoopStep(
                number=step["step"],
                plan=self.history.path(step["step"], "plan"),
                recording=self.history.path(step["step"], "recording"),
                posterior=self.history.path(step["step"], "identification"),
                entry=step,
            )
            for step in self.history.steps
        )

    @property
    def bodies(self) -> dict[str, BodyDraws]:
        """Draws of the bodies after the last identified step, empty before the first."""
        return next((step.bodies for step in reversed(self.steps) if step.bodies), {})

    def summary(self) -> Summary:
        """Return the result of every step, how the loop ended, and what to do next."""
        return Summary(list(loop_sentences(self.history)))

    def to_dict(self) -> dict[str, Any]:
        """Return the content of loop.json, without its key."""
        return {"status": self.history.status, "steps": self.history.steps}


def loop(
    study: StudySource,
    output: Path,
    seed: int = 0,
    *,
    effective_samples: float = 2000.0,
    spacecraft: Path | Spacecraft | None = None,
    precision: float | None = None,
    wanted_sd: Sequence[str] | None = None,
    wanted_tip: float | None = None,
    wanted_cause: str | None = None,
    at_most: int = 5,
    diagnose: bool = True,
    progress: Progress = silent,
) -> LoopResult:
    """Plan a manoeuvre, evaluate its recording, and repeat until the goals are reached.

    Parameters
    ----------
    study : path or Study
        Path of a study file, or the study that was read from it.
    output : path
        Folder in which every step is stored; the loop resumes from its content.
    seed : int
        Seed of all random numbers.
    effective_samples : float
        Goal for the number of effective samples of each identification.
    spacecraft : Spacecraft or path, optional
        Object that executes plans, or the Python file that defines it; without it, you put the recordings into the
        folder.
    precision : float, optional
        Required relative standard deviation of mass and principal moments; 0.01 if no other goal is given.
    wanted_sd : sequence of str, optional
        ``BODY.QUANTITY=SD``, required standard deviations in SI units.
    wanted_tip : float, optional
        Required longest semi-axis of the end-effector's 95 % region [mm].
    wanted_cause : str, optional
        ``NAME`` or ``NAME=PROBABILITY``: the loop ends when the probability of the cause is at least that, by default
        0.95, or at most one minus it.
    at_most : int
        Maximum number of manoeuvres.
    diagnose : bool
        Whether to diagnose after every step and stop if the model is wrong.
    progress : Progress, optional
        Receiver of the fraction done.

    Raises
    ------
    InputError
        If the study or a goal is invalid, a plan is impossible or a recording does not match its plan.
    """
    if at_most < 1:
        raise InputError(f"{at_most} manoeuvres", place="--at-most", remedy="Allow at least one")
    study = study_of(study)
    problem = load_loop_problem(study)
    model, tip_frame = problem.plan.model, None if study.design is None else study.design.tip_frame
    made = Loop(
        problem,
        encoder_noise(study, model.robot),
        seed=seed,
        goals=_goals(model, precision, wanted_sd or (), wanted_tip, wanted_cause, tip_frame),
        at_most=at_most,
        identifier=Sampled(effective_samples),
        reviewer=loop_review(study) if diagnose else None,
    )
    executing = load_spacecraft(Path(spacecraft)) if isinstance(spacecraft, (str, Path)) else spacecraft
    with claimed_folder(Path(output)):
        return LoopResult(study.title, made.run(executing, Path(output), progress))


def _goals(
    model: Model,
    precision: float | None,
    deviations: Sequence[str],
    region: float | None,
    cause: str | None,
    tip_frame: str | None,
) -> tuple[Goal, ...]:
    """Return the goals of a loop; a relative precision of 1 % where nothing else is wanted."""
    goals: list[Goal] = []
    if precision is not None:
        if not 0.0 < precision < 1.0:
            problem = f"{precision:g} is not between 0 and 1"
            raise InputError(problem, place="--wanted", remedy="Give a relative precision: 0.01 is 1 %")
        goals.append(RelativePrecision(precision))
    for text in deviations:
        name, _, value = text.partition("=")
        bodies = [body.name for body in model.bodies]
        body = next((body for body in bodies if name.startswith(f"{body}.")), None)
        if body is None:
            remedy = f"Write BODY.QUANTITY=SD, with a body among {', '.join(bodies)}: {bodies[0]}.mass=0.5"
            raise InputError(f"{text!r} does not name a body to identify", place="--wanted-sd", remedy=remedy)
        goals.append(QuantitySd(body, name.removeprefix(f"{body}."), _number(value, text, "--wanted-sd")))
    if region is not None:
        if not region > 0.0:
            raise InputError(f"{region:g} mm", place="--wanted-tip", remedy="Give a positive number of millimetres")
        goals.append(TipRegion(1e-3 * region, tip_frame))
    if cause is not None:
        name, sign, value = cause.partition("=")
        goals.append(CauseProbability(name, _number(value, cause, "--wanted-cause") if sign else 0.95))
    return tuple(goals) or (RelativePrecision(),)


def _number(text: str, whole: str, place: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{whole!r} has no number after '='", place=place, remedy="Write NAME=NUMBER") from None
