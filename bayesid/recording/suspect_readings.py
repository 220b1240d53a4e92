"""Readings that no sensor gives: filled in where there were none, held at a lower rate, or constant for long.

A sensor with noise never reads exactly the same in a row, unless its steps are coarser than its noise and nothing
moves. What is found here is stated and not removed: only the user knows what the telemetry did.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

import numpy as np

from bayesid._math.arrays import Bools, Floats, Integers
from bayesid.recording.convention import Convention
from bayesid.recording.recording import VECTOR_FAMILIES, Recording

__all__ = ["SuspectReadings", "Suspicion", "suspect_readings"]

FEWEST = 8  # number of runs of equal readings from which their lengths tell that readings are held
ALIKE = 0.9  # share of the runs that have one length where readings are held
JUMP = 8.0  # jump into and out of readings that are filled in, relative to the largest step nearby
NEARBY = 10  # number of steps before and after a run that are nearby
STRAIGHT = 1e-4  # bend relative to the largest one below which readings lie on a straight line
AGAIN = 3  # number of single samples, exactly equal and far from their neighbours, that are fill values
LONGEST = 0.05  # share of the samples above which a run of equal readings is long


class Suspicion(Enum):
    """What equal readings seem to be."""

    FILLED = "filled in"
    HELD = "held"
    INTERPOLATED = "interpolated"
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
        if self.kind in (Suspicion.HELD, Suspicion.INTERPOLATED):
            how = "repeated" if self.kind is Suspicion.HELD else "interpolated"
            return f"{name}: readings are {how} between new values every {self.interval:.4g} s: empty these cells."
        shown = f"{self.value[0]:g}" if len(set(self.value)) == 1 else ", ".join(f"{value:g}" for value in self.value)
        where = f"{self.samples} samples from {self.start:.6g} to {self.end:.6g} s"
        if self.kind is Suspicion.FILLED:
            return (
                f"{name}: {where} are exactly {shown}, far from the others: empty their cells if they are fill values."
            )
        return (
            f"{name}: {where} are exactly {shown}: was the sensor off? Empty their cells or start the recording later."
        )

    @property
    def convention(self) -> Convention | None:
        """The wrong convention that the readings show, None where they may be true."""
        family = self.columns[0].partition(".")[0]
        many = len(self.columns) > 1
        section = "sensors.encoder" if family == "position" else f"sensors.{family}"
        channel = self.columns[0] if family == "position" and not many else family
        if self.kind in (Suspicion.HELD, Suspicion.INTERPOLATED):
            name, line = f"convention:held:{channel}", f"native_rate = {1.0 / self.interval:.6g}"
        elif self.kind is Suspicion.FILLED:
            values = sorted(set(self.value))
            shown = f"{values[0]:.12g}" if len(values) == 1 else f"[{', '.join(f'{value:.12g}' for value in values)}]"
            name, line = f"convention:fill:{channel}", f"missing = {shown}"
        else:
            return None
        return Convention(name, channel, f"[{section}]\n{line}", f"{self}")


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
    if (interval := _interpolated(time, values)) > 0.0:
        yield SuspectReadings(Suspicion.INTERPOLATED, columns, float(time[0]), float(time[-1]), len(time), interval)
        return
    steps = np.linalg.norm(np.diff(values, axis=0), axis=1)
    if (scattered := _scattered_fill(values, steps)) is not None:
        rows, value = scattered
        start, end = float(time[rows[0]]), float(time[rows[-1]])
        yield SuspectReadings(Suspicion.FILLED, columns, start, end, len(rows), value=value)
        return
    repeated = lengths > 1
    for row, length in zip(first[repeated], lengths[repeated], strict=True):
        jump = min(steps[place] if 0 <= place < len(steps) else 0.0 for place in (row - 1, row + length - 1))
        if jump > JUMP * _nearby(steps, row, length) > 0.0:
            kind = Suspicion.FILLED
        elif length > max(FEWEST, LONGEST * len(time)) and not columns[0].startswith("position"):  # joints may rest
            kind = Suspicion.CONSTANT
        else:
            continue
        start, end = float(time[row]), float(time[row + length - 1])
        yield SuspectReadings(kind, columns, start, end, int(length), value=tuple(values[row].tolist()))


def _interpolated(time: Floats, values: Floats) -> float:
    """Return the interval of readings between which straight lines are drawn, 0 where there are none [s]."""
    slopes = np.diff(values, axis=0) / np.diff(time)[:, None]
    bends = np.abs(np.diff(slopes, axis=0)).max(axis=1)
    kinks = np.flatnonzero(bends > STRAIGHT * bends.max())
    apart = np.diff(kinks)
    if len(apart) < FEWEST or np.median(apart) < 2 or np.mean(apart == np.median(apart)) < ALIKE:
        return 0.0
    return float(np.median(np.diff(time[kinks + 1])))


def _scattered_fill(values: Floats, steps: Floats) -> tuple[Integers, tuple[float, ...]] | None:
    """Return the rows of one sample that comes again and again, far from its neighbours, and that sample."""
    jumps = np.minimum(steps[1:], steps[:-1])
    alone = 1 + np.flatnonzero(jumps > 0.0)
    if values.shape[1] > 1 and len(alone):  # noise never gives one vector again, unless its steps are coarse
        vectors, counts = np.unique(values[_repeated(values[:, 0])], axis=0, return_counts=True)
        again = np.flatnonzero(counts > 1)
        if len(again) == 1 and counts[again[0]] >= AGAIN:
            rows = np.flatnonzero((values == vectors[again[0]]).all(axis=1))
            if np.isin(rows, alone).all():
                return rows, tuple(vectors[again[0]].tolist())
    typical = float(np.median(steps))
    far = 1 + np.flatnonzero(jumps > JUMP * max(typical, 1e-12))
    if len(far) < AGAIN:
        return None
    samples, counts = np.unique(values[far], axis=0, return_counts=True)
    most = int(np.argmax(counts))
    if counts[most] < AGAIN or typical == 0.0:
        return None
    rows = np.flatnonzero((values == samples[most]).all(axis=1))
    return rows, tuple(samples[most].tolist())


def _repeated(values: Floats) -> Bools:
    """Return which of some numbers, (n,), come more than once: far fewer than all, and so cheap to compare."""
    ordered = np.sort(values)
    return np.isin(values, ordered[1:][ordered[1:] == ordered[:-1]])


def _nearby(steps: Floats, row: int, length: int) -> float:
    """Return the largest step near a run, but for those at its edges."""
    before, after = steps[max(row - 1 - NEARBY, 0) : max(row - 1, 0)], steps[row + length : row + length + NEARBY]
    return float(max(before.max(initial=0.0), after.max(initial=0.0)))


def _runs(values: Floats) -> tuple[Integers, Integers]:
    """Return the first row and the length of every run of equal rows, shapes (k,)."""
    new = np.concatenate([[True], (np.diff(values, axis=0) != 0.0).any(axis=1)])
    first = np.flatnonzero(new)
    return first, np.diff(np.append(first, len(values)))
