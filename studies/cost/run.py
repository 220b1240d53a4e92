"""The measurements of the study of cost."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bayesid.app.schema import Study
from bayesid.app.study_to_model import load_manoeuvres, load_model
from bayesid.diagnosis import diagnose
from studies.cost.cases import COMMANDS, DIAGNOSES, write_case
from studies.cost.commands import Run, run_command
from studies.cost.growth import Floor, floor_of, growth, verdict_by_candidates
from studies.cost.nested import Nested, nested
from studies.cost.search_times import SearchTimes, search_times

__all__ = ["Cost", "middle", "run"]

REPEATS = 3
"""Number of runs with compiled code kept, after the one without."""

SAMPLED = ("leak", "payload", "link")
"""Diagnoses after which the extended model is sampled, by their titles."""

TITLES = tuple(item.title for item in DIAGNOSES)
"""Titles of all diagnoses that are timed."""

COUNTS = (10, 20, 40, 1000)
"""Numbers of candidates of the catalogue; the last one takes all."""

LIMIT = 600.0
"""Time at which a nested sampler is stopped [s]."""


@dataclass(frozen=True)
class Cost:
    """Times and memory.

    Attributes
    ----------
    diagnoses : dict of str to list of Run
        Diagnoses without samples by what is hidden, the first of each without compiled code, the others with it.
    sampled : dict of str to Run
        Diagnoses with 4,000 effective samples of the extended model, compiled code kept.
    commands : dict of str to list of Run
        Other commands on the recordings with nothing hidden, the first run of each without compiled code.
    candidates : dict of int to float
        Time of a verdict by the number of candidates [s].
    growth : dict of str to dict of int to float
        Time of one evaluation by what grows [s].
    floor : Floor
    nested : Nested or None
        One candidate by nested sampling.
    search : SearchTimes or None
        A search for manoeuvres.
    """

    diagnoses: dict[str, list[Run]]
    sampled: dict[str, Run]
    commands: dict[str, list[Run]]
    candidates: dict[int, float]
    growth: dict[str, dict[int, float]]
    floor: Floor
    nested: Nested | None
    search: SearchTimes | None


def run(
    *,
    full: bool = False,
    seed: int = 0,
    titles: tuple[str, ...] = TITLES,
    commands: tuple[str, ...] = tuple(COMMANDS),
    progress: Callable[[str], None] = lambda text: None,
) -> Cost:
    """Measure everything.

    Parameters
    ----------
    full : bool
        Whether to repeat, to sample, and to run the nested sampler up to ten minutes rather than ten seconds.
    seed : int
        Seed of the nested sampler.
    titles, commands : tuple of str
        Diagnoses and other commands to time.
    progress : callable, optional
        Receives a line before each part.
    """
    repeats = REPEATS if full else 1
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        chosen = [item for item in DIAGNOSES if item.title in titles]
        files = {item.title: write_case(item.case, place / f"study-{k}") for k, item in enumerate(chosen)}

        def timed(name: str, words: tuple[str, ...], file: Path, count: int, cache: Path) -> list[Run]:
            found = []
            for number in range(count):
                progress(f"{name}, {'cold' if not any(cache.glob('*')) else 'warm'}")
                found.append(run_command(words, file, place / f"out-{name}-{number}", cache))
            return found

        diagnoses, sampled = {}, {}
        for item in chosen:
            cache = place / f"cache-{item.title}"
            words = ("diagnose", "--no-sample", "--no-fly-next")
            diagnoses[item.title] = timed(item.title, words, files[item.title], 1 + repeats, cache)
            if full and item.title in SAMPLED:
                runs = timed(f"{item.title}, samples", ("diagnose", "--no-fly-next"), files[item.title], 2, cache)
                sampled[item.title] = runs[-1]
        others = {
            name: timed(name, COMMANDS[name][0], files[chosen[0].title], 1 + repeats, place / f"cache-{name}")
            for name in commands
        }
        progress("search for manoeuvres")
        search = search_times(place / "cache-search") if full else None
        progress("candidates and nested sampling")
        study = Study.load(files[chosen[-1 if len(chosen) < 2 else 1].title])
        model = load_model(study)
        manoeuvres = load_manoeuvres(study, model.robot)
        found = diagnose(model, manoeuvres, seed)
        by_candidates = verdict_by_candidates(model, manoeuvres, COUNTS if full else COUNTS[-1:])
        one = nested(found, LIMIT if full else 10.0, seed) if found.verdict.causes else None
    progress("growth of one evaluation")
    grown = growth(20) if full else growth(2, sizes=1)
    return Cost(diagnoses, sampled, others, by_candidates, grown, floor_of(20 if full else 2), one, search)


def middle(runs: list[Run], value: Callable[[Run], float]) -> float:
    """Return the median of the runs with compiled code kept."""
    return float(np.median([value(item) for item in runs[1:]]))
