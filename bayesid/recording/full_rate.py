"""What is seen of a channel's noise at its full rate, before its samples are averaged over blocks.

Motion is slower than the blocks, so that what is faster is noise: its size, whether it is white, tones, and spikes. The
spectrum is the mean of periodograms of overlapping windowed pieces (Welch 1967, IEEE Transactions on Audio and
Electroacoustics 15).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import signal, stats
from scipy.ndimage import median_filter

from bayesid._math.arrays import Floats

__all__ = ["ChannelSpectrum", "Tone", "channel_spectrum", "noise_scale", "spikes"]

PIECES = 16  # pieces of a recording whose periodograms are averaged, at least
LONGEST_PIECE = 4096  # samples of a piece at most
INDEPENDENT = 0.947  # of Hann windows that overlap by half, relative to their number (Welch 1967)
LEVEL = 1e-3  # probability that noise shows a tone or a spike in a channel
NEAR = 51  # lines of the spectrum whose median is the noise about a tone
SHARED = 2.0  # neighbouring lines under a Hann window that tell as much as one
EFFICIENCY = 2.0 / np.pi  # of a median relative to a mean
MEDIAN = 0.6745  # median of the absolute value of a standard normal variable
NEIGHBOURS = 5  # samples whose median a spike departs from


@dataclass(frozen=True)
class Tone:
    """A line in a spectrum: frequency [Hz] and amplitude of the sine [unit of the channel]."""

    frequency: float
    amplitude: float


@dataclass(frozen=True)
class ChannelSpectrum:
    """Spectrum of one channel and what it holds above the rate of the blocks.

    Attributes
    ----------
    name : str
        Column.
    frequency : (n,) array
        Frequencies [Hz].
    density : (n,) array
        One-sided amplitude spectral density [unit per root hertz].
    samples, blocks : int
        Numbers of samples, and of blocks that they are averaged over.
    block_rate : float
        Blocks a second [Hz].
    sigma : float
        Standard deviation per sample of white noise of the density above the blocks' rate; NaN where nothing is above.
    declared : float
        Standard deviation per sample that is declared; NaN where none is.
    sigma_error : float
        Relative standard error of ``sigma``.
    slope : float
        Logarithm of the density's square in the lower over that in the upper half above the blocks' rate, zero for
        white noise, over its standard error.
    tones : tuple of Tone
        Above the blocks' rate.
    spikes : int
        Samples that are no measurement, which are left out of the averages.
    """

    name: str
    frequency: Floats
    density: Floats
    samples: int
    blocks: int
    block_rate: float
    sigma: float
    declared: float
    sigma_error: float
    slope: float
    tones: tuple[Tone, ...]
    spikes: int

    @property
    def reduced(self) -> bool:
        """Whether the channel is averaged over blocks."""
        return self.blocks < self.samples

    @property
    def remarks(self) -> tuple[str, ...]:
        """Sentences on what is above the blocks' rate."""
        sentences = [
            f"{self.name} has a tone at {line.frequency:.4g} Hz with an amplitude of {line.amplitude:.2g}, above the "
            "block rate: averaging removes it."
            for line in self.tones
        ]
        if self.spikes:
            sentences.append(f"{self.name} has {self.spikes} spikes of single samples, which are omitted.")
        off = abs(self.sigma / self.declared - 1.0)
        if off > max(0.1, 5.0 * self.sigma_error):
            sentences.append(
                f"{self.name} has noise of {self.sigma:.2g} per sample above {self.block_rate:.3g} Hz; the "
                f"declared value is {self.declared:.2g}."
            )
        if abs(self.slope) > stats.norm.isf(LEVEL):
            kind = "falls" if self.slope > 0.0 else "rises"
            sentences.append(f"The noise of {self.name} above {self.block_rate:.3g} Hz {kind} with frequency.")
        return tuple(sentences)


def channel_spectrum(
    name: str, time: Floats, values: Floats, blocks: int, declared: float = np.nan, left_out: int = 0
) -> ChannelSpectrum:
    """Return the spectrum of one channel, and what it holds above the rate of its blocks.

    Parameters
    ----------
    name : str
    time, values : (n,) array
        Times [s] and samples.
    blocks : int
        Number of blocks that the samples are averaged over.
    declared : float
        Standard deviation of the noise per sample.
    left_out : int
        Number of spikes.
    """
    count, interval = len(time), float(np.median(np.diff(time)))
    block_rate = 1.0 / (interval * max(1, round(count / blocks)))
    length = max(8, min(LONGEST_PIECE, 2 * count // PIECES))
    frequency, power = signal.welch(  # type: ignore[call-overload]  # its stubs lack the linear detrending
        values, 1.0 / interval, nperseg=min(length, count), detrend="linear"
    )
    pieces = max(1.0, INDEPENDENT * (2 * count // len(values[:length]) - 1))
    inside = slice(1, len(frequency) - 1)
    frequency, power = frequency[inside], power[inside]
    above = frequency > block_rate
    sigma = error = np.nan
    slope, tones = 0.0, tuple[Tone, ...]()
    if blocks < count and above.sum() >= NEAR:
        high, line = frequency[above], power[above]
        noise = median_filter(line, NEAR, mode="nearest") / (1.0 - 1.0 / (9.0 * pieces)) ** 3
        sigma = float(np.sqrt(noise.mean() * 0.5 / interval))
        error = float(np.sqrt(SHARED / EFFICIENCY / (4.0 * pieces * len(line))))
        tones = _tones(high, line, noise, pieces)
        halves = [np.log(np.median(part)) for part in np.array_split(line, 2)]
        slope = float((halves[0] - halves[1]) / np.sqrt(4.0 * SHARED / EFFICIENCY / (pieces * len(line))))
    return ChannelSpectrum(
        name, frequency, np.sqrt(power), count, blocks, block_rate, sigma, declared, error, slope, tones, left_out
    )


def _tones(frequency: Floats, power: Floats, noise: Floats, pieces: float) -> tuple[Tone, ...]:
    """Return the lines that noise has with a probability of `LEVEL` in the whole spectrum."""
    about = NEAR * EFFICIENCY / SHARED  # lines from which the noise is known
    p_value = stats.f.sf(power / noise, 2.0 * pieces, 2.0 * pieces * about)
    places = np.flatnonzero(p_value < LEVEL / len(power))
    groups = np.split(places, np.flatnonzero(np.diff(places) > 2) + 1) if len(places) else []
    width, tones = frequency[1] - frequency[0], []
    for group in groups:
        peak = slice(max(group[0] - 1, 0), group[-1] + 2)
        excess = np.maximum(power[peak] - noise[peak], 0.0)
        centre = float((excess * frequency[peak]).sum() / excess.sum())
        tones.append(Tone(centre, float(np.sqrt(2.0 * width * excess.sum()))))
    return tuple(tones)


def noise_scale(values: Floats) -> float:
    """Return the standard deviation of white noise from second differences (n - 2,), which motion hardly enters.

    Parameters
    ----------
    values : (n,) array
    """
    return float(np.median(np.abs(np.diff(values, n=2))) / (MEDIAN * np.sqrt(6.0))) if len(values) > 2 else 0.0


def spikes(values: Floats, sigma: float) -> tuple[NDArray[np.bool_], Floats]:
    """Return a mask of the samples (n,) that depart from their neighbours' median as noise never does in a recording.

    Beside it stands by how many standard deviations of a sample each of them departs.

    Parameters
    ----------
    values : (n,) array
    sigma : float
        Declared standard deviation of the noise; a larger one that the samples show takes its place.
    """
    scale = max(sigma, noise_scale(values))
    bound = float(stats.norm.isf(0.5 * LEVEL / len(values))) * np.sqrt(1.0 + 0.5 * np.pi / (NEIGHBOURS - 1))
    departure = np.abs(values - median_filter(values, NEIGHBOURS, mode="nearest")) / scale
    gone = departure > bound
    return gone, departure[gone]
