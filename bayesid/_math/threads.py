"""Linear algebra on several cores: independent pieces side by side, or one large piece in several threads."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from typing import TypeVar

from threadpoolctl import threadpool_limits

__all__ = ["each_in_threads", "in_threads", "several_threads"]

MOST = 4
"""Most threads."""

LARGE = 200
"""Number of columns from which several threads are worth their start."""

Item = TypeVar("Item")
Result = TypeVar("Result")


def several_threads(size: int) -> AbstractContextManager[object]:
    """Return a context in which products and factorisations of matrices use all cores if they have so many columns."""
    return threadpool_limits(limits=_cores()) if size >= LARGE else nullcontext()


def in_threads(function: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
    """Return the results of a function for some items, in their order.

    NumPy's factorisations leave other threads alone; what lies between them runs in one thread at a time.

    Parameters
    ----------
    function : callable
        Function of one argument.
    items : iterable
        Arguments.
    """
    return list(each_in_threads(function, items))


def each_in_threads(
    function: Callable[[Item], Result], items: Iterable[Item], executor: Executor | None = None
) -> Iterator[Result]:
    """Yield the results of `in_threads` one after another, each once it and those before it are there.

    Parameters
    ----------
    function : callable
        Function of one argument, which an executor of other processes must be able to pickle.
    items : iterable
        Arguments.
    executor : concurrent.futures.Executor, optional
        Executor that computes them, instead of threads of this process.
    """
    if executor is not None:
        yield from executor.map(function, items)
        return
    items = list(items)
    count = min(len(items), _cores())
    if count < 2:
        yield from map(function, items)
        return
    with ThreadPoolExecutor(count) as pool:
        yield from pool.map(function, items)


def _cores() -> int:
    """Return the number of cores that this process may use, up to a few."""
    return min(MOST, len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1)
