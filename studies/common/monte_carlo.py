"""Monte Carlo trials that can be interrupted, run in parallel, and repeat exactly from their seed.

A store is a text file with one JSON object per line: first what function ran with what seed, then one line per trial
with the version of the code that made it.
A line is appended in one write when its trial ends, so that a kill loses the trials that were running and no other.
"""

from __future__ import annotations

import gzip
import json
import os
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass, field, is_dataclass
from multiprocessing import get_context, parent_process
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np

from studies.common.code_version import CodeVersion, study_of

Workers = int | Executor  # number of processes of this machine, one for this process itself; or an executor of any kind

# task and source of random numbers -> result; task and result are made of what JSON has, or of arrays
Trial = Callable[[Any, np.random.Generator], Any]


@dataclass(frozen=True)
class Outcomes:
    """Results of trials in the order of their tasks, None where there is none, and messages of those that failed."""

    results: list[Any]  # results as JSON has them: lists in place of tuples and arrays
    # messages by the number of the trial; a failed trial is tried again on the next run
    failures: dict[int, str] = field(default_factory=dict)

    def complete(self) -> list[Any]:
        """All results.

        Raises
        ------
        RuntimeError
            If a trial has failed.
        """
        if self.failures:
            number, message = min(self.failures.items())
            many = f"{len(self.failures)} of {len(self.results)}"
            raise RuntimeError(f"{many} trials failed, the first is number {number}: {message}")
        return self.results


def run_trials(
    function: Trial,
    tasks: Sequence[Any],
    store: str | Path | None = None,
    *,
    seed: int = 0,
    workers: Workers = 1,
    progress: Callable[[str], None] = lambda text: None,
) -> Outcomes:
    """Run a function on every task that the store does not hold yet.

    Trial i draws from child i of ``numpy.random.SeedSequence(seed)``, which depends on neither order nor workers.

    Parameters
    ----------
    function : callable
        Task and generator -> result. With workers it is a function of a module.
    tasks : sequence; tasks; a longer sequence that starts alike goes on from the same store
    store : path, optional; file that keeps the results; they are kept in memory alone where left out
    seed : int; seed of all trials
    workers : int or concurrent.futures.Executor
        Number of processes, where trials run in this process if it is one; or an executor, such as that of
        dask.distributed, whose workers must be able to import the function. A trial that such an executor repeats,
        since the worker was lost, counts once.
    progress : callable, optional; receives one line per finished trial, with the rate and the time left

    Raises
    ------
    ValueError
        If the store holds another plan.
    KeyboardInterrupt
        After an interruption; the store holds the trials that were finished.
    """
    file = None if store is None else Path(store)
    header = {"function": f"{function.__module__}.{function.__qualname__}", "seed": seed}
    stored = {} if file is None else _resume(file, header, tasks)
    outcomes = Outcomes([stored.get(number) for number in range(len(tasks))])
    code = CodeVersion.present(study_of(function.__module__))
    began, done = time.monotonic(), len(stored)
    try:
        left = [number for number in range(len(tasks)) if number not in stored]
        for count, (number, outcome) in enumerate(_outcomes(function, tasks, left, seed, workers), start=1):
            text = json.dumps({"trial": number, "task": tasks[number], **outcome, "code": code}, default=_plain)
            if file is not None:
                _append(file, text)
            # a result that has just been computed must not differ from one that a store held
            outcome = json.loads(text)
            outcomes.results[number] = outcome.get("result")
            if "error" in outcome:
                outcomes.failures[number] = outcome["error"]
            done = len(stored) + count
            pace = (time.monotonic() - began) / count
            failed = f", {len(outcomes.failures)} failed" if outcomes.failures else ""
            progress(
                f"{done} of {len(tasks)} trials{failed}, {60.0 / max(pace, 1e-9):.3g} a minute, "
                f"{pace * (len(tasks) - done) / 60.0:.2g} minutes to go"
            )
    except KeyboardInterrupt:
        kept = "Nothing was stored" if file is None else f"{file} contains {done} of {len(tasks)}; run again to resume"
        progress(f"The trials were interrupted. {kept}.")
        raise
    return outcomes


def read_store(store: str | Path) -> list[dict[str, Any]]:
    """Lines of a store after the first: number, task, and result or error; a line that was cut off is left out.

    A store whose name ends with ``.gz`` is a finished one that was compressed.
    """
    file = Path(store)
    return _lines(file)[1:] if file.is_file() else []


def _outcomes(
    function: Trial, tasks: Sequence[Any], left: Sequence[int], seed: int, workers: Workers
) -> Iterator[tuple[int, dict[str, Any]]]:
    """Each trial's number and outcome as it ends."""
    if workers == 1:
        for number in left:
            yield number, _attempt(function, tasks[number], seed, number)
        return
    starts_pool = isinstance(workers, int)
    pool = _processes(workers) if isinstance(workers, int) else workers
    futures = {pool.submit(_attempt, function, tasks[number], seed, number): number for number in left}
    try:
        for future in as_completed(futures):
            yield futures[future], future.result()
    finally:
        for future in futures:
            future.cancel()
        if starts_pool:
            pool.shutdown(wait=False, cancel_futures=True)


def _processes(count: int) -> Executor:
    """Return an executor of processes of this machine, which end with this one even where it is killed."""
    return ProcessPoolExecutor(count, mp_context=get_context("spawn"), initializer=_end_with_parent)


def _end_with_parent() -> None:
    """End this process when the one that started it has ended: a pool would wait for ever."""
    parent = parent_process()

    def watch() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    Thread(target=watch, daemon=True).start()


def _attempt(function: Trial, task: Any, seed: int, number: int) -> dict[str, Any]:
    child = np.random.SeedSequence(seed, spawn_key=(number,))
    try:
        return {"result": function(task, np.random.default_rng(child))}
    except Exception as error:
        return {"error": f"{type(error).__name__}: {error}"}


def _resume(file: Path, header: dict[str, Any], tasks: Sequence[Any]) -> dict[int, Any]:
    """Results that a store holds, by the number of the trial; a new store is begun where there is none."""
    lines = _lines(file) if file.is_file() else []
    if not lines:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps(header) + "\n", encoding="utf-8")
        return {}
    if lines[0] != header:
        raise ValueError(f"{file} contains trials of {lines[0]}, not of {header}; give another file")
    stored = {}
    for line in lines[1:]:
        number = line["trial"]
        if number < len(tasks) and line["task"] != json.loads(json.dumps(tasks[number], default=_plain)):
            other = f"{line['task']} instead of {tasks[number]}"
            raise ValueError(f"{file} contains trial {number} of another plan, {other}; give another file")
        if number < len(tasks) and "result" in line:
            stored[number] = line["result"]
    # what was cut off must not run into the next line
    os.truncate(file, file.read_bytes().rfind(b"\n") + 1)
    return stored


def _lines(file: Path) -> list[dict[str, Any]]:
    """Objects of the lines that were written to their end."""
    text = gzip.decompress(file.read_bytes()).decode() if file.suffix == ".gz" else file.read_text(encoding="utf-8")
    *whole, _ = text.split("\n")
    try:
        lines = [json.loads(line) for line in whole]
    except json.JSONDecodeError as error:
        raise ValueError(f"{file} is not a store of trials: {error}; give another file") from error
    return lines


def _append(file: Path, line: str) -> None:
    """Append a line in one write."""
    handle = os.open(file, os.O_WRONLY | os.O_APPEND)
    try:
        os.write(handle, (line + "\n").encode())
    finally:
        os.close(handle)


def _plain(value: Any) -> Any:
    """Arrays and dataclasses as JSON has them."""
    if hasattr(value, "tolist"):  # arrays of numpy and of others, and their scalars
        return value.tolist()
    if is_dataclass(value) and not isinstance(value, type):
        return asdict(value)
    raise TypeError(f"JSON has no {type(value).__name__}: {value!r}; return numbers, texts, lists, mappings or arrays")
