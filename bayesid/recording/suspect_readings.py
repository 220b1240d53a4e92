"""Readings that no sensor gives: filled in where there were none, held at a lower rate, or constant for long.

A sensor with noise never reads exactly the same in a row, unless its steps are coarser than its noise and nothing
moves. What is found here is stated and not removed: only the user knows what the telemetry did.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

import numpy as np

from bayesid._math.arrays import Floats, Integers
from bayesid.recording.recording import VECTOR_FAMILIES, Recording

__all__ = ["SuspectReadings", "Suspicion", "suspect_readings"]

FEWEST = 8  # number of runs of equal readings from which their lengths tell that readings are held
ALIKE = 0.9  # share of the runs that have one length where readings are held
JUMP = 8.0  # jump into and out of readings that are filled in, relative to the largest step nearby
NEARBY = 10  # number of steps before and after a run that are nearby
LONGEST = 0.05  # share of the samples above which a run of equal readings is long


class Suspicion(Enum):
    """What equal readings seem to be."""

    FILLED = "filled in"
    HELD = "held"
    CONSTANT = "constant"


@dataclass(frozen=True)
class SuspectReadings:
    """Readings of some columns that no sensor gives.

    Attributes
    ----------
    kind : Suspicion
    columns : tuple of str
    start, end : float
        First and last time of them [s].
    samples : int
        Number of them.
    interval : float
        Time between new readings where they are held [s], otherwise 0.
    value : tuple of float
        The reading that is repeated, in the columns' unit; empty where readings are held.
    """

    kind: Suspicion
    columns: tuple[str, ...]
    start: float
    end: float
    samples: int
    interval: float = 0.0
    value: tuple[float, ...] = ()

    def __str__(self) -> str:
        name = self.columns[0] if len(self.columns) == 1 else f"{self.columns[0]} to {self.columns[-1]}"
        if self.kind is Suspicion.HELD:
            return (
                f"{name}: readings are held, a new one comes every {self.interval:.4g} s: leave the cells between "
                "empty."
            )
        shown = f"{self.value[0]:g}" if len(set(self.value)) == 1 else ", ".join(f"{value:g}" for value in self.value)
        where = f"{self.samples} samples from {self.start:.6g} to {self.end:.6g} s"
        if self.kind is Suspicion.FILLED:
            return f"{name}: {where} are exactly {shown}, far from the others: empty them if they are fill values."
        return f"{name}: {where} are exactly {shown}: was it off? Empty their cells or begin the recording later."


def suspect_readings(recording: Recording) -> list[SuspectReadings]:
    """Return the readings of joints and base sensors that no sensor gives, in the order of the families.

    Parameters
    ----------
    recording : Recording
    """
    joints = [f"position.{name}" for name in recording.joints if f"position.{name}" in recording.channels]
    groups = [tuple(joints)] if joints and _sampled_together(recording, joints) else [(name,) for name in joints]
    for family in ("rate", "accel", "attitude"):
        columns = tuple(f"{family}.{axis}" for axis in VECTOR_FAMILIES[family])
        groups += [columns] if columns[0] in recording.channels else []
    return [suspect for columns in groups for suspect in _of_columns(recording, columns)]


def _sampled_together(recording: Recording, columns: list[str]) -> bool:
    present = np.isfinite([recording.channels[name] for name in columns])
    return bool((present == present[0]).all())


def _of_columns(recording: Recording, columns: tuple[str, ...]) -> Iterator[SuspectReadings]:
    present = np.isfinite(recording.channels[columns[0]])
    time = recording.time[present]
    values = np.stack([recording.channels[name][present] for name in columns], axis=1)
    if len(time) < FEWEST:
        return
    first, lengths = _runs(values)
    inner = lengths[1:-1]
    typical = int(np.median(inner)) if len(inner) else 1
    if len(inner) >= FEWEST and typical > 1 and np.mean(inner == typical) >= ALIKE:
        interval = float(np.median(np.diff(time[first])))
        yield SuspectReadings(Suspicion.HELD, columns, float(time[0]), float(time[-1]), len(time), interval)
        return
    steps = np.linalg.norm(np.diff(values, axis=0), axis=1)
    for row, length in zip(first, lengths, strict=True):
        jump = min(steps[place] if 0 <= place < len(steps) else 0.0 for place in (row - 1, row + length - 1))
        if length > 1 and jump > JUMP * _nearby(steps, row, length) > 0.0:
            kind = Suspicion.FILLED
        elif length > max(FEWEST, LONGEST * len(time)) and not columns[0].startswith("position"):  # joints may rest
            kind = Suspicion.CONSTANT
        else:
            continue
        start, end = float(time[row]), float(time[row + length - 1])
        yield SuspectReadings(kind, columns, start, end, int(length), value=tuple(values[row].tolist()))


def _nearby(steps: Floats, row: int, length: int) -> float:
    """Return the largest step near a run, but for those at its edges."""
    before, after = steps[max(row - 1 - NEARBY, 0) : max(row - 1, 0)], steps[row + length : row + length + NEARBY]
    return float(max(before.max(initial=0.0), after.max(initial=0.0)))


def _runs(values: Floats) -> tuple[Integers, Integers]:
    """Return the first row and the length of every run of equal rows, shapes (k,)."""
    new = np.concatenate([[True], (np.diff(values, axis=0) != 0.0).any(axis=1)])
    first = np.flatnonzero(new)
    return first, np.diff(np.append(first, len(values)))
