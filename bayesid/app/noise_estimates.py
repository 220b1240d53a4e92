"""Noise of the sensors as recordings show it, for a first study file.

High differences of the samples leave noise and no motion, and the median over them leaves out where the motion is
rough; where the samples are too uneven for differences, the likelihood of a smoothing spline says how noisy they are.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from bayesid._math.arrays import Floats
from bayesid.diagnosis.noise.encoder_fault import noise_of
from bayesid.recording.recording import Recording
from bayesid.recording.smoothing import JointSamples, smooth

__all__ = ["channel_noise", "vector_noise"]

LEAST = 1e-9  # noise relative to the range of the samples below which there is none: it is the rounding of their digits
# degrees of freedom of the differences from which on they are taken, since smoothing takes some noise for motion
FEWEST = 3.0
MOST = 500  # number of samples that are smoothed at most, because more make the estimate slow and no better


def channel_noise(recordings: Sequence[Recording], column: str) -> float | None:
    """Return the standard deviation per sample of a channel, the median over the recordings; None if none is seen."""
    found = [_noise(*recording.series(column)) for recording in recordings if column in recording.channels]
    return _median(found)


def vector_noise(recordings: Sequence[Recording], family: str) -> tuple[float, float, float] | None:
    """Return the standard deviations per sample of the three axes of a sensor, None if one of them shows no noise.

    Those of an attitude are small rotations in base axes [rad].
    """
    axes = [
        _median([_noise(time, values[:, axis]) for time, values in _vectors(recordings, family)]) for axis in range(3)
    ]
    if None in axes:
        return None
    x, y, z = (float(sigma or 0.0) for sigma in axes)
    return x, y, z


def _vectors(recordings: Sequence[Recording], family: str) -> list[tuple[Floats, Floats]]:
    if family != "attitude":
        return [recording.vector(family) for recording in recordings]
    return [_turned(*recording.vector(family, ("x", "y", "z", "w"))) for recording in recordings]


def _turned(time: Floats, quaternion: Floats) -> tuple[Floats, Floats]:
    """Return the sum of the small rotations from sample to sample, whose noise is that of the samples."""
    attitude = Rotation.from_quat(quaternion)
    steps = (attitude[:-1].inv() * attitude[1:]).as_rotvec()
    return time, np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])


def _noise(time: Floats, values: Floats) -> float | None:
    differences = noise_of([JointSamples(0, time, values, 1.0)], FEWEST)
    if differences is not None:
        sigma = float(np.sqrt(differences.ratio))
    else:
        middle = slice(max(0, (len(time) - MOST) // 2), (len(time) + MOST) // 2)
        sigma = smooth([JointSamples(0, time[middle], values[middle], None)]).sigmas[0]
    return sigma if sigma > LEAST * float(np.ptp(values)) and sigma > 0.0 else None


def _median(found: Sequence[float | None]) -> float | None:
    seen = [sigma for sigma in found if sigma is not None]
    return float(np.median(seen)) if seen else None
