"""Independent pieces of linear algebra side by side, since NumPy's factorisations leave other threads alone."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

__all__ = ["in_threads"]

MOST = 4
"""Most threads: what lies between factorisations is Python, of which only one thread runs at a time."""

Item = TypeVar("Item")
Result = TypeVar("Result")


def in_threads(function: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
    """Return the results of a function for some items, in their order."""
    items = list(items)
    count = min(len(items), MOST, len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 2)
    if count < 2:
        return [function(item) for item in items]
    with ThreadPoolExecutor(count) as pool:
        return list(pool.map(function, items))
