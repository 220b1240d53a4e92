"""What ``bayesid loop`` does, apart from the terminal: plan, have executed, identify, plan again."""

from __future__ import annotations

import importlib.util
import inspect
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from bayesid._io.errors import InputError
from bayesid.app.schema import DesignSection, Study
from bayesid.app.study_to_model import load_model
from bayesid.design import BSplines, DOptimal, Limits, Loop, NotFlown, Plan, Problem, Sampled, Spacecraft, Tip
from bayesid.design.loop_history import History
from bayesid.design.predicted_posterior import Encoder
from bayesid.recording.recording import Recording

__all__ = ["load_spacecraft", "problem_of", "run_loop"]

DURATION, INTERVAL = 120.0, 0.5
"""Of a manoeuvre where the study states none, and between samples [s]."""


def run_loop(
    file: Path,
    output: Path,
    *,
    spacecraft: Path | None,
    wanted: float,
    at_most: int,
    seed: int,
    effective_samples: float,
    progress: Callable[[float, str], None],
) -> Iterator[str]:
    """Go round the loop of a study; what was done before is not done again."""
    if not 0.0 < wanted < 1.0:
        raise InputError(
            f"{wanted:g} is not between 0 and 1", place="--wanted", remedy="Give a relative precision: 0.01 is 1 %"
        )
    if at_most < 1:
        raise InputError(f"{at_most} manoeuvres", place="--at-most", remedy="Allow at least one")
    study = Study.load(file)
    if not study.unknowns.bodies:
        raise InputError("nothing is unknown", file=file, place="unknowns.bodies", remedy="Name a body to identify")
    flier: Spacecraft = _Nobody() if spacecraft is None else load_spacecraft(spacecraft)
    loop = Loop(
        problem_of(study),
        _encoder(study),
        seed=seed,
        wanted=wanted,
        at_most=at_most,
        identifier=Sampled(effective_samples),
    )
    history = loop.run(flier, output, progress)
    yield from _sentences(history, wanted)


def problem_of(study: Study) -> Problem:
    """Return the design problem of a study's ``[design]``: B-splines, the smallest volume of the posterior.

    The base starts as in the first of its ``[[recordings]]``, whose file is not read.
    """
    section, model = study.design or DesignSection(), load_model(study).without_torque
    joints = [joint.name for joint in model.robot.joints]
    for name in section.joints or ():
        if name not in joints:
            raise InputError(
                f"no moving joint named {name!r}",
                file=study.file,
                place="design.joints",
                remedy=f"Choose among {', '.join(joints)}",
            )
    moving = [index for index, name in enumerate(joints) if section.joints is None or name in section.joints]
    # every joint rests at zero, or in the middle of a range without it
    rest = [0.5 * (j.lower + j.upper) if j.lower > 0.0 or j.upper < 0.0 else 0.0 for j in model.robot.joints]
    family = BSplines(rest, moving, section.duration or DURATION)
    plan = Plan(model, family, INTERVAL, Tip.of(model.robot, section.tip_frame))
    if study.recordings:
        first = study.recordings[0]
        argument_of_latitude = first.argument_of_latitude or 0.0
        plan = replace(
            plan,
            attitude=np.array(first.attitude),
            attitude_sigma=first.attitude_sigma,
            argument_of_latitude=argument_of_latitude,
        )
    return Problem(plan, Limits(**section.limits.model_dump()), (DOptimal(),))


def load_spacecraft(file: Path) -> Spacecraft:
    """Run a user's file and return what it calls ``execute``, or an instance of its class ``Spacecraft``.

    Raises
    ------
    InputError
        If there is no such file, it fails, or it defines neither.
    """
    remedy = "Define a function execute(plan) that returns a Recording, or a class Spacecraft with that method"
    spec = importlib.util.spec_from_file_location(f"bayesid_spacecraft_{file.stem}", file)
    if not file.is_file() or spec is None or spec.loader is None:
        raise InputError("no such Python file", file=file, place="--spacecraft", remedy=remedy)
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
        made: Any = module.Spacecraft() if inspect.isclass(getattr(module, "Spacecraft", None)) else module
    except Exception as error:
        raise InputError(f"it fails: {type(error).__name__}: {error}", file=file, remedy="Correct the file") from error
    if not callable(getattr(made, "execute", None)):
        raise InputError("it defines no spacecraft", file=file, remedy=remedy)
    return _Checked(made, file)


class _Checked:
    """A user's spacecraft, whose answer is looked at."""

    def __init__(self, inner: Any, file: Path) -> None:
        self.inner, self.file = inner, file

    def execute(self, plan: Recording) -> Recording:
        """Execute and refuse what is no recording."""
        try:
            recording = self.inner.execute(plan)
        except (InputError, NotFlown):
            raise
        except Exception as error:
            raise InputError(
                f"execute fails: {type(error).__name__}: {error}", file=self.file, remedy="Correct the file"
            ) from error
        if not isinstance(recording, Recording):
            raise InputError(
                f"execute returned a {type(recording).__name__}",
                file=self.file,
                remedy="Return a bayesid.Recording; Recording.read reads a file",
            )
        return recording


class _Nobody:
    """Stands for a robot that is flown elsewhere."""

    def execute(self, plan: Recording) -> Recording:
        """Wait."""
        raise NotFlown


def _encoder(study: Study) -> Encoder:
    families: tuple[Literal["position", "velocity", "acceleration"], ...] = ("position", "velocity", "acceleration")
    encoder = study.sensors.encoder
    joints = [joint.name for joint in load_model(study).robot.joints]
    return {order: {name: encoder.sigma_of(family, name) for name in joints} for order, family in enumerate(families)}


def _sentences(history: History, wanted: float) -> Iterator[str]:
    for step in history.steps:
        number, attempts = step["step"], step["plan"]["attempts"]
        if len(attempts) > 1:
            yield f"Step {number}: limits tightened {len(attempts) - 1} times until they held with 99 %."
        found = step.get("identification")
        if found is not None:
            for name, body in found["bodies"].items():
                yield f"Step {number}: {name}: mass {body['mass']['mean']:.6g} +- {body['mass']['sd']:.2g} kg"
            yield f"Step {number}: the worst of mass and principal moments is known to {found['precision']:.2%}."
            yield from found["disagreements"]
    number = len(history.steps)
    if history.status == "waiting":
        yield f"Fly {history.path(number, 'plan')}: positions, velocities and accelerations of the joints."
        yield f"Put what the sensors and encoders read into {history.path(number, 'recording')}, then call this again."
    elif history.status == "no-go":
        broken = [name for name, item in attempts[-1]["limits"].items() if not item["quantile_99"] <= item["limit"]]
        yield f"No go: {', '.join(broken)} would not hold with 99 %, however small the manoeuvre was made."
    elif history.status == "reached":
        yield f"The wanted {wanted:.2%} are reached after {number} manoeuvres."
    else:
        yield f"The wanted {wanted:.2%} are not reached after {number} manoeuvres; --at-most allows more."
    yield f"Wrote {history.folder / 'loop.json'}."
