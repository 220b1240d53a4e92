"""Memory that was freed, given back to the system."""

from __future__ import annotations

import ctypes
import os

__all__ = ["give_back_memory", "take_large_arrays_singly"]

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


def _of_c_library(name: str):  # type: ignore[no-untyped-def]
    """Return a function of glibc, None where there is none of that name."""
    return getattr(ctypes.CDLL(None), name, None) if os.name == "posix" else None
