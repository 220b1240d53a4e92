"""The raw counts of a throw in physical units, and the speed of its wheel.

The motor's driver counts electrical periods, of which a turn has as many as the motor has pairs of poles, and holds
each reading until the next. A reading is therefore as old as an average over such a period and the driver's own delay.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bayesid._math.arrays import Floats

SIGNS = np.array([-1.0, -1.0, 1.0])
RATE_SCALE = np.pi / 180.0 / 16.384
ACCEL_SCALE = 9.81 / 2048.0

POLE_PAIRS = 7  # of the wheel's motor, by the headers of the logs; the line of its imbalance says the same
ERPM = 100.0 * 2.0 * np.pi / 60.0  # electrical angular frequency of one count [rad/s]
IDLE_TURN = 0.03  # time of a turn of the idling wheel [s]
LONGEST_PERIOD = 0.02  # electrical period of the wheel at rest, for its delay [s]


@dataclass(frozen=True)
class Timing:
    """How a throw is cut; the delays were found on these data."""

    # free flight after the wheel's start [s]; a recording begins within a turn of the wheel after ``start``
    start: float = 0.075
    end: float = 0.555
    # a reported wheel speed is as old as this [s] plus this many electrical periods, over which it was averaged
    delay: float = -0.64e-3
    delay_periods: float = 0.40
    # wheel acceleration above which its delay is not known well enough [rad/s2]; gyro samples within ``margin`` seconds
    # of it are left out
    fast: float = 10000.0
    margin: float = 0.004
    pole_pairs: int = POLE_PAIRS

    @property
    def duration(self) -> float:
        """Length of a recording [s]."""
        return self.end - self.start - IDLE_TURN

    @property
    def wheel_count(self) -> float:
        """Wheel speed of one count of its reading [rad/s]."""
        return ERPM / self.pole_pairs


@dataclass(frozen=True)
class RawThrow:
    """The readings of one throw, nothing filtered."""

    name: str
    clock: Floats  # (n,): time after the wheel's start [s]
    readings: Floats  # (n, 6): rate and specific force [rad/s, m/s2]
    erpm: Floats  # (n,): reading of the wheel [counts]

    @classmethod
    def read(cls, file: Path) -> RawThrow:
        """Read a file of counts."""
        raw = np.genfromtxt(file, delimiter=",", names=True)
        readings = [
            sign * scale * raw[f"{kind}{axis}"]
            for kind, scale in (("g", RATE_SCALE), ("a", ACCEL_SCALE))
            for axis, sign in zip("xyz", SIGNS, strict=True)
        ]
        return cls(file.stem, raw["t_us"] * 1e-6, np.column_stack(readings), raw["erpm"])

    def wheel_speed(self, time: Floats, timing: Timing) -> Floats:
        """Return the speed of the wheel relative to the body about z at some times [rad/s], which is negative.

        The instants at which its reading changes give it.
        """
        new = np.concatenate([[0], np.flatnonzero(np.diff(self.erpm)) + 1])
        value, instant = self.erpm[new], self.clock[new]
        period = np.where(value > 0.0, 2.0 * np.pi / (ERPM * np.maximum(value, 1.0)), 0.0)
        late = timing.delay + timing.delay_periods * np.minimum(period, LONGEST_PERIOD)
        return np.interp(time, instant - late, -value * timing.wheel_count)
