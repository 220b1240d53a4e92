"""Memory that was freed, given back to the system."""

from __future__ import annotations

import ctypes
import os

__all__ = ["give_back_memory"]


def give_back_memory() -> None:
    """Give freed memory back where the C library would keep it for later, most of it in pieces for every thread."""
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None) if os.name == "posix" else None
    if trim is not None:
        trim(0)
