"""The measurements: commands in processes of their own, growth of one evaluation, its floor, and a nested sampler."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from bayesid import BodyPrior, InputError, Manoeuvre, Model, Posterior
from bayesid._io.files import write_json
from bayesid.app.schema import Study
from bayesid.app.study_to_model import load_manoeuvres, load_model
from bayesid.diagnosis import Diagnosis, candidates, diagnose
from bayesid.inference import choose_parameterisation, compiled, maximise
from studies.benchmark.run import best_of, chain, posterior_of, seconds_per_evaluation
from studies.common.code_version import fingerprint
from studies.common.ets7 import ets7
from studies.common.provenance import MODELS
from studies.cost.search_times import SearchTimes, search_times
from studies.peers.density import Target
from studies.peers.samplers import Budget, dynesty
from studies.truth import hidden_causes

FAST = 1000.0  # rate of fast inertial sensors [Hz]
FIRST_SEED = 7100  # seed of the first case; those of tests and of the campaign are others


class Diagnosed(NamedTuple):
    """A diagnosis that is timed."""

    title: str  # what is hidden
    case: str  # name of the case of `studies.truth.hidden_causes`
    # longest wanted times from files to verdict, with compiled code kept and without [s]
    warm: float
    cold: float


# single causes within 5 s, cold 20 s; pairs and what nobody listed within twice that
DIAGNOSES = (
    Diagnosed("nothing hidden", "null, three joints", 5.0, 20.0),
    Diagnosed("leak", "thruster-leak", 5.0, 20.0),
    Diagnosed("payload", "payload:link3", 5.0, 20.0),
    Diagnosed("link error", "link-inertia:link2", 5.0, 20.0),
    Diagnosed("wheel and bias", "wheel-momentum, accel-bias", 10.0, 40.0),
    Diagnosed("growing torque", "growing-torque", 10.0, 40.0),
    Diagnosed("oscillating torque", "swinging-torque", 10.0, 40.0),
)


class Flown(NamedTuple):
    """Recordings with a hidden wheel, alike but for their motion."""

    number: int
    duration: float  # of each [s]
    fast: bool = False  # inertial sensors at 1 kHz and six encoders at 500 Hz, rather than all of three joints at 2 Hz

    def __str__(self) -> str:
        """Return their number, and how long they are where they are logs of fast sensors."""
        return f"{self.number} recordings" + (f" of {self.duration:g} s at 1 kHz" if self.fast else "")


class Large(NamedTuple):
    """A diagnosis, or a check, of much data that is timed."""

    command: str
    data: Flown
    # longest wanted time to the verdict, or of the check, with compiled code kept [s], and largest wanted memory [GB]
    seconds: float
    memory: float

    @property
    def title(self) -> str:
        """Command and recordings."""
        return f"{self.command}, {self.data}"


LOGS, FORTY, HUNDREDS = Flown(3, 600.0, fast=True), Flown(40, 160.0), Flown(200, 160.0)
LARGE = (
    Large("check", LOGS, 20.0, 2.0),
    Large("diagnose", LOGS, 60.0, 2.0),
    Large("check", FORTY, 15.0, 2.0),
    Large("diagnose", FORTY, 45.0, 2.0),
    Large("check", HUNDREDS, 60.0, 2.0),
    Large("diagnose", HUNDREDS, 240.0, 2.0),
)

# other commands, and the longest wanted time with compiled code kept, from files to report [s]
COMMANDS = {"check": None, "identify": 20.0, "identifiability": 30.0, "design": 120.0}


def write_case(name: str, folder: Path) -> Path:
    """Write the files of a case, three recordings of 140 to 160 s, and return the study's."""
    number = next(k for k, case in enumerate(hidden_causes.CASES) if case.name == name)
    return hidden_causes.CASES[number].make(folder, FIRST_SEED + number)


def write_large(data: Flown, folder: Path) -> Path:
    """Write the files of recordings with a hidden wheel, noise per root hertz alike, and return the study's."""
    case = next(case for case in hidden_causes.CASES if case.name == "wheel-momentum")
    latitudes = np.random.default_rng(FIRST_SEED).uniform(0.0, 2.0 * np.pi, data.number).tolist()
    fixed = {"manoeuvres": {"count": data.number, "duration": data.duration}, "latitudes": latitudes}
    if data.fast:
        noise = float(np.sqrt(0.5 * FAST))  # that of 2 Hz per root hertz
        sigmas = {"rate_sigma": 1e-5 * noise, "accel_sigma": 1e-5 * noise, "encoder_sigma": 1e-6 * noise * 0.5**0.5}
        periods = {"rate_period": 1.0 / FAST, "accel_period": 1.0 / FAST, "encoder_period": 2.0 / FAST}
        case = replace(case, urdf=MODELS / "ets7.urdf")
        fixed |= {"sensors": {**sigmas, **periods}, "flown": 0.1}
    return replace(case, fixed={**case.fixed, **fixed}).make(folder, FIRST_SEED + 100)


PROGRAM = "from bayesid.app.command_line import main; main()"

AFTER_VERDICT = ("consequences", "sample", "design", "report")  # phases of a diagnosis that follow the verdict
STATING = ("diagnosis.json", "identification.json")  # files that state the time by phase


class Run(NamedTuple):
    """One command."""

    # time from its start to its end, and processor time of all its threads [s]
    wall: float
    processor: float
    memory: float  # largest resident memory [GB]
    # time by phase, where the command states it [s]; "start" is what comes before the first, import and files
    phases: dict[str, float]

    @property
    def to_verdict(self) -> float:
        """Time of a diagnosis from its start to the verdict [s]."""
        return self.wall - sum(self.phases.get(name, 0.0) for name in AFTER_VERDICT)


def run_command(words: Sequence[str], study: Path, output: Path, cache: Path) -> Run:
    """Run a command on a study and measure it.

    Parameters
    ----------
    words : sequence of str; name of the command and its options
    study : Path; study file
    output : Path; folder of the results, which must not exist
    cache : Path; folder of compiled code; an empty one makes the run a cold one

    Raises
    ------
    RuntimeError
        If the command fails.
    """
    command = [sys.executable, "-c", PROGRAM, words[0], str(study), "--output", str(output), *words[1:]]
    environment = os.environ | {"BAYESID_CACHE": str(cache)}
    began = time.perf_counter()
    with subprocess.Popen(
        command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    ) as process:
        said = process.stderr.read() if process.stderr else ""
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    wall = time.perf_counter() - began
    if process.returncode:
        raise RuntimeError(f"{' '.join(words)} of {study} failed: {said.strip()[-500:]}")
    phases: dict[str, float] = {}
    for name in STATING:
        if (output / name).is_file():
            phases = json.loads((output / name).read_text(encoding="utf-8"))["seconds"]
            phases = {"start": max(wall - sum(phases.values()), 0.0), **phases}
    return Run(wall, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 2.0**20, phases)


class Timed(NamedTuple):
    """Commands that are timed once, whose runs a folder stores."""

    place: Path  # of results and runs
    progress: Callable[[str], None]  # receives a line before each run

    def runs(self, name: str, words: Sequence[str], study: Path, count: int, cache: Path) -> list[Run]:
        """Return so many runs of a command, those that are stored and new ones; see `run_command`."""
        made = []
        for number in range(count):
            output, record = self.place / f"out-{name}-{number}", self.place / f"run-{name}-{number}.json"
            if not record.is_file():
                if number == 0 and cache.name == f"cache-{name}":
                    shutil.rmtree(cache, ignore_errors=True)  # what an interrupted run compiled
                shutil.rmtree(output, ignore_errors=True)
                self.progress(f"{name}, {'warm' if cache.is_dir() else 'cold'}")
                write_json(record, run_command(words, study, output, cache)._asdict())
            made.append(Run(**json.loads(record.read_text(encoding="utf-8"))))
        return made


MATRIX, VECTOR = 1500, 30_000_000  # sizes of the matrix product and of the sum that measure what the machine can do


class Floor(NamedTuple):
    """What one evaluation of the log likelihood needs, and what one core of this machine gives."""

    # floating-point operations, and bytes read and written by all compiled operations, of one evaluation in a batch
    operations: float
    traffic: float
    # operations per second of a large matrix product, and bytes per second of a sum of large vectors
    speed: float
    bandwidth: float
    seconds: float  # time of one evaluation, both cores [s]

    @property
    def least(self) -> float:
        """Time that operations alone would take at the speed of a matrix product [s]."""
        return self.operations / self.speed


def floor_of(repeats: int) -> Floor:
    """Count what an evaluation needs and measure what the machine gives."""
    posterior = posterior_of(ets7())
    batch = 64
    z = jnp.zeros((batch, posterior.size)) + posterior.starting_point()

    def chi2(points: jax.Array) -> jax.Array:
        function = jax.vmap(lambda one: compiled.residuals(structure, numbers, one, arrays))
        return jnp.sum(function(points) ** 2, axis=(1, 2, 3))

    structure, numbers, arrays = posterior.structure, posterior.numbers, posterior.data.arrays
    cost = jax.jit(chi2).lower(z).compile().cost_analysis()
    counted = cost if isinstance(cost, dict) else {}
    a = np.random.default_rng(0).normal(size=(MATRIX, MATRIX))
    v, w = np.ones(VECTOR), np.ones(VECTOR)
    product, total = best_of(lambda: a @ a, repeats), best_of(lambda: np.add(v, w, out=w), repeats)
    return Floor(
        float(counted.get("flops", np.nan)) / batch,
        float(counted.get("bytes accessed", np.nan)) / batch,
        2.0 * MATRIX**3 / product,
        24.0 * VECTOR / total,
        seconds_per_evaluation(posterior, repeats),
    )


def growth(repeats: int, sizes: int | None = None) -> dict[str, dict[int, float]]:
    """Return the time of one evaluation by samples, recordings, links, unknowns and walkers in a batch [s].

    Parameters
    ----------
    repeats : int; repetitions, of which the fastest counts
    sizes : int, optional; how many sizes of each are measured, the smallest ones; by default all
    """
    robot = ets7()
    three = posterior_of(robot, recordings=3)

    def seconds(posterior: Posterior) -> float:
        return seconds_per_evaluation(posterior, repeats)

    return {
        "samples of a recording": {
            round(120.0 / interval) + 1: seconds(posterior_of(robot, interval=interval))
            for interval in (1.0, 0.5, 0.25, 0.125)[:sizes]
        },
        "recordings": {n: seconds(posterior_of(robot, recordings=n)) for n in (1, 2, 4, 8)[:sizes]},
        "links": {n: seconds(posterior_of(chain(n))) for n in (3, 6, 12, 24, 48)[:sizes]},
        "unknowns": {chosen.size: seconds(chosen) for chosen in (_with_bodies(three, n) for n in (1, 2, 4, 7)[:sizes])},
        "walkers in a batch": {n: _seconds_of_batch(three, n, repeats) / n for n in (1, 4, 16, 64, 256)[:sizes]},
    }


def _with_bodies(posterior: Posterior, bodies: int) -> Posterior:
    """Return the posterior with more unknown bodies, the base first."""
    model = posterior.model
    massive = [name for name, link in model.robot.links.items() if link.inertial.mass > 0.0]
    names = sorted(massive, key=lambda name: name != model.robot.base)[:bodies]
    priors = tuple(BodyPrior(name, model.robot.link(name).inertial, 0.3) for name in names)
    changed = Model(model.robot, model.sensors, priors, model.orbit, model.effects)
    return Posterior.of(changed, posterior.manoeuvres, step=posterior.step)


def _seconds_of_batch(posterior: Posterior, count: int, repeats: int) -> float:
    z = posterior.starting_point() + 0.01 * np.random.default_rng(0).normal(size=(count, posterior.size))
    return best_of(lambda: posterior.log_density(z), repeats)


def verdict_by_candidates(model: Model, manoeuvres: list[Manoeuvre], counts: tuple[int, ...]) -> dict[int, float]:
    """Return the time of the verdict by the number of candidates of the catalogue [s].

    The code must be compiled: the same recordings have been diagnosed in this process.
    """
    every = candidates(model, longest=float(manoeuvres[0].recording.time[-1]))
    seconds = {}
    for count in counts:
        chosen = every[:count] if count < len(every) else every
        seconds[len(chosen)] = diagnose(model, manoeuvres, effects=chosen).seconds["verdict"]
    return seconds


class Nested(NamedTuple):
    """What one run of dynesty took."""

    seconds: float  # processor time [s]
    unknowns: int  # number of unknowns of the extended model
    done: bool  # whether it ended by itself, before its limit of time


def nested(diagnosis: Diagnosis, limit: float, seed: int) -> Nested | None:
    """Run dynesty on the likelihood of a diagnosis' extended model; None where dynesty is not installed.

    It gets coordinates in which the Laplace approximation at the mode is a standard normal, its best case.

    Parameters
    ----------
    diagnosis : Diagnosis; with a named cause
    limit : float; time at which it is stopped [s]
    seed : int
    """
    if find_spec("dynesty") is None:
        return None
    rng = np.random.default_rng(seed)
    posterior, optimum = maximise(diagnosis.posterior, rng, start=diagnosis.start)
    target = Target(choose_parameterisation(posterior, optimum, rng), optimum)
    reached = dynesty(target, Budget(effective_samples=4000.0, seconds=limit), rng)
    return Nested(reached.seconds, target.size, reached.finished)


REPEATS = 3  # number of runs with compiled code kept, after the one without
SAMPLED = ("leak", "payload", "link error")  # diagnoses after which the extended model is sampled, by their titles
TITLES = tuple(case.title for case in DIAGNOSES)  # titles of all diagnoses that are timed
COUNTS = (10, 20, 40, 1000)  # numbers of candidates of the catalogue; the last one takes all
LIMIT = 600.0  # time at which a nested sampler is stopped [s]


@dataclass(frozen=True)
class Cost:
    """Times and memory."""

    # diagnoses without samples by what is hidden, the first of each without compiled code, the others with it
    diagnoses: dict[str, list[Run]]
    sampled: dict[str, Run]  # diagnoses with 4,000 effective samples of the extended model, compiled code kept
    # other commands on the recordings with nothing hidden, the first run of each without compiled code
    commands: dict[str, list[Run]]
    large: dict[str, list[Run]]  # checks and diagnoses of much data, the first run of each without compiled code; none
    # of one that was refused for the memory that it needs
    candidates: dict[int, float]  # time of a verdict by the number of candidates [s]
    growth: dict[str, dict[int, float]]  # time of one evaluation by what grows [s]
    floor: Floor
    nested: Nested | None  # one candidate by nested sampling
    search: SearchTimes | None  # a search for manoeuvres
    full: bool = False  # whether runs were repeated
    before: Path | None = None  # times that an earlier run wrote, with which these are compared


def run(
    *,
    full: bool = False,
    seed: int = 0,
    titles: tuple[str, ...] = TITLES,
    commands: tuple[str, ...] = tuple(COMMANDS),
    large: tuple[Large, ...] = LARGE,
    before: Path | None = None,
    runs: Path | None = None,
    progress: Callable[[str], None] = lambda text: None,
) -> Cost:
    """Measure everything.

    Parameters
    ----------
    full : bool; whether to repeat, to sample, and to run the nested sampler up to ten minutes rather than ten seconds
    seed : int; seed of the nested sampler
    titles, commands : tuple of str; diagnoses and other commands to time
    large : tuple of Large; runs on much data, which only a full study makes
    before : Path, optional; times that an earlier run wrote, to compare with
    runs : Path, optional; folder that stores the runs of commands and their compiled code, to resume an interrupted
        study
    progress : callable, optional; receives a line before each part

    Raises
    ------
    InputError
        If other code made the stored runs.
    """
    repeats = REPEATS if full else 1
    with tempfile.TemporaryDirectory() as folder:
        place = stored_in(runs) if runs else Path(folder)
        chosen = [case for case in DIAGNOSES if case.title in titles]
        files = {case.title: write_case(case.case, place / f"study-{k}") for k, case in enumerate(chosen)}

        timed = Timed(place, progress).runs
        diagnoses, sampled = {}, {}
        for case in chosen:
            cache = place / f"cache-{case.title}"
            words = ("diagnose", "--no-sample", "--no-fly-next")
            diagnoses[case.title] = timed(case.title, words, files[case.title], 1 + repeats, cache)
            if full and case.title in SAMPLED:
                after = timed(f"{case.title}, samples", ("diagnose", "--no-fly-next"), files[case.title], 2, cache)
                sampled[case.title] = after[-1]
        others = {
            name: timed(name, (name,), files[chosen[0].title], 1 + repeats, place / f"cache-{name}")
            for name in commands
        }
        on_large = {}
        for row in large if full else ():
            file = place / str(row.data) / "study.toml"
            file = file if file.is_file() else write_large(row.data, file.parent)
            asked = ("diagnose", "--no-sample", "--no-fly-next") if row.command == "diagnose" else (row.command,)
            try:
                on_large[row.title] = timed(row.title, asked, file, 2, place / "cache-large")
            except RuntimeError as refusal:
                progress(str(refusal))
                on_large[row.title] = []
        progress("search for manoeuvres")
        search = search_times() if full else None
        progress("candidates and nested sampling")
        study = Study.load(files[chosen[-1 if len(chosen) < 2 else 1].title])
        model = load_model(study)
        manoeuvres = load_manoeuvres(study, model.robot)
        diagnosis = diagnose(model, manoeuvres, seed)
        by_candidates = verdict_by_candidates(model, manoeuvres, COUNTS if full else COUNTS[-1:])
        one = nested(diagnosis, LIMIT if full else 10.0, seed) if diagnosis.verdict.causes else None
    progress("growth of one evaluation")
    grown = growth(20) if full else growth(2, sizes=1)
    floor = floor_of(20 if full else 2)
    return Cost(diagnoses, sampled, others, on_large, by_candidates, grown, floor, one, search, full, before)


def stored_in(runs: Path) -> Path:
    """Return the folder that stores runs, after noting in it which code makes them."""
    runs.mkdir(parents=True, exist_ok=True)
    made_by, numbers = runs / "made_by.json", fingerprint("cost")
    if not made_by.is_file():
        write_json(made_by, {"numbers": numbers})
    if json.loads(made_by.read_text(encoding="utf-8"))["numbers"] != numbers:
        raise InputError("these runs were made by other code", file=runs, remedy="Choose a new folder")
    return runs


def middle(runs: list[Run], value: Callable[[Run], float]) -> float:
    """Return the median of the runs with compiled code kept."""
    return float(np.median([value(run) for run in runs[1:]]))
