"""Executables come back from disk without tracing, and whatever is wrong there costs no more than time."""

from __future__ import annotations

import gc
import os
import weakref
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from bayesid._math import kept_jit as module
from bayesid._math.kept_jit import QuickJit, forget_executables, kept_jit
from bayesid.app.compilation_cache import keep_compiled
from bayesid.simulation.effects import AerodynamicDrag, WheelMomentum
from bayesid.simulation.sensors import SensorKind
from bayesid.simulation.simulator import EffectKey

TRACED: list[object] = []


@kept_jit(static=1)
def scaled(power: object, x: dict[str, jax.Array]) -> jax.Array:
    TRACED.append(power)
    return jnp.sum(x["a"] ** 2) * len(str(power))


@dataclass(frozen=True)
class Foreign:
    """Its source is no part of the package."""

    power: int


@pytest.fixture
def folder(tmp_path: Path) -> Iterator[Path]:
    before = jax.config.jax_compilation_cache_dir
    jax.config.update("jax_compilation_cache_dir", str(tmp_path))
    TRACED.clear()
    forget_executables()
    yield tmp_path
    jax.config.update("jax_compilation_cache_dir", before)
    forget_executables()


def kept(folder: Path) -> list[Path]:
    return sorted(folder.glob("*.executable"))


X = {"a": np.arange(4.0)}


def test_another_process_need_not_trace(folder):
    assert float(scaled(10, X)) == 28.0
    assert TRACED == [10]
    forget_executables()
    assert float(scaled(10, {"a": 2.0 * X["a"]})) == 112.0
    assert TRACED == [10]
    assert len(kept(folder)) == 1


def test_threads_that_need_the_same_code_trace_it_once(folder):
    with ThreadPoolExecutor(4) as threads:
        results = list(threads.map(lambda factor: float(scaled(10, {"a": factor * X["a"]})), (1.0, 2.0, 3.0, 4.0)))
    assert results == [28.0, 112.0, 252.0, 448.0]
    assert TRACED == [10]


def test_what_is_forgotten_is_freed_and_so_is_what_jax_compiled(folder):
    traced = []
    plain = jax.jit(lambda x: traced.append(x.shape) or x**2)
    for _ in range(2):
        scaled(10, X)
        plain(X["a"])
    (executable,) = scaled._ready.values()
    held = weakref.ref(executable)
    del executable
    forget_executables()
    gc.collect()
    assert held() is None
    plain(X["a"])
    assert traced == [(4,), (4,)]


def test_other_static_arguments_and_other_shapes_are_other_executables(folder):
    for power, x in ((10, X), (100, X), (10, {"a": np.arange(5.0)}), (10, {"a": np.arange(4)})):
        assert float(scaled(power, x)) == len(str(power)) * float(np.sum(x["a"] ** 2))
    assert len(kept(folder)) == 4


def test_a_damaged_file_is_replaced(folder):
    scaled(10, X)
    (file,) = kept(folder)
    good = file.stat().st_size
    file.write_bytes(b"damaged")
    forget_executables()
    assert float(scaled(10, X)) == 28.0
    assert TRACED == [10, 10]
    assert file.stat().st_size > good / 2
    forget_executables()
    assert float(scaled(10, X)) == 28.0
    assert TRACED == [10, 10]


def test_an_executable_of_jaxs_own_cache_is_not_kept_in_its_place(folder):
    """One that comes from a file cannot be written to another: its functions are not in there."""
    plain = jax.jit(lambda x: jnp.sum(x["a"] ** 2) * 2)
    plain(X)
    jax.clear_caches()
    scaled(10, X)
    forget_executables()
    assert float(scaled(10, X)) == 28.0
    assert TRACED == [10]


def test_what_is_not_of_the_package_is_not_kept(folder):
    assert float(scaled(Foreign(3), X)) == 14.0 * len(str(Foreign(3)))
    assert float(scaled(Foreign(3), X)) == 14.0 * len(str(Foreign(3)))
    assert [Foreign(3)] == TRACED
    assert kept(folder) == []


def test_effects_and_sensors_are_described_by_what_they_are(folder):
    class Own(AerodynamicDrag):
        """An effect of a user."""

    keys = [EffectKey(WheelMomentum()), EffectKey(AerodynamicDrag()), (SensorKind.RATE, SensorKind.ACCEL)]
    for key in keys:
        scaled(key, X)
    assert len(kept(folder)) == 3
    scaled(EffectKey(WheelMomentum()), X)
    assert len(kept(folder)) == 3
    scaled(EffectKey(Own()), X)
    assert len(kept(folder)) == 3


def test_inside_another_function_it_is_part_of_that(folder):
    def twice(x: jax.Array) -> jax.Array:
        return 2.0 * scaled(10, {"a": x})

    np.testing.assert_allclose(jax.jit(jax.grad(twice))(X["a"]), 8.0 * X["a"])
    assert kept(folder) == []


def test_without_a_folder_nothing_is_written(folder):
    jax.config.update("jax_compilation_cache_dir", None)
    assert float(scaled(10, X)) == 28.0
    assert kept(folder) == []


def test_what_nobody_uses_is_removed_and_nothing_else(folder):
    float(scaled(10, X))
    (file,) = kept(folder)
    old, users = folder / "other.executable", folder / "notes.txt"
    for item in (old, users):
        item.write_text("")
    for item in (old, users, file):
        os.utime(item, (0.0, 0.0))
    forget_executables()
    float(scaled(10, X))  # read, and so used
    keep_compiled(folder)
    assert file.is_file()
    assert users.is_file()
    assert not old.exists()


def test_options_that_the_installed_xla_refuses_are_left_out(folder, monkeypatch):
    monkeypatch.setattr(module, "QUICKLY", {**module.QUICKLY, "xla_of_another_version": True})
    module.compiler_options.cache_clear()
    try:
        taken = module.compiler_options()
        assert set(taken) < set(module.QUICKLY)
        assert "xla_cpu_parallel_codegen_split_count" in taken, "all versions from 0.10 to 0.12 take it"
        assert float(QuickJit(lambda x: 2.0 * x)(3.0)) == 6.0
        assert float(scaled(10, X)) == 28.0
    finally:
        module.compiler_options.cache_clear()


@pytest.mark.parametrize("library", ["jax", "jaxlib"])
def test_an_executable_of_another_version_is_not_read(folder, monkeypatch, library: str):
    scaled(10, X)
    forget_executables()
    monkeypatch.setattr(f"{library}.__version__", "0.10.1000")
    module._surroundings.cache_clear()
    try:
        assert float(scaled(10, X)) == 28.0
    finally:
        module._surroundings.cache_clear()
    assert TRACED == [10, 10]
    assert len(kept(folder)) == 2
