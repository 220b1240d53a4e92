"""Evaluations on a device beside this machine's processor; where there is none, what was measured on the last one."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import NamedTuple

import jax
import numpy as np

from bayesid import Posterior
from bayesid._io.files import write_json
from bayesid._math.device import device
from bayesid.design import DOptimal, Search
from bayesid.design.trajectory_search import optimise
from bayesid.inference import identify
from bayesid.report import Document
from bayesid.report.numbers import format_number
from studies.common import mission
from studies.common.report_parts import columns

BATCHES = (12, 1024, 8192)  # numbers of points per call
SIMULATIONS = 500_000.0  # wanted simulations of 120 s per second
SECONDS = 2.0  # largest wanted time of an identification of the base to `SAMPLES` effective samples, compiled [s]
SAMPLES = 4000.0  # its effective samples
STARTS, ITERATIONS = 24, 10  # descents of the search for manoeuvres, and most iterations of each
REPEATS = 5  # times that a call is measured, the shortest counts


class DeviceTimes(NamedTuple):
    """What one device takes for the posterior of three recordings of 120 s, and for a search for manoeuvres."""

    name: str  # of the device
    date: str  # when it was measured
    per_point: dict[int, float]  # time of a point by the number of points per call [s]
    identification: float | None  # time of an identification to `SAMPLES` effective samples, None if not measured [s]
    search: float | None = None  # time of `search_seconds`, None if not measured [s]

    @property
    def simulations(self) -> float:
        """Largest number of simulations per second; a point has three of them."""
        return 3.0 / min(self.per_point.values())

    @classmethod
    def read(cls, file: Path) -> DeviceTimes:
        """Read what `write` left."""
        content = json.loads(file.read_text(encoding="utf-8"))
        return cls(**{**content, "per_point": {int(key): value for key, value in content["per_point"].items()}})

    def write(self, file: Path) -> None:
        """Write the figures with their date, for machines without such a device."""
        write_json(file, self._asdict())


LAST = Path(__file__).with_name("last_device.json")
"""Figures of the last device that was there; 65,536 points in one call ran out of its 80 GB."""


def measured_on_device(posterior: Posterior, seed: int = 0) -> DeviceTimes | None:
    """Measure the device beside the processor, None where there is none.

    Parameters
    ----------
    posterior : Posterior; of three recordings
    seed : int; seed of the points and of the sampler
    """
    if device().platform == "cpu":
        return None
    rng, per_point = np.random.default_rng(seed), {}
    for batch in BATCHES:
        z = posterior.starting_point() + 0.01 * rng.normal(size=(batch, posterior.size))
        per_point[batch] = _shortest(partial(posterior.log_density, z)) / batch
    identify(posterior, seed, effective_samples=SAMPLES)
    seconds = _shortest(lambda: identify(posterior, seed + 1, effective_samples=SAMPLES), 1)
    today = f"{datetime.now(UTC):%Y-%m-%d}"
    return DeviceTimes(jax.devices()[0].device_kind, today, per_point, seconds, search_seconds(seed))


def search_seconds(seed: int = 0, starts: int = STARTS, iterations: int = ITERATIONS) -> float:
    """Return the time of a search for the d-optimal manoeuvre of ETS-VII from many starts, compiled [s].

    Parameters
    ----------
    seed : int; seed of the starts
    starts, iterations : int; number of descents, and most iterations of each
    """
    criterion = DOptimal()
    problem = mission.problem(mission.base_unknown(), mission.splines(), criterion)
    problem.compile()
    begin = time.perf_counter()
    optimise(problem, criterion, np.random.default_rng(seed), Search(starts=starts, iterations=iterations))
    return time.perf_counter() - begin


def _shortest(function: Callable[[], object], repeats: int = REPEATS) -> float:
    """Return the shortest time of a call, after one that is not counted [s]."""
    times = []
    for _ in range(repeats + 1):
        begin = time.perf_counter()
        function()
        times.append(time.perf_counter() - begin)
    return min(times[1:])


def device_targets(measured: DeviceTimes | None) -> list[tuple[str, str, str]]:
    """Return the targets of a device, what the present or the last one reached, and whether that is enough."""
    last = measured or DeviceTimes.read(LAST)
    taken = "not measured" if last.identification is None else f"{last.identification:.2g} s"
    soon = last.identification is not None and last.identification <= SECONDS
    return [
        (
            f"simulations of 120 s per second: at least {SIMULATIONS:.0f}",
            format_number(last.simulations, 3),
            _reached(last.simulations >= SIMULATIONS),
        ),
        (
            f"time of an identification to {SAMPLES:.0f} effective samples, compiled: at most {SECONDS:g} s",
            taken,
            "not tested" if last.identification is None else _reached(soon),
        ),
    ]


def _reached(enough: bool) -> str:
    return "reached" if enough else "not reached"


def add_device(document: Document, measured: DeviceTimes | None, evaluation: float, search: float | None) -> None:
    """Add the section on devices.

    Parameters
    ----------
    document : Document
    measured : DeviceTimes or None
    evaluation : float; time of a simulation of one recording on this machine's processor [s]
    search : float or None; time of `search_seconds` on this machine's processor, None if not measured [s]
    """
    last = measured or DeviceTimes.read(LAST)
    document.section("Accelerator")
    if measured is None:
        document.paragraph(
            f"This machine has no accelerator, so nothing was tested here; the figures are those of an {last.name}, "
            f"{last.date}. There, 65536 points in one call exceeded 80 GB. Calls are now sized to the memory of the "
            "device; most of it is taken by intermediate results for every sample."
        )
    rows = [
        [str(batch), format_number(1e6 * seconds, 3), format_number(3.0 / seconds, 3)]
        for batch, seconds in last.per_point.items()
    ]
    rows.append(
        ["one, on this machine's processor", format_number(3e6 * evaluation, 3), format_number(1.0 / evaluation, 3)]
    )
    document.table(
        ["points per call", "time of a point [µs]", "simulations per second"],
        rows,
        f"Time of a point, which is one evaluation of the posterior of three recordings of 120 s, on {last.name}; on "
        "this machine it is three times the time with one recording.",
        columns("lrr"),
    )
    document.table(
        ["target", "measured", "result"],
        device_targets(measured),
        f"Targets of an accelerator, and what was measured on {last.name}, {last.date}.",
        ["left"] * 3,
    )
    absent = "not tested: no accelerator here" if measured is None else "not measured"
    document.table(
        ["search for manoeuvres", "time [s]"],
        [
            [f"{last.name}, {last.date}", absent if last.search is None else format_number(last.search, 3)],
            ["this machine's processor", "not measured" if search is None else format_number(search, 3)],
        ],
        f"d-optimal manoeuvre of ETS-VII, 120 s, 48 free numbers: {STARTS} starts, at most {ITERATIONS} iterations per "
        "start, compiled.",
        columns("lr"),
    )
