"""Several searches at once, each of which runs its descents on one executor."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor, ThreadPoolExecutor
from threading import Lock
from typing import TypeVar

from bayesid._io.progress import Progress

__all__ = ["Shares", "each"]

T = TypeVar("T")  # type of the result of one search


def each(function: Callable[[int], T], count: int, executor: Executor | None) -> list[T]:
    """Return a function's values at 0 to ``count`` - 1, computed in threads if there is an executor.

    If one fails or the user interrupts, the executor is shut down, so that the others end as well.
    """
    if executor is None:
        return [function(index) for index in range(count)]
    with ThreadPoolExecutor(count) as threads:
        try:
            return list(threads.map(function, range(count)))
        except BaseException:
            executor.shutdown(wait=False, cancel_futures=True)
            raise


class Shares:
    """Progress of several computations at once, which is their mean.

    Parameters
    ----------
    progress : Progress
        Receiver of the mean.
    count : int
        Number of computations.
    """

    def __init__(self, progress: Progress, count: int) -> None:
        self._progress, self._fractions, self._lock = progress, [0.0] * count, Lock()

    def of(self, index: int) -> Progress:
        """Return the progress of one computation."""

        def receive(fraction: float, text: str) -> None:
            with self._lock:
                self._fractions[index] = fraction
                self._progress(sum(self._fractions) / len(self._fractions), text)

        return receive
