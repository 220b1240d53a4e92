"""Conversion of a study file into its design problem."""

from __future__ import annotations

import math
import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from bayesid._io.errors import InputError
from bayesid._io.progress import Progress
from bayesid._math.arrays import Floats
from bayesid.app.schema import DesignSection, Study
from bayesid.app.study_to_encoders import assume_missing, encoder_noise, named_joint
from bayesid.app.study_to_model import criteria_of, load_model, stated_bounds
from bayesid.design import Design, Search, best_design, design
from bayesid.design.criteria import DOptimal
from bayesid.design.design_problem import Problem
from bayesid.design.motion_limits import Limits
from bayesid.design.plan import Plan
from bayesid.design.separation import Separation
from bayesid.design.trajectories import BSplines, Fourier, PaperExcitation, TrajectoryFamily, extended_posture
from bayesid.recording.recording import JOINT_FAMILIES, WHEEL_SPEED, Recording
from bayesid.recording.sampled_curve import SampledCurve
from bayesid.robot.kinematics import Tip
from bayesid.robot.robot import Robot
from bayesid.simulation.effects import create
from bayesid.simulation.model import Model
from bayesid.simulation.own_effects import check_own_effect

__all__ = ["FILE", "fly_next", "load_loop_problem", "load_problem", "separating", "write_motion"]

SAMPLES = 120  # largest number of samples that are simulated; in longer manoeuvres each of them stands for several
LONGEST_STEP, STEPS = 2.0, 60  # longest step of the integration [s], and smallest number of steps of a manoeuvre
FUNCTIONS = 8  # default number of free functions of every joint
# keys of the base's initial state, which ``[design]`` shares with a recording
BASE_AT_START = ("attitude", "attitude_sigma", "argument_of_latitude")


def load_problem(study: Study | str | Path) -> Problem:
    """Return the design problem of a study, or of its file, which needs no recordings.

    Raises
    ------
    InputError
        If the study does not define a design problem; the message names file, place, value and remedy.
    """
    study = Study.of(study)
    section, model = study.design or DesignSection(), load_model(study).without_torque
    try:
        model = _with_rivals(model, section)
        if not model.bodies:
            raise InputError("nothing is unknown", place="unknowns.bodies", remedy="Name a body to identify")
        tip = Tip.of(model.robot, section.tip_frame)
        limits = Limits(**section.limits.model_dump())
        plan = Plan(
            model=model,
            family=_family(model.robot, section, tip),
            interval=section.interval,
            tip=tip,
            attitude=np.array(section.attitude),
            attitude_sigma=section.attitude_sigma,
            argument_of_latitude=section.argument_of_latitude,
            step=_step(model, section, limits),
            thinning=math.ceil(section.duration / section.interval / SAMPLES),
            wheel_speeds=_wheel_speeds(model.robot, section),
            bounds=stated_bounds(study),
        )
        _check_traceable(plan)
        return Problem(plan, limits, criteria_of(section))
    except InputError as error:
        raise error.within(file=study.file) from None


def load_loop_problem(study: Study) -> Problem:
    """Return the design problem for the loop, which plans by the first criterion named, by default D-optimal.

    What ``[design]`` does not state of the base's initial state is that of the first of the ``[[recordings]]``, whose
    file is not read.

    Raises
    ------
    InputError
        If the study does not define a design problem; the message names file, place, value and remedy.
    """
    section = study.design or DesignSection()
    named = section.criteria or (DOptimal.name,)
    update: dict[str, Any] = {"criteria": named[:1]}
    if study.recordings:
        unsaid = set(BASE_AT_START) - section.model_fields_set
        update |= study.recordings[0].model_dump(include=unsaid, exclude_none=True)
    return load_problem(study.model_copy(update={"design": section.model_copy(update=update)}))


def separating(study: Study, rivals: tuple[str, str]) -> Study:
    """Return a study whose design tells two effects apart, whatever its section ``[design]`` says of criteria.

    Parameters
    ----------
    study : Study
    rivals : tuple of two str
        Labels of the effects.

    Raises
    ------
    InputError
        If both are the same.
    """
    if rivals[0] == rivals[1]:
        raise InputError(
            f"{rivals[0]!r} cannot be distinguished from itself",
            place="--separate",
            remedy="Name two different effects",
        )
    section = study.design or DesignSection()
    chosen = section.model_copy(update={"criteria": (Separation.name,), "rivals": rivals})
    return study.model_copy(update={"design": chosen})


def _with_rivals(model: Model, section: DesignSection) -> Model:
    """Return the model extended by the rival effects that it lacks."""
    try:
        for label in section.rivals:
            if label not in [effect.label for effect in model.effects]:
                rival = create(label)
                check_own_effect(rival, model.robot, model.sensors)
                model = model.extend(rival)
    except InputError as error:
        raise error.within(place="design.rivals") from None
    for effect in model.effects:
        if effect.label in section.rivals and not effect.parameters:
            problem = f"effect {effect.label!r} has no unknown size by which it could be distinguished from others"
            raise InputError(problem, place="design.rivals", remedy="Name effects with parameters")
    return model


def _wheel_speeds(robot: Robot, section: DesignSection) -> dict[str, SampledCurve]:
    """Return the stated speeds of wheels, each constant or through given points."""
    curves = {}
    for name, stated in section.wheel_speed.items():
        try:
            robot.wheel_index(name)
        except InputError as error:
            raise error.within(place=f"design.wheel_speed.{name}") from None
        points = np.array([(0.0, stated)] if isinstance(stated, float) else stated)
        curves[name] = SampledCurve(points[:, 0], points[:, 1:])
    return curves


def _family(robot: Robot, section: DesignSection, tip: Tip) -> TrajectoryFamily:
    names = [joint.name for joint in robot.joints]
    moving = [
        named_joint(name, robot, f"design.joints #{number}")
        for number, name in enumerate(names if section.joints is None else section.joints, start=1)
    ]
    if not moving:
        remedy = "Name at least one joint of the URDF"
        if not names:
            remedy = (
                "The robot has no joints, and only joint motion can be designed: list planned wheel speeds as "
                "recordings without readings, and evaluate them with `bayesid identifiability`"
            )
        raise InputError("no joint is selected to move", place="design.joints", remedy=remedy)
    start, functions = _start(robot, section), section.functions or FUNCTIONS
    if section.parameterisation == "fourier":
        return Fourier(start, moving, section.duration, functions // 2 + 1)
    if section.parameterisation == "b-splines":
        return BSplines(start, moving, section.duration, functions)
    swinging = moving[:3]
    free = [index for index in range(len(names)) if index not in swinging and names[index] not in section.start]
    posture = extended_posture(robot, start, free, swinging[-1], tip)
    return PaperExcitation(posture, section.duration, swinging)


def _start(robot: Robot, section: DesignSection) -> Floats:
    """Return the positions of all joints before and after the manoeuvre, shape (joints,) [rad or m]."""
    start = np.array([np.clip(0.0, joint.lower, joint.upper) for joint in robot.joints])
    for name, value in section.start.items():
        index = named_joint(name, robot, f"design.start.{name}")
        joint = robot.joints[index]
        if not joint.lower <= value <= joint.upper:
            problem = f"{value:g} {joint.unit} is outside the joint's range, {joint.lower:g} to {joint.upper:g}"
            raise InputError(problem, place=f"design.start.{name}", remedy="Start within the range")
        start[index] = value
    return start


def _step(model: Model, section: DesignSection, limits: Limits) -> float:
    """Return an integration step [s] shorter than every time scale; the limits are evaluated every half step."""
    functions = section.functions or FUNCTIONS
    steps = [LONGEST_STEP, section.duration / STEPS, section.duration / (4 * functions), 4.0 * section.interval]
    return min(*steps, 2.0 * limits.finest, *(effect.longest_step for effect in model.effects))


def _check_traceable(plan: Plan) -> None:
    """Reject effects whose tables JAX cannot differentiate with respect to the motion."""
    times = np.linspace(0.0, plan.family.duration, 3)
    for effect in plan.model.effects:
        if not effect.uses("table"):
            continue
        try:
            jax.eval_shape(
                lambda p, effect=effect: effect.table(plan.model.robot, plan.family.motion(p), times),
                jnp.asarray(plan.family.centre),
            )
        except InputError:
            raise
        except (TypeError, ValueError) as error:  # from JAX, or from NumPy for a traced array
            raise InputError(
                f"effect {effect.label!r} computes the joints' motion outside JAX, so the design has no gradient",
                place="model.effects",
                remedy="Omit it from the model for the design",
            ) from error


FILE = "next-manoeuvre.csv"
"""Name of the file of the joints' motion."""

STARTS, ITERATIONS = 2, 60  # effort of the search, a small part of that of ``bayesid design``


def fly_next(study: Study, rivals: tuple[str, str], seed: int, progress: Progress) -> Design:
    """Design a manoeuvre that tells two effects apart within the limits of the study, with little effort.

    Parameters
    ----------
    study : Study
    rivals : tuple of two str
        Labels of the effects.
    seed : int
        Seed of the search.
    progress : Progress

    Raises
    ------
    InputError
        If the study defines no design problem for these effects.
    """
    problem = load_problem(separating(study, rivals))
    noise, _ = assume_missing(encoder_noise(study, problem.plan.model.robot))
    with ThreadPoolExecutor(os.cpu_count()) as executor:
        effort = Search(STARTS, ITERATIONS, executor=executor)
        return best_design(design(problem, seed, noise, effort, progress=progress))


def write_motion(design: Design, file: Path) -> None:
    """Write the positions of the joints and the speeds of the wheels along a manoeuvre as a recording.

    Parameters
    ----------
    design : Design
        Designed manoeuvre.
    file : Path
        Recording to write, as CSV.
    """
    recording = design.manoeuvre.recording
    kept = (f"{JOINT_FAMILIES[0]}.", f"{WHEEL_SPEED}.")
    plan = {key: values for key, values in recording.channels.items() if key.startswith(kept)}
    Recording(design.name, None, recording.time, plan).write(file)
