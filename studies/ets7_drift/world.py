"""Recordings of the flight's manoeuvre, flown in MuJoCo with the causes, and the model that lacks them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from bayesid import BodyPrior, InertialParameters, Manoeuvre, Model, Orbit, Sensor, SensorKind, White
from bayesid._math.arrays import Floats
from studies.common.ets7 import BASE, RADIUS, FlightManoeuvre, ets7
from studies.common.flight import ORBIT, fly, light_wheel, record
from studies.truth.mujoco import Body, nearby

__all__ = ["DURATION", "KNOWN", "MOTION", "World", "draw_world", "model_of"]

DURATION = 300.0  # duration of a recording [s]; the attitude control is off throughout
INTERVAL = 1.0  # time between samples of all sensors [s]

# manoeuvre of the flight from joints at zero, each of its linear ramps replaced by a smooth quintic
MOTION = FlightManoeuvre(np.zeros(6), corner=None)

STEP = 0.25  # integration step of MuJoCo [s]

# noise per sample of rates (two seconds of arc per second), attitude (twenty seconds of arc) and joints [rad/s, rad,
# rad]
RATE_SIGMA, ATTITUDE_SIGMA, ENCODER_SIGMA = 1e-5, 1e-4, 1e-5

MOMENTUM = (0.6, -0.4, 0.8)  # momentum left in the reaction wheels [N m s]
RATE = 3e-4  # standard deviation of the initial rates about each axis [rad/s]: a degree in a minute

# to what the base's mass is known -> relative width of the base's prior, of which the true base is a draw
KNOWN = {"5 %": 0.025, "1 %": 0.005}


@dataclass(frozen=True)
class World:
    """What truly happens in a set of recordings."""

    momentum: Floats  # (3,): momentum of the wheels [N m s]
    rates: Floats  # (R, 3): initial rates [rad/s]
    base: Floats  # (10,): reported quantities of the true base body
    manoeuvres: tuple[Manoeuvre, ...]  # manoeuvres as recorded, with noise


def draw_world(recordings: int, seed: int, spread: float, duration: float = DURATION) -> World:
    """Draw a true base, attitudes, places on the orbit and initial rates; simulate and measure.

    Parameters
    ----------
    recordings, seed : int
        Number of recordings, and seed of all random numbers.
    spread : float
        Relative width of the draw of the true base about the published one.
    duration : float
        Duration of a recording [s].
    """
    rng, robot = np.random.default_rng(seed), ets7()
    published = robot.link(BASE).inertial
    base = nearby(Body(published.mass, published.com, published.inertia), rng, spread)
    wheels = np.array(MOMENTUM)
    manoeuvres, rates = [], RATE * rng.standard_normal((recordings, 3))
    time = np.arange(0.0, duration + 0.5 * INTERVAL, INTERVAL)
    true = robot.with_inertial(BASE, InertialParameters(base.mass, base.com, base.inertia))
    noise = {"position": ENCODER_SIGMA, "attitude": ATTITUDE_SIGMA, "rate": RATE_SIGMA}
    for index, rate in enumerate(rates):
        latitude = float(rng.uniform(0.0, 2.0 * np.pi))
        attitude = Rotation.random(rng=rng).as_quat()
        orbit, rotor = replace(ORBIT, argument_of_latitude=latitude), light_wheel(wheels)
        truth = fly(true, MOTION, time, step=STEP, rate=rate, attitude=attitude, orbit=orbit, rotor=rotor)
        manoeuvre = record(truth, f"flight {index + 1}", robot, noise, rng)
        manoeuvres.append(replace(manoeuvre, attitude=attitude, argument_of_latitude=latitude))
    return World(wheels, rates, base.quantities, tuple(manoeuvres))


def model_of(spread: float) -> Model:
    """Return the model that starts at rest and has no disturbance, with the published base as prior.

    It uses the rates alone; the measured attitude is kept for comparison.
    """
    robot = ets7()
    return Model(
        robot,
        (Sensor(SensorKind.RATE, White(RATE_SIGMA)),),
        (BodyPrior(BASE, robot.link(BASE).inertial, spread),),
        orbit=Orbit(RADIUS),
        rate_sigma=0.0,
    )
