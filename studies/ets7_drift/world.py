"""The flight-like manoeuvre, the true motion from an independent simulator, and the model that lacks the causes."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from bayesid import (
    BodyPrior,
    Kind,
    Manoeuvre,
    MeasuredMotion,
    Model,
    Orbit,
    Recording,
    Robot,
    Sensor,
    White,
)
from studies.truth.mujoco import Body, Rotor, TruthModel, nearby, write_urdf
from studies.truth.mujoco import Orbit as TrueOrbit

__all__ = ["BASE", "DURATION", "RADIUS", "World", "draw_world", "model_of", "motion"]

Floats = NDArray[np.floating]

BASE = "base_link"
RADIUS = 6.916e6
"""Of the orbit, as the paper states it [m]."""

DURATION = 300.0
"""Of a recording [s]; the attitude control is off throughout."""

INTERVAL = 1.0
"""Between samples of all sensors [s]."""

STEPS = ((60.0, 82.6), (122.0, 144.6))
"""When the arm goes out and comes back [s]: the flight's own times, from a minute after the start."""

EXCURSION = np.array([0.0, 0.264, -0.321, 0.057, 0.0, 0.0])
"""Of the six joints in between [rad], those of the flight manoeuvre."""

RATE_SIGMA, ATTITUDE_SIGMA, ENCODER_SIGMA = 1e-5, 1e-4, 1e-5
"""Noise of rates (two seconds of arc per second), attitude (twenty seconds of arc) and joints [rad/s, rad, rad]."""

MOMENTUM = (0.6, -0.4, 0.8)
"""Left in the reaction wheels [N m s]."""

RATE = 3e-4
"""Standard deviation of the initial rates about each axis [rad/s]: a degree in a minute."""

SPREAD, TRUE_SPREAD = 0.005, 0.003
"""Relative width of the base's prior, and of the draw of the true base about the published one."""

WHEEL_MASS, WHEEL_INERTIA = 1e-3, 1e-3
"""So light that the base with the wheel at rest is the base without it."""


@dataclass(frozen=True)
class World:
    """What truly happens in a set of recordings.

    Attributes
    ----------
    momentum : (3,) array
        Of the wheels [N m s].
    rates : (R, 3) array
        Initial rates [rad/s].
    base : (10,) array
        Reported quantities of the true base body.
    manoeuvres : tuple of Manoeuvre
        As recorded, with noise.
    """

    momentum: Floats
    rates: Floats
    base: Floats
    manoeuvres: tuple[Manoeuvre, ...]


def motion(time: float) -> tuple[Floats, Floats, Floats]:
    """Joint positions, speeds and accelerations: the flight's linear ramps made quintic and smooth."""
    share = np.zeros(3)
    for sign, (start, stop) in zip((1.0, -1.0), STEPS, strict=True):
        length = stop - start
        x = min(max((time - start) / length, 0.0), 1.0)
        slope, bend = 30.0 * x**2 * (1.0 - x) ** 2 / length, 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) / length**2
        share += sign * np.array([x**3 * (10.0 - 15.0 * x + 6.0 * x**2), slope, bend])
    return share[0] * EXCURSION, share[1] * EXCURSION, share[2] * EXCURSION


def draw_world(recordings: int, seed: int, momentum: float = 1.0, duration: float = DURATION) -> World:
    """Draw a true base, attitudes, places on the orbit and initial rates; simulate and measure.

    Parameters
    ----------
    momentum : float
        Times `MOMENTUM`.
    duration : float
        [s]
    """
    rng = np.random.default_rng(seed)
    robot = Robot.shipped("ets7")
    published = robot.link(BASE).inertial
    base = nearby(Body(published.mass, published.com, published.inertia), rng, TRUE_SPREAD)
    wheels = np.array(MOMENTUM) * momentum
    manoeuvres, rates = [], RATE * rng.standard_normal((recordings, 3))
    time = np.arange(0.0, duration + 0.5 * INTERVAL, INTERVAL)
    with tempfile.TemporaryDirectory() as folder:
        urdf, true_urdf = Path(folder) / "robot.urdf", Path(folder) / "true.urdf"
        robot.write_urdf(urdf)
        write_urdf(urdf, true_urdf, base)
        for index in range(recordings):
            latitude = float(rng.uniform(0.0, 2.0 * np.pi))
            attitude = Rotation.random(rng=rng).as_quat()
            model = TruthModel(
                true_urdf,
                orbit=TrueOrbit(radius=RADIUS, argument_of_latitude=latitude),
                rotor=Rotor((wheels[0], wheels[1], wheels[2]), mass=WHEEL_MASS, spin_inertia=WHEEL_INERTIA),
            )
            run = model.run(motion, time, rate0=rates[index], attitude0=attitude, step=0.25)
            channels = {
                f"position.{joint}": run.position[:, k] + ENCODER_SIGMA * rng.standard_normal(len(time))
                for k, joint in enumerate(model.joints)
            }
            turn = Rotation.from_rotvec(ATTITUDE_SIGMA * rng.standard_normal((len(time), 3)))
            measured = (Rotation.from_quat(run.attitude) * turn).as_quat()
            noisy = run.rate + RATE_SIGMA * rng.standard_normal(run.rate.shape)
            channels |= {f"rate.{axis}": noisy[:, k] for k, axis in enumerate("xyz")}
            channels |= {f"attitude.{axis}": measured[:, k] for k, axis in enumerate("xyzw")}
            recording = Recording(f"flight {index + 1}", None, time, channels)
            sigma: dict[int, float] = {0: ENCODER_SIGMA}
            smoothed = MeasuredMotion.from_recording(recording, robot, sigma=sigma)
            manoeuvres.append(Manoeuvre(recording, smoothed, attitude, latitude=latitude))
    return World(wheels, rates, base.quantities, tuple(manoeuvres))


def model_of(spread: float = SPREAD) -> Model:
    """Return the model that starts at rest and knows of no disturbance, with the published base as prior.

    It sees the rates alone; the measured attitude is kept to compare with.
    """
    robot = Robot.shipped("ets7")
    return Model(
        robot,
        (Sensor(Kind.RATE, White(RATE_SIGMA)),),
        (BodyPrior(BASE, robot.link(BASE).inertial, spread),),
        orbit=Orbit(RADIUS),
        rate_sigma=0.0,
    )
