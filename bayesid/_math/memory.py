"""Memory: what is free, what was freed and is given back to the system, and what a run must not ask for."""

from __future__ import annotations

import ctypes
import os
from pathlib import Path

from bayesid._io.errors import InputError

__all__ = ["GIGABYTE", "free_memory", "give_back_memory", "refuse_beyond_memory", "take_large_arrays_singly"]

GIGABYTE = 1e9

GROUPS = (
    ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current"),
    ("/sys/fs/cgroup/memory/memory.limit_in_bytes", "/sys/fs/cgroup/memory/memory.usage_in_bytes"),
)
"""Files with the limit and the use of the control group of a container, in the two versions of Linux."""

LARGE = 2**22
"""Size of an array from which the system gives it by itself [bytes]."""

MMAP_THRESHOLD, TRIM_THRESHOLD = -3, -1
"""Numbers of two settings of glibc's ``mallopt``."""

KEPT = 2**26
"""Freed memory at the end of the heap that is kept [bytes], so that small arrays need no call of the system."""


def give_back_memory() -> None:
    """Give freed memory back where the C library would keep it for later, most of it in pieces for every thread."""
    trim = _of_c_library("malloc_trim")
    if trim is not None:
        trim(0)


def take_large_arrays_singly() -> None:
    """Have the C library take every large array from the system by itself, to which it returns as soon as it is freed.

    By default the library keeps freed arrays of up to 32 MB in its heaps, one heap for every thread, where small things
    between them hold them.
    """
    setting = _of_c_library("mallopt")
    if setting is not None:
        setting(MMAP_THRESHOLD, LARGE)
        setting(TRIM_THRESHOLD, KEPT)


def free_memory() -> float:
    """Return the memory that this process may still take [bytes]: of the machine, its container and its own limit.

    It is infinite where the system does not say.
    """
    limits = (_of_machine(), *(_of_group(*files) for files in GROUPS), _of_limit())
    return min((limit for limit in limits if limit is not None), default=float("inf"))


def refuse_beyond_memory(needed: float, what: str, remedy: str) -> None:
    """Raise an `InputError` if something needs more memory than there is.

    Parameters
    ----------
    needed : float
        Memory that it needs [bytes].
    what : str
        What needs it, with its size.
    remedy : str
    """
    free = free_memory()
    if needed > free:
        problem = f"{what} requires {needed / GIGABYTE:.1f} GB of memory, but {free / GIGABYTE:.1f} GB are free"
        raise InputError(problem, remedy=remedy)


def _of_machine() -> float | None:
    """Return what the system could give without moving anything to disk."""
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        return next(1024.0 * float(line.split()[1]) for line in lines if line.startswith("MemAvailable"))
    except (OSError, StopIteration):
        return None


def _of_group(limit: str, use: str) -> float | None:
    try:
        return float(Path(limit).read_text(encoding="ascii")) - float(Path(use).read_text(encoding="ascii"))
    except (OSError, ValueError):  # no such group, or "max"
        return None


def _of_limit() -> float | None:
    """Return what is left of the address space that the process may have."""
    try:
        import resource
    except ImportError:  # on Windows
        return None
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit == resource.RLIM_INFINITY:
        return None
    pages = Path("/proc/self/statm")
    used = int(pages.read_text(encoding="ascii").split()[0]) * resource.getpagesize() if pages.exists() else 0
    return max(float(limit - used), 1.0)


def _of_c_library(name: str):  # type: ignore[no-untyped-def]
    """Return a function of glibc, None where there is none of that name."""
    return getattr(ctypes.CDLL(None), name, None) if os.name == "posix" else None
