"""What a search has found so far, kept in a file that survives its interruption."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from bayesid._io.errors import InputError
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
        Identifies the question: a file with another key is not used.
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
        """Read what an interrupted run with the same key left, if anything."""
        if not file.is_file():
            return cls(file, key)
        try:
            content = json.loads(file.read_text(encoding="utf-8"))
            return cls(file, key, content["results"] if content["key"] == key else {})
        except (ValueError, KeyError, TypeError) as error:
            raise InputError(
                f"unreadable state of an interrupted run: {error}", file=file, remedy="Delete the file"
            ) from error

    def of(self, search: str) -> Starts:
        """Return the part of one search."""
        return Starts(self, search)

    def write(self) -> None:
        """Write the file, all or nothing."""
        if self.file is None:
            return
        self.file.parent.mkdir(parents=True, exist_ok=True)
        part = self.file.with_name(self.file.name + ".part")
        part.write_text(json.dumps({"key": self.key, "results": self.results}), encoding="utf-8")
        os.replace(part, self.file)


@dataclass(frozen=True)
class Starts:
    """The starts of one search."""

    store: Store
    search: str

    def known(self, start: int) -> tuple[Floats, float, int] | None:
        """Return what was found from a start: parameters, cost and evaluations."""
        entry = self.store.results.get(self.search, {}).get(str(start))
        return None if entry is None else (np.array(entry[0]), float(entry[1]), int(entry[2]))

    def keep(self, start: int, parameters: Floats, cost: float, evaluations: int) -> None:
        """Keep what was found from a start."""
        own = self.store.results.setdefault(self.search, {})
        own[str(start)] = ([float(value) for value in parameters], float(cost), evaluations)
        self.store.write()
