"""Shocks: instants at which something moves inside the spacecraft and all inertial sensors are shaken for a moment.

A part that comes loose reaches its new place within a tenth of a second. Its motion turns the base and pushes it, by
thousands of standard deviations of the noise, and all of this is over when it stops; what remains is a change of the
moments of mass. Readings within the motion say how the part has moved, which nobody knows and no effect describes.
Slow sensors miss it between two samples. Of fast ones, the readings within it are left out.

A shock is short, isolated, and common to the sensors: one that is disturbed by itself is faulty. A reading is shaken if
it lies outside of the range between the levels before and after it, by more than these bend: a step, such as that by a
kick or of a bias, is no shock.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import stats
from scipy.ndimage import median_filter

from bayesid._math.arrays import Bools, Floats

__all__ = ["ShakenSensor", "Shock", "outside", "shocks"]

HALF_PERIOD = 2.5
"""Longest shock in blocks: half a period of the fastest motion that the blocks resolve, which has five of them."""

LEVEL = 1e-3
"""Probability that noise shakes a channel of a recording."""

MEDIAN = 0.6745
"""Median of the absolute value of a standard normal variable."""

AROUND = 3.0
"""Length of the stretches before and after a reading from which the levels follow, in longest shocks: of what is
shorter than half of a stretch, its median knows nothing."""

ISOLATED = 8.0
"""Time from a shock to the next disturbance of a sensor at least, in longest shocks: a vibration recurs sooner."""


class Shock(NamedTuple):
    """Time within which sensors are shaken: begin and end [s], with no shaken reading outside."""

    begin: float
    end: float

    @property
    def middle(self) -> float:
        """Middle [s]."""
        return 0.5 * (self.begin + self.end)

    def holds(self, time: Floats) -> Bools:
        """Return which times (n,) are within the shock."""
        return np.asarray((time >= self.begin) & (time <= self.end))


class ShakenSensor(NamedTuple):
    """Samples of one sensor.

    Attributes
    ----------
    time : (n,) array
        Times [s].
    values : (n, k) array
        Readings.
    sigma : (k,) array
        Standard deviations of the noise per sample.
    """

    time: Floats
    values: Floats
    sigma: Floats

    @property
    def interval(self) -> float:
        """Median time between the samples [s]."""
        return float(np.median(np.diff(self.time))) if len(self.time) > 1 else np.inf


def shocks(sensors: Sequence[ShakenSensor], blocks_per_second: float) -> list[Shock]:
    """Return the shocks that all sensors of a recording feel; none where there are fewer than two, or all are slow.

    Parameters
    ----------
    sensors : sequence of ShakenSensor
        Sensors that feel a motion of the base.
    blocks_per_second : float
        Rate of the blocks that samples are averaged over [1/s], which resolve every motion that effects describe; 0
        where every sample counts.
    """
    longest = HALF_PERIOD / blocks_per_second if blocks_per_second > 0.0 else 0.0
    if len(sensors) < 2 or any(sensor.interval > longest for sensor in sensors):
        return []
    common = _disturbances(sensors[0], longest)
    for sensor in sensors[1:]:
        margin = max(sensor.interval, sensors[0].interval)
        common = [
            Shock(min(one.begin, other.begin), max(one.end, other.end))
            for one in common
            for other in _disturbances(sensor, longest)
            if other.begin < one.end + margin and one.begin < other.end + margin
        ]
    borders = [-np.inf, *(edge for one in common for edge in one), np.inf]
    quiet = np.diff(borders)[::2] > ISOLATED * longest
    return [one for k, one in enumerate(common) if quiet[k] and quiet[k + 1] and one.end - one.begin <= longest]


def outside(some: Sequence[Shock], time: Floats) -> Bools:
    """Return which times (n,) are in none of some shocks.

    Parameters
    ----------
    some : sequence of Shock
    time : (n,) array
        Times [s].
    """
    return ~np.any([np.zeros(len(time), dtype=bool), *(shock.holds(time) for shock in some)], axis=0)


def _disturbances(sensor: ShakenSensor, longest: float) -> list[Shock]:
    """Return the times in which a sensor departs from the levels before and after, and rests in between."""
    shaken = np.zeros(len(sensor.time), dtype=bool)
    for column, sigma in zip(sensor.values.T, sensor.sigma, strict=True):
        shaken |= _shaken(column, float(sigma), longest / sensor.interval)
    times = sensor.time[shaken]
    runs = np.split(times, np.flatnonzero(np.diff(times) > longest) + 1) if len(times) else []
    return [Shock(float(run[0]), float(run[-1])) for run in runs]


def _shaken(values: Floats, sigma: float, longest: float) -> Bools:
    """Return which readings (n,) lie outside of the levels before and after them, as noise never does in a recording.

    Parameters
    ----------
    values : (n,) array
    sigma : float
        Standard deviation of the noise; vibrations that last count as noise.
    longest : float
        Longest shock in samples, at least 1.
    """
    width = 2 * int(0.5 * AROUND * longest) + 1
    apart = int(np.ceil((1.0 + 0.5 * AROUND) * longest))
    level = median_filter(values, width, mode="nearest")
    place = np.arange(len(values))
    earlier, before, after, later = (level[np.clip(place + k * apart, 0, len(level) - 1)] for k in (-2, -1, 1, 2))
    bend = (before + after - earlier - later) / 6.0  # by the cubic through all four, from the mean of the inner ones
    scale = max(sigma, float(np.median(np.abs(values - 0.5 * (before + after) - bend))) / MEDIAN)
    outside = np.maximum(values - np.maximum(before, after), np.minimum(before, after) - values)
    bound = float(stats.norm.isf(0.5 * LEVEL / len(values))) * np.sqrt(1.0 + 0.5 * np.pi / width)
    shaken = outside > bound * scale + np.abs(bend)
    return np.asarray(shaken & (place >= 2 * apart) & (place < len(values) - 2 * apart))
