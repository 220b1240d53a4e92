"""Compiled functions that are kept between processes together with their tracing.

JAX's own cache keeps what XLA compiles, under a key that only tracing and lowering give. For the functions of a
diagnosis those two take several seconds in every process. Here the key is what decides the operations instead: the
static arguments, the shapes of the others, and the source of this package.
"""

from __future__ import annotations

import gc
import hashlib
import os
import pickle
import platform
import sys
from collections.abc import Callable, Hashable
from contextlib import suppress
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache, update_wrapper
from pathlib import Path
from threading import Lock
from typing import Any, Protocol, runtime_checkable
from weakref import WeakSet

import jax
import jaxlib
from jax import monitoring
from jax.api_util import shaped_abstractify
from jax.core import Tracer
from jax.errors import JaxRuntimeError
from jax.experimental import serialize_executable
from jax.stages import Compiled

from bayesid._io.files import complete_file
from bayesid._math.double_precision import in_double_precision
from bayesid._math.memory import give_back_memory

__all__ = ["OBTAINED", "QuickJit", "forget_executables", "kept_jit"]

PACKAGE = __name__.partition(".")[0]
OBTAINED = "/bayesid/executable"
"""Name of the event, for `jax.monitoring`, that an executable is compiled or read from its file."""

SUFFIX = ".executable"
LEAST = "jax_persistent_cache_min_compile_time_secs"
"""Name of the option of JAX for the shortest compilation whose result its cache keeps."""

NEVER = 1e9
"""Time of compilation that none reaches [s]."""

QUICKLY: dict[str, Any] = {"xla_cpu_use_fusion_emitters": False, "xla_cpu_parallel_codegen_split_count": 1}
"""Options of XLA: compilation takes two thirds of the time and a fifth less memory, and the code is as fast."""

_known: WeakSet[_KeptJit] = WeakSet()


@cache
def compiler_options() -> dict[str, Any]:
    """Return those of `QUICKLY` that the installed XLA takes for this device; each version has others."""

    def is_taken(name: str) -> bool:
        try:
            jax.jit(lambda: 0.0).lower().compile(compiler_options={name: QUICKLY[name]})
        except JaxRuntimeError:
            return False
        return True

    return {name: value for name, value in QUICKLY.items() if is_taken(name)}


class QuickJit:
    """A function compiled as by `jax.jit`, in 64 bits and in less time, which no other compiled one may call."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self._jit = jax.jit(function, compiler_options=compiler_options())

    @in_double_precision
    def __call__(self, *args: Any) -> Any:
        """Evaluate the function."""
        return self._jit(*args)

    @in_double_precision
    def trace(self, *args: Any) -> None:
        """Do what comes before the compilation for such arguments."""
        self._jit.lower(*args)


@runtime_checkable
class _Describable(Protocol):
    """A static argument that says itself what it is made of."""

    def description(self) -> tuple[object, ...] | None:
        """Return everything that decides the operations, None if only this process knows it."""
        ...


def kept_jit(static: int = 0) -> Callable[[Callable[..., Any]], _KeptJit]:
    """Return a decorator that compiles a function in 64 bits and keeps the result in the folder of JAX's cache.

    Parameters
    ----------
    static : int
        Number of leading arguments that are static.
    """
    return lambda function: _KeptJit(function, static)


class _BesideTheCache:
    """While any thread is inside, JAX's own cache keeps nothing."""

    def __init__(self) -> None:
        self._lock, self._inside, self._least = Lock(), 0, 0.0

    def __enter__(self) -> None:
        with self._lock:
            if not self._inside:
                self._least = _setting(LEAST)
                jax.config.update(LEAST, NEVER)
            self._inside += 1

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._inside -= 1
            if not self._inside:
                jax.config.update(LEAST, self._least)


_BESIDE = _BesideTheCache()


def forget_executables() -> None:
    """Release the memory of all executables, and of all that JAX has traced and compiled; what is on disk stays.

    A process that works on many studies, one after the other, would otherwise hold the code of all of them.
    """
    for function in _known:
        function._ready.clear()
    jax.clear_caches()
    gc.collect()
    give_back_memory()


class _KeptJit:
    """A compiled function of positional arguments, see `kept_jit`."""

    def __init__(self, function: Callable[..., Any], static: int) -> None:
        self._function = function
        self._jit = jax.jit(function, static_argnums=tuple(range(static)))
        self._static = static
        self._name = f"{function.__module__}.{function.__qualname__}"
        self._ready: dict[Hashable, Callable[..., Any]] = {}
        self._obtaining: dict[Hashable, Lock] = {}
        update_wrapper(self, function)
        _known.add(self)

    @in_double_precision
    def __call__(self, *args: Any) -> Any:
        """Evaluate the function in 64 bits."""
        static, others = args[: self._static], args[self._static :]
        leaves, tree = jax.tree.flatten(others)
        if any(isinstance(leaf, Tracer) for leaf in leaves):
            return self._jit(*args)  # part of a larger function
        shapes = tuple(leaf.aval if isinstance(leaf, jax.Array) else shaped_abstractify(leaf) for leaf in leaves)
        key = (static, tree, shapes)
        if key not in self._ready:
            with self._obtaining.setdefault(key, Lock()):  # threads that need the same code wait for the first of them
                if key not in self._ready:
                    result = self._obtained(key, args)
                    self._obtaining.pop(key, None)
                    return result
        return self._ready[key](*others)

    def _obtained(self, key: tuple[Any, ...], args: tuple[Any, ...]) -> Any:
        """Read the executable from its file or compile it, and evaluate it."""
        others = args[self._static :]
        monitoring.record_event(OBTAINED)
        file = self._file(*key)
        if file is not None and file.is_file():
            try:
                executable = serialize_executable.deserialize_and_load(*pickle.loads(file.read_bytes()))
                result = jax.block_until_ready(executable(*others))
            except Exception:  # whatever is wrong with a file of a cache, another one takes its place
                file.unlink(missing_ok=True)
            else:
                _mark_as_used(file)
                self._ready[key] = executable
                return result
        self._ready[key] = self._compiled(self._jit, args) if file is None else self._kept(file, args)
        return self._ready[key](*others)

    def _kept(self, file: Path, args: tuple[Any, ...]) -> Callable[..., Any]:
        """Compile the function and write the executable.

        JAX's own cache must neither give nor take it, since an executable that comes out of a file cannot be written to
        another. Therefore its name, which is part of JAX's key, is unique, and nothing is written there meanwhile.
        """

        def unique(*args: Any) -> Any:
            return self._function(*args)

        unique.__name__ = f"kept_{file.stem}"
        with _BESIDE:
            executable = self._compiled(jax.jit(unique, static_argnums=tuple(range(self._static))), args)
        try:
            content = pickle.dumps(serialize_executable.serialize(executable))
            with complete_file(file) as part:
                part.write_bytes(content)
        except (OSError, ValueError, TypeError, pickle.PicklingError):  # not kept, which only costs time
            pass
        return executable

    @staticmethod
    def _compiled(function: Any, args: tuple[Any, ...]) -> Compiled:
        """Compile for these arguments; the options of XLA stay out of `jax.jit`, which refuses them within another."""
        executable: Compiled = function.lower(*args).compile(compiler_options=compiler_options())
        return executable

    def _file(self, static: tuple[Any, ...], tree: Any, shapes: tuple[Any, ...]) -> Path | None:
        """Return the file of the executable, None if none can be kept."""
        folder = _setting("jax_compilation_cache_dir")
        described = _described(static)
        if not folder or described is None or jax.default_backend() != "cpu":
            return None
        parts = (_surroundings(), self._name, described, str(tree), str([(s, s.weak_type) for s in shapes]))
        return Path(folder) / (hashlib.sha256(repr(parts).encode()).hexdigest() + SUFFIX)


def _mark_as_used(file: Path) -> None:
    """Date the file anew, since those that nobody uses are removed some day."""
    with suppress(OSError):
        os.utime(file)


def _described(value: object) -> str | None:
    """Return a description of a static argument that is the same in every process, None if there is none.

    Types from outside this package have none, since their source is not part of the key.
    """
    if isinstance(value, bool | int | float | str | bytes | None):
        return repr(value)
    if isinstance(value, tuple) and type(value) is tuple:
        return _joined("tuple", value)
    if isinstance(value, type):
        keyed = value.__module__.partition(".")[0] in (PACKAGE, "builtins")
        return f"{value.__module__}.{value.__qualname__}" if keyed else None
    name = _described(type(value))
    if name is None:
        return None
    if isinstance(value, Enum):
        return f"{name}.{value.name}"
    if isinstance(value, _Describable):
        content = value.description()
        return None if content is None else _joined(name, content)
    if isinstance(value, tuple):
        return _joined(name, tuple(value))
    if is_dataclass(value):
        return _joined(name, tuple(getattr(value, field.name) for field in fields(value)))
    return name if not getattr(value, "__dict__", {"unknown": None}) else None


def _joined(name: str, parts: tuple[object, ...]) -> str | None:
    descriptions = [_described(part) for part in parts]
    return None if None in descriptions else f"{name}({', '.join(map(str, descriptions))})"


@cache
def _surroundings() -> str:
    """Return everything outside the arguments that decides an executable: versions, processor and source."""
    digest = hashlib.sha256()
    for file in sorted(Path(__file__).parents[1].rglob("*.py")):
        digest.update(file.read_bytes())
    processor = Path("/proc/cpuinfo")
    lines = processor.read_text().splitlines() if processor.is_file() else [platform.processor()]
    flags = [line for line in lines if line.startswith(("flags", "model name", "Features"))] or lines
    device = jax.devices()[0]
    versions = (jax.__version__, jaxlib.__version__, sys.version_info[:2])
    machine = (device.platform, device.device_kind, os.cpu_count(), sorted(set(flags)))
    return repr((digest.hexdigest(), versions, machine, os.environ.get("XLA_FLAGS")))


def _setting(name: str) -> Any:
    """Return the value of an option of JAX."""
    return getattr(jax.config, name)
