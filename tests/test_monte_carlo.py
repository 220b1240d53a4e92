"""Monte Carlo trials resume after a kill, repeat from their seed, and keep what failed apart."""

from __future__ import annotations

import gzip
import json
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

from bayesid._io.errors import InputError
from bayesid.app.options import executor_at
from studies.common.monte_carlo import read_store, run_trials

ROOT = Path(__file__).resolve().parents[1]


def draw(task: int, rng: np.random.Generator) -> dict[str, object]:
    return {"task": task, "values": rng.standard_normal(3)}


def other(task: int, rng: np.random.Generator) -> int:
    return task


def slow(task: int, rng: np.random.Generator) -> float:
    time.sleep(0.2)
    return float(rng.random())


def fragile(task: str, rng: np.random.Generator) -> int:
    if not Path(task).is_file():
        raise FileNotFoundError(f"{task} is absent")
    return 1


def test_trials_draw_from_children_of_the_seed_in_any_order_and_number():
    results = run_trials(draw, range(4), seed=3).complete()
    for result, child in zip(results, np.random.SeedSequence(3).spawn(4), strict=True):
        assert result["values"] == np.random.default_rng(child).standard_normal(3).tolist()
    assert run_trials(draw, range(2), seed=3).results == results[:2]


def test_serial_and_parallel_runs_give_the_same(tmp_path):
    serial = run_trials(draw, range(6), tmp_path / "serial.jsonl", seed=1)
    assert run_trials(draw, range(6), tmp_path / "parallel.jsonl", seed=1, workers=2) == serial
    with ThreadPoolExecutor(3) as threads:
        assert run_trials(draw, range(6), seed=1, workers=threads) == serial
    lines = [sorted(map(str, read_store(tmp_path / f"{name}.jsonl"))) for name in ("serial", "parallel")]
    assert lines[0] == lines[1]


@pytest.mark.slow
def test_a_scheduler_of_dask_that_loses_a_worker_gives_the_same(tmp_path):
    """Two worker processes, of which one is killed while its trial runs."""
    distributed = pytest.importorskip("distributed")
    store, tasks = tmp_path / "trials.jsonl", range(12)
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        with distributed.Client(cluster) as client:
            pids = list(client.run(os.getpid).values())

        def kill_one(text: str) -> None:
            if text.startswith("3 of"):
                os.kill(pids[0], signal.SIGKILL)

        executor = executor_at(cluster.scheduler_address)
        spread = run_trials(slow, tasks, store, seed=2, workers=executor, progress=kill_one)
        executor._client.close()  # else it waits for its scheduler to come back
        assert spread == run_trials(slow, tasks, seed=2)
    assert sorted(line["trial"] for line in read_store(store)) == list(tasks)
    assert len(set(pids)) == 2


def test_a_scheduler_that_does_not_answer_is_one_clear_error(monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr("bayesid.app.options.SECONDS", 0.5)
    with pytest.raises(InputError, match=r"--scheduler: no scheduler answers at tcp://127.0.0.1:9"):
        executor_at("tcp://127.0.0.1:9")


@pytest.mark.slow
def test_a_killed_run_goes_on_where_it_was(tmp_path):
    store, tasks = tmp_path / "trials.jsonl", range(8)
    code = f"from tests.test_monte_carlo import *; run_trials(slow, range(8), {str(store)!r}, seed=2)"
    process = subprocess.Popen([sys.executable, "-c", code], cwd=ROOT)
    deadline = time.monotonic() + 60.0
    while time.monotonic() < deadline and len(read_store(store)) < 2:
        time.sleep(0.05)
    process.kill()
    process.wait()
    held = read_store(store)
    assert 2 <= len(held) < 8
    told = []
    resumed = run_trials(slow_of_that_process(), tasks, store, seed=2, progress=told.append)
    assert len(told) == 8 - len(held)
    assert told[-1].startswith("8 of 8 trials, ")
    assert resumed == run_trials(slow, tasks, seed=2)


def number_of_process(task: int, rng: np.random.Generator) -> int:
    time.sleep(0.05)
    return os.getpid()


@pytest.mark.slow
def test_the_processes_of_a_killed_run_end_with_it(tmp_path):
    store = tmp_path / "trials.jsonl"
    code = f"from tests.test_monte_carlo import *; run_trials(number_of_process, range(999), {str(store)!r}, workers=2)"
    process = subprocess.Popen([sys.executable, "-c", code], cwd=ROOT)
    deadline = time.monotonic() + 60.0
    while time.monotonic() < deadline and len(read_store(store)) < 2:
        time.sleep(0.05)
    process.kill()
    process.wait()
    numbers = {line["result"] for line in read_store(store)}
    assert numbers
    while time.monotonic() < deadline and any(map(alive, numbers)):
        time.sleep(0.05)
    assert not any(map(alive, numbers))


def alive(number: int) -> bool:
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return False
    return True


def slow_of_that_process():
    """The function under the name that the other process knew it by."""
    from tests.test_monte_carlo import slow as function

    return function


def test_a_line_that_was_cut_off_is_made_again(tmp_path):
    store = tmp_path / "trials.jsonl"
    whole = run_trials(draw, range(3), store, seed=5)
    content = store.read_text()
    store.write_text(content[:-20])
    assert len(read_store(store)) == 2
    assert run_trials(draw, range(3), store, seed=5) == whole
    assert store.read_text() == content


@pytest.mark.parametrize(
    ("function", "tasks", "seed", "message"),
    [
        (other, range(3), 5, "contains trials of .*draw.* not of .*other.*give another file"),
        (draw, range(3), 6, "'seed': 5.* not of .*'seed': 6.*give another file"),
        (draw, [0, 7, 2], 5, "trial 1 of another plan, 1 instead of 7; give another file"),
    ],
    ids=["function", "seed", "task"],
)
def test_another_plan_is_refused(tmp_path, function, tasks, seed, message):
    store = tmp_path / "trials.jsonl"
    run_trials(draw, range(3), store, seed=5)
    with pytest.raises(ValueError, match=message):
        run_trials(function, tasks, store, seed=seed)


def test_another_file_is_refused(tmp_path):
    store = tmp_path / "notes.txt"
    store.write_text("not JSON\n")
    with pytest.raises(ValueError, match=r"is not a store of trials.*give another file"):
        run_trials(draw, range(3), store)


def test_more_trials_go_on_from_fewer(tmp_path):
    store = tmp_path / "trials.jsonl"
    run_trials(draw, range(2), store, seed=5)
    assert run_trials(draw, range(4), store, seed=5) == run_trials(draw, range(4), seed=5)
    assert len(read_store(store)) == 4


def test_a_compressed_store_is_read(tmp_path):
    store = tmp_path / "store.jsonl"
    run_trials(draw, [1, 2], store)
    packed = tmp_path / "store.jsonl.gz"
    packed.write_bytes(gzip.compress(store.read_bytes()))
    assert read_store(packed) == read_store(store)
    assert len(read_store(packed)) == 2


def test_a_trial_that_raises_is_recorded_and_tried_again(tmp_path):
    tasks = [str(tmp_path / "here"), str(tmp_path / "there")]
    Path(tasks[0]).touch()
    store, told = tmp_path / "trials.jsonl", []
    first = run_trials(fragile, tasks, store, progress=told.append)
    assert first.results == [1, None]
    assert first.failures == {1: f"FileNotFoundError: {tasks[1]} is absent"}
    assert "1 failed" in told[-1]
    with pytest.raises(RuntimeError, match="1 of 2 trials failed, the first is number 1: FileNotFoundError"):
        first.complete()
    Path(tasks[1]).touch()
    assert run_trials(fragile, tasks, store).complete() == [1, 1]


def test_arrays_of_any_kind_are_results():
    def arrays(task: int, rng: np.random.Generator) -> dict[str, object]:
        return {"numpy": np.arange(2), "jax": jnp.arange(2), "scalar": np.float64(0.5), "both": (1, None)}

    (result,) = run_trials(arrays, [0]).complete()
    assert result == {"numpy": [0, 1], "jax": [0, 1], "scalar": 0.5, "both": [1, None]}
    with pytest.raises(TypeError, match="JSON has no complex"):
        run_trials(lambda task, rng: 1j, [0])


def test_an_interruption_says_what_is_kept(tmp_path):
    def impatient(task: int, rng: np.random.Generator) -> int:
        if task == 2:
            raise KeyboardInterrupt
        return task

    store, told = tmp_path / "trials.jsonl", []
    with pytest.raises(KeyboardInterrupt):
        run_trials(impatient, range(4), store, progress=told.append)
    assert told[-1] == f"The trials were interrupted. {store} contains 2 of 4; run again to resume."
    assert [json.loads(line)["result"] for line in store.read_text().splitlines()[1:]] == [0, 1]
