"""The paper's manoeuvre of ETS-VII, flown by an independent simulator, and the noises that its sensors may have."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_simpson

from bayesid import BodyPrior, Kind, Model, Orbit, Robot, Sensor, White
from bayesid.recording.joint_motion import Excitation
from bayesid.simulation.effects import AccelBias, GravityGradient
from bayesid.simulation.sensors import StarTracker
from studies.base_body import paper
from studies.common import flight
from studies.common.ets7 import ACCELEROMETER, BASE, BIAS, RADIUS, ets7, excitation

__all__ = ["INTERVAL", "JOLT", "Flight", "Noise", "fly", "joints_meet", "levels"]
__all__ += ["model_of", "motion", "unread"]

Floats = NDArray[np.floating]

INTERVAL = 0.5
"""Time between samples of all sensors [s]."""

JOLT = 2.0
"""Where (27) meets its connecting splines the joints' third derivative jumps; samples of the base's sensors this near
may be left out [s]."""

FINE = 0.1
"""Step of the independent simulator, and between the accelerations that are integrated to the true velocity [s]."""


@dataclass(frozen=True)
class Noise:
    """White noise per sample: of the rates [rad/s], of the accelerometer [m/s2], of the joints' positions [rad]."""

    rate: float
    accel: float
    encoder: float


@dataclass(frozen=True)
class Flight:
    """What truly happened at the samples.

    Attributes
    ----------
    time : (T,) array
    position : (T, 6) array
        Of the joints [rad].
    rate, accel : (T, 3) array
        Of the base, and at the accelerometer, base axes [rad/s, m/s2].
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


def model_of(noise: Noise, *, gradient: bool = True, biased: bool = True) -> Model:
    """Return the model: base and initial rate unknown, and where ``biased`` the accelerometer's constant error."""
    robot: Robot = ets7()
    return Model(
        robot,
        (Sensor(Kind.RATE, White(noise.rate)), Sensor(Kind.ACCEL, White(noise.accel), position=ACCELEROMETER)),
        (BodyPrior(BASE, robot.link(BASE).inertial, 1.0),),
        Orbit(RADIUS) if gradient else None,
        (*((GravityGradient(),) if gradient else ()), *((AccelBias(BIAS),) if biased else ())),
    )


def levels(flight: Flight) -> dict[str, Noise]:
    """Return the noises looked at, by name; the accelerometer's share of its peak is that of the rate.

    The paper prints sigma 0.04 and 0.009 without a unit: read as degrees and degrees per second, or as a fraction of
    the peak.
    """
    rate, accel = (float(np.abs(values).max()) for values in (flight.rate, flight.accel))
    found = {}
    for sigma in (0.04, 0.009):
        degrees = float(np.radians(sigma))
        found[f"{sigma:g} deg/s"] = Noise(degrees, degrees * accel / rate, degrees)
    found["4 % of peak"] = Noise(0.04 * rate, 0.04 * accel, 1e-5)
    star = float(StarTracker(2.0).sigma(INTERVAL)[0])
    for grade, encoder in ((1e-5, 1e-4), (1e-5, 1e-5), (1e-5, 1e-6), (1e-7, 1e-6), (1e-9, 1e-6)):
        found[f"2″, {grade:.0e}, {encoder:.0e}".replace("e-0", "e-")] = Noise(star, grade, encoder)
    return found


def joints_meet() -> tuple[float, float]:
    """Return when (27) meets its connecting splines [s]."""
    planned = motion()
    return planned.ramp, planned.duration - planned.ramp


def unread(time: Floats) -> NDArray[np.bool_]:
    """Return which samples lie near the jolts of (27)."""
    near: NDArray[np.bool_] = (np.abs(time[:, None] - np.array(joints_meet())) <= JOLT).any(axis=1)
    return near
