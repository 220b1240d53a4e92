"""What a search has come to so far, kept in a file that survives its interruption."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from bayesid._io.store import JsonStore
from bayesid._math.arrays import Floats

__all__ = ["Store"]


@dataclass
class Store:
    """Results of the starts of searches.

    Parameters
    ----------
    file : Path, optional
        JSON; nothing is kept where left out.
    key : str
        Identifies the question: results of another key are forgotten.
    """

    file: Path | None
    key: str
    results: dict[str, dict[str, tuple[list[float], float, int]]] = field(default_factory=dict)

    @classmethod
    def forgetful(cls) -> Store:
        """Return a store that keeps nothing beyond the run."""
        return cls(None, "")

    @classmethod
    def open(cls, file: Path, key: str) -> Store:
        """Read what an interrupted run with the same key left, if anything.

        Raises
        ------
        InputError
            If the file cannot be read.
        """
        return cls(file, key, _kept(file, key).read("results") or {})

    def of(self, search: str) -> Starts:
        """Return the part of one search."""
        return Starts(self, search)

    def write(self) -> None:
        """Write the file, all or nothing."""
        if self.file is not None:
            _kept(self.file, self.key).write(results=self.results)

    def remove(self) -> None:
        """Delete the file when it has served."""
        if self.file is not None:
            self.file.unlink(missing_ok=True)


@dataclass(frozen=True)
class Starts:
    """The starts of one search."""

    store: Store
    search: str

    def known(self, start: int) -> tuple[Floats, float, int] | None:
        """Return the result of a start: parameters, cost and evaluations."""
        entry = self.store.results.get(self.search, {}).get(str(start))
        return None if entry is None else (np.array(entry[0]), float(entry[1]), int(entry[2]))

    def keep(self, start: int, parameters: Floats, cost: float, evaluations: int) -> None:
        """Keep the result of a start."""
        own = self.store.results.setdefault(self.search, {})
        own[str(start)] = ([float(value) for value in parameters], float(cost), evaluations)
        self.store.write()


def _kept(file: Path, key: str) -> JsonStore:
    return JsonStore(file, key, "search", "study, seed or effort", disposable=True)
