"""The paper's manoeuvre of ETS-VII, flown by an independent simulator, and the noises that its sensors may have."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_simpson

from bayesid import Model, SensorKind
from bayesid._math.arrays import Floats
from bayesid.recording.joint_motion import Excitation
from bayesid.simulation.sensors import StarTracker
from studies.base_body import paper
from studies.common import flight
from studies.common.ets7 import BIAS, INTERVAL, ets7, excitation
from studies.common.models import base_model

__all__ = ["Flight", "Noise", "fly", "junctions", "levels", "model_of", "motion", "near_junctions"]

NEAR = 2.0
"""Distance from a junction of (27) within which samples of the base's sensors may be left out [s].

The third derivative of the joints' positions jumps at a junction.
"""

FINE = 0.1
"""Step of the independent simulator, and between the accelerations that are integrated to the true velocity [s]."""


@dataclass(frozen=True)
class Noise:
    """Standard deviations of white noise per sample.

    Attributes
    ----------
    rate : float
        Noise of the base's rates [rad/s].
    accel : float
        Noise of the accelerometer [m/s2].
    position : float
        Noise of the joints' encoders [rad].
    """

    rate: float
    accel: float
    position: float


@dataclass(frozen=True)
class Flight:
    """True motion at the samples.

    Attributes
    ----------
    time : (T,) array
        Sample times [s].
    position : (T, 6) array
        Joint positions [rad].
    rate, accel : (T, 3) array
        Rate of the base [rad/s] and acceleration at the accelerometer [m/s2], in base axes.
    rate_change : (T, 3) array
        Derivative of the rate [rad/s2].
    velocity : (T, 3) array
        Integral of ``accel`` over time, from its values at every `FINE` [m/s].
    """

    time: Floats
    position: Floats
    rate: Floats
    accel: Floats
    rate_change: Floats
    velocity: Floats


def motion() -> Excitation:
    """Return the paper's manoeuvre, with the frequency assumed in `studies.base_body`."""
    return excitation(paper.EXCITATION)


@cache
def fly(*, gradient: bool = True) -> Flight:
    """Fly the manoeuvre from rest, in orbit or far from any mass."""
    planned = motion()
    fine = FINE * np.arange(round(planned.duration / FINE) + 1)
    run = flight.fly(ets7(), planned, fine, step=FINE, orbit=flight.ORBIT if gradient else None)
    every = round(INTERVAL / FINE)
    velocity = cumulative_simpson(run.accel, dx=FINE, axis=0, initial=0.0)
    change = np.gradient(run.rate, FINE, axis=0, edge_order=2)
    columns = (fine, run.position, run.rate, run.accel, change, velocity)
    return Flight(*(np.array(column[::every]) for column in columns))


def model_of(noise: Noise, *, biased: bool) -> Model:
    """Return the model: base and initial rate unknown, and where ``biased`` the accelerometer's constant error."""
    return base_model({SensorKind.RATE: noise.rate, SensorKind.ACCEL: noise.accel}, bias=BIAS if biased else 0.0)


def levels(flown: Flight) -> dict[str, Noise]:
    """Return the levels of noise by name.

    The paper's sigmas are read as `studies.base_body.paper.SIGMAS` says; beside it, the first as a share of the peak.
    """
    rate, accel = (float(np.abs(values).max()) for values in (flown.rate, flown.accel))
    noises = {}
    for sigma in paper.SIGMAS:
        degrees = float(np.radians(sigma))
        noises[f"{sigma:g} deg/s"] = Noise(degrees, degrees * accel / rate, degrees)
    noises["4 % of peak"] = Noise(0.04 * rate, 0.04 * accel, 1e-5)
    star = float(StarTracker(2.0).sigma(INTERVAL)[0])
    for grade, encoder in ((1e-5, 1e-4), (1e-5, 1e-5), (1e-5, 1e-6), (1e-7, 1e-6), (1e-9, 1e-6)):
        noises[f"2″, {grade:.0e}, {encoder:.0e}".replace("e-0", "e-")] = Noise(star, grade, encoder)
    return noises


def junctions() -> tuple[float, float]:
    """Return the times at which the oscillation of (27) meets its connecting splines [s]."""
    planned = motion()
    return planned.ramp, planned.duration - planned.ramp


def near_junctions(time: Floats) -> NDArray[np.bool_]:
    """Return which samples lie near a junction of (27), shape (T,)."""
    near: NDArray[np.bool_] = (np.abs(time[:, None] - np.array(junctions())) <= NEAR).any(axis=1)
    return near
