"""Trials: right studies with anything hidden in them, and studies with one mistake, each of MuJoCo."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from bayesid._math.kept_jit import forget_executables
from bayesid.app.convention_remedies import conventions_of, with_remedies
from bayesid.app.schema import Study
from bayesid.app.study_to_model import load_manoeuvres, load_model
from bayesid.inference.conventions import find_conventions
from studies.common.monte_carlo import Workers, run_trials
from studies.conventions.drawn_robots import write_robot
from studies.conventions.mistakes import MISTAKES
from studies.conventions.right_studies import UNUSUAL, circumstances
from studies.truth.bodies import SERVICER3, SERVICER4
from studies.truth.hidden_causes import CASES
from studies.truth.mujoco import Manoeuvres, Truth, write_study
from studies.truth.recordings import Sensors

ROBOTS: Mapping[str, Path] = {"servicer3": SERVICER3, "servicer4": SERVICER4}
DRAWN = range(8)  # seeds of the robots that are drawn
AMPLITUDES, NOISES = (0.2, 0.6, 1.2), (1e-6, 1e-5, 1e-4)  # of the joints [rad], and of all sensors [rad/s, m/s2]
VISIBLE = 3.0  # rms of the readings without noise, in sigma, from which on a mistake in them can be seen
LOOKS = 12  # circumstances of each right study
STRENGTHS = (0.3, 1.0, 3.0, 10.0, 30.0)  # of what is hidden, relative to what a diagnosis sees well


@dataclass(frozen=True)
class Outcome:
    """What was said of one study."""

    subject: str  # hidden cause of a right study, or mistake
    wrong: bool  # whether a mistake was made
    robot: str
    amplitude: float
    noise: float
    said: tuple[str, ...]  # names of the conventions
    expected: tuple[str, ...]
    mended: bool  # whether no convention is wrong once the remedies are written
    visible: bool  # whether the readings that a mistake concerns stand out of their noise
    seconds: float  # processor time of a look, code compiled before: of several, the median
    looks: int = 1  # number of circumstances in which it was looked at
    alarms: int = 0  # number of those of a right study in which something was said

    @property
    def right(self) -> bool:
        """Whether exactly what is wrong was named, and its remedy put the study right."""
        return set(self.said) == set(self.expected) and self.mended


def tasks(full: bool) -> list[dict[str, Any]]:
    """Return what is tried: every hidden cause of the catalogue and beyond, and every mistake."""
    strengths = STRENGTHS if full else STRENGTHS[1::2]
    looks = LOOKS if full else 3
    right = [
        {"case": case.name, "strength": strength, "seed": 5000 + 17 * number, "looks": looks}
        for number, case in enumerate(CASES)
        for strength in strengths
        if strength <= 1.0 or case.name != "gravity-gradient"  # its orbit would be inside the Earth
    ]
    right += [
        {"case": name, "strength": 1.0, "seed": 400 + k, "looks": looks}
        for name in UNUSUAL
        for k in range(20 if full else 1)
    ]
    robots = [*ROBOTS, *(f"drawn{seed}" for seed in DRAWN)] if full else ["servicer3"]
    wrong = [
        {"mistake": name, "robot": robot, "amplitude": size, "noise": noise, "seed": 9000 + first}
        for first, name in enumerate(MISTAKES)
        for second, robot in enumerate(robots)
        for size, noise in (_sizes(first + second) if full else [(0.6, 1e-5)])
    ]
    return right + wrong


def _sizes(turn: int) -> list[tuple[float, float]]:
    """Return each amplitude once, each with another noise: three robots or mistakes in turn see all pairs."""
    return [(size, NOISES[(turn + number) % len(NOISES)]) for number, size in enumerate(AMPLITUDES)]


def trial(task: Mapping[str, Any], generator: np.random.Generator) -> dict[str, Any]:
    """Make one study, and return what is said of its conventions."""
    with TemporaryDirectory() as folder:
        outcome = _right_study(task, Path(folder)) if "case" in task else _mistaken(task, Path(folder))
    forget_executables()  # robots and shapes differ from trial to trial
    return asdict(outcome)


def _right_study(task: Mapping[str, Any], folder: Path) -> Outcome:
    name, seed, looks = task["case"], task["seed"], task["looks"]
    case = next((case for case in CASES if case.name == name), None)
    study = Study.load(UNUSUAL[name](folder, seed) if case is None else case.make(folder, seed, task["strength"]))
    model = load_model(study)
    manoeuvres = load_manoeuvres(study, model.robot)
    seconds, said = [], []
    for changed, recorded in circumstances(model, manoeuvres, np.random.default_rng([seed, 2]), looks):
        began = time.process_time()
        said.append([convention.name for convention in find_conventions(changed, recorded)])
        seconds.append(time.process_time() - began)
    names = tuple(name for names in said for name in names)
    robot = model.robot.name if case is None else case.urdf.stem
    return Outcome(
        name, False, robot, 0.0, 0.0, names, (), True, True, float(np.median(seconds)), looks, sum(map(bool, said))
    )


def _mistaken(task: Mapping[str, Any], folder: Path) -> Outcome:
    noise, mistake = task["noise"], MISTAKES[task["mistake"]]
    sensors = Sensors(rate_sigma=noise, accel_sigma=noise, attitude_sigma=noise, attitude_period=2.0)
    manoeuvres = Manoeuvres(count=1, duration=60.0, amplitude=task["amplitude"])
    draw = np.random.default_rng(task["seed"])
    name = task["robot"]
    urdf = ROBOTS[name] if name in ROBOTS else write_robot(folder / "drawn.urdf", int(name.removeprefix("drawn")))
    study = write_study(folder / "study", urdf, draw, sensors=sensors, manoeuvres=manoeuvres)
    file, visible = study.file, _is_visible(study.truths[0], mistake.names, noise)
    mistake.make(file)
    conventions = conventions_of(Study.load(file))
    said = tuple(convention.name for convention in conventions)
    file.write_text(with_remedies(file.read_text(), [convention.remedy for convention in conventions]))
    began = time.process_time()
    mended = bool(conventions) and not conventions_of(Study.load(file))
    seconds = time.process_time() - began
    kind = (task["mistake"], True, task["robot"], task["amplitude"], noise)
    return Outcome(*kind, said, mistake.names, mended, visible, seconds)


def _is_visible(truth: Truth, names: tuple[str, ...], noise: float) -> bool:
    """Return whether each reading that a mistake concerns, or any where it is one of joints or times, is seen."""
    sizes = {"rate": truth.rate, "accel": truth.accel}
    seen = {kind: float(np.sqrt((values**2).mean())) > VISIBLE * noise for kind, values in sizes.items()}
    concerned = {name.split(":")[2] for name in names} & set(seen)
    return all(seen[kind] for kind in concerned) if concerned else any(seen.values())


def run(
    full: bool = False,
    trials: Path | None = None,
    workers: Workers = 1,
    progress: Callable[[str], None] = lambda text: None,
) -> list[Outcome]:
    """Make all trials, those that a store does not hold yet.

    Parameters
    ----------
    full : bool, optional
    trials : path, optional; store of the trials
    workers : int or Executor, optional
    progress : callable, optional
    """
    made = run_trials(trial, tasks(full), trials, workers=workers, progress=progress).complete()
    return [Outcome(**{**row, "said": tuple(row["said"]), "expected": tuple(row["expected"])}) for row in made]
