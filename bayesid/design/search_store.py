"""Results of a search so far, kept in a file that survives an interruption of the run."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from threading import Lock

import numpy as np

from bayesid._io.store import JsonStore
from bayesid._math.arrays import Floats

__all__ = ["Store"]


@dataclass
class Store:
    """Results of several searches, each of several descents.

    Parameters
    ----------
    file : Path or None
        JSON file of the results; None keeps them in memory only.
    key : str
        Key of the design problem; results under another key are discarded.
    results : dict
        Parameters, cost and number of evaluations by search and descent.
    lock : threading.Lock
        Lock of the results, which several searches may add at once.
    """

    file: Path | None
    key: str
    results: dict[str, dict[str, tuple[list[float], float, int]]] = field(default_factory=dict)
    lock: Lock = field(default_factory=Lock, repr=False)

    @classmethod
    def forgetful(cls) -> Store:
        """Return a store that keeps the results in memory only."""
        return cls(None, "")

    @classmethod
    def open(cls, file: Path, key: str) -> Store:
        """Read the results of an interrupted run with the same key, if there are any.

        Raises
        ------
        InputError
            If the file cannot be read.
        """
        return cls(file, key, _kept(file, key).read("results") or {})

    def of(self, search: str) -> Starts:
        """Return the results of one search, by its name."""
        return Starts(self, search)

    def write(self) -> None:
        """Write the file, whole or not at all."""
        if self.file is not None:
            _kept(self.file, self.key).write(results=self.results)

    def remove(self) -> None:
        """Delete the file once the results are no longer needed."""
        if self.file is not None:
            self.file.unlink(missing_ok=True)


@dataclass(frozen=True)
class Starts:
    """Results of one search, by the name of the descent."""

    store: Store
    search: str

    def known(self, descent: str) -> tuple[Floats, float, int] | None:
        """Return parameters, cost and number of evaluations of a descent, None where there are none."""
        entry = self.store.results.get(self.search, {}).get(descent)
        return None if entry is None else (np.array(entry[0]), float(entry[1]), int(entry[2]))

    def keep(self, descent: str, parameters: Floats, cost: float, evaluations: int) -> None:
        """Add the result of a descent, and write the file."""
        with self.store.lock:
            results = self.store.results.setdefault(self.search, {})
            results[descent] = ([float(value) for value in parameters], float(cost), evaluations)
            self.store.write()


def _kept(file: Path, key: str) -> JsonStore:
    return JsonStore(file, key, "search", "study, seed or effort", disposable=True)
