"""Robots and manoeuvres that are timed."""

from __future__ import annotations

import numpy as np

from bayesid import (
    BodyPrior,
    Excitation,
    Manoeuvre,
    MeasuredMotion,
    Model,
    Orbit,
    Posterior,
    Robot,
    Sensor,
    SensorKind,
    White,
)
from bayesid.design.design_result import sample_times
from bayesid.inference.predicted_readings import simulate_manoeuvre
from bayesid.simulation.effects import GravityGradient
from studies.common.ets7 import INTERVAL, RADIUS

SIGMA = 1.0e-5  # noise per sample of rate [rad/s] and accelerometer [m/s2]
DURATION = 120.0  # length of every manoeuvre [s]

# link and joint of the chain in URDF
LINK = """
  <link name="link{n}"><inertial><origin xyz="{half} 0 0.01"/><mass value="{mass}"/>
    <inertia ixx="{thin}" iyy="{thick}" izz="{thick}" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="joint{n}" type="revolute"><parent link="{parent}"/><child link="link{n}"/>
    <origin xyz="{length} 0 0" rpy="{turn} 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-6.3" upper="6.3" effort="1" velocity="10"/></joint>"""


def chain(links: int) -> Robot:
    """Return a robot whose arm of 3 m and 60 kg is cut into equal links."""
    length, mass = 3.0 / links, 60.0 / links
    thick = mass * (length**2 / 12.0 + 0.01)
    parts = [
        LINK.format(
            n=n,
            parent=f"link{n - 1}" if n > 1 else "base_link",
            half=length / 2.0,
            length=length if n > 1 else 0.8,
            mass=mass,
            thin=0.015 * mass,
            thick=thick,
            turn=np.pi / 2.0 if n % 2 else -np.pi / 2.0,
        )
        for n in range(1, links + 1)
    ]
    base = """<link name="base_link"><inertial><origin xyz="0.05 0.02 -0.1"/><mass value="640"/>
    <inertia ixx="210" iyy="265" izz="240" ixy="-4" ixz="6.5" iyz="3"/></inertial></link>"""
    return Robot.from_string(f'<robot name="chain">{base}{"".join(parts)}</robot>')


def model_of(robot: Robot) -> Model:
    """Return the model with an unknown base, rate sensor, accelerometer and gravity gradient."""
    sensors = (Sensor(SensorKind.RATE, White(SIGMA)), Sensor(SensorKind.ACCEL, White(SIGMA), position=(0.3, 0.2, 0.4)))
    prior = BodyPrior(robot.base, robot.link(robot.base).inertial, 1.0)
    return Model(robot, sensors, (prior,), Orbit(RADIUS), (GravityGradient(),))


def excitation(joints: int, seed: int) -> Excitation:
    """Return a random manoeuvre of all joints that lasts `DURATION`."""
    rng = np.random.default_rng(seed)
    shrink = np.sqrt(6.0 / joints)
    return Excitation(
        offset=0.5 * shrink * rng.normal(size=joints),
        amplitude=0.5 * shrink * rng.normal(size=joints),
        frequency=2.0 * np.pi / 30.0,
        periods=2,
        ramp=0.5 * (DURATION - 60.0),
    )


def posterior_of(
    robot: Robot, *, recordings: int = 1, interval: float = INTERVAL, encoder_sigma: float = 0.0
) -> Posterior:
    """Return the posterior of simulated recordings.

    Parameters
    ----------
    robot : Robot
    recordings : int; number of recordings of different manoeuvres
    interval : float; time between samples [s]
    encoder_sigma : float; noise of the joint positions [rad]; the joints' motion is known exactly where it is 0
    """
    model = model_of(robot)
    manoeuvres = []
    for seed in range(recordings):
        rng = np.random.default_rng(seed)
        motion = excitation(len(robot.joints), seed)
        time, name = sample_times(DURATION, interval), f"manoeuvre-{seed}"
        recording = simulate_manoeuvre(model, motion, time, name=name, rng=rng, encoder_sigma=encoder_sigma)
        measured = (
            MeasuredMotion.from_recording(recording, robot, sigma={0: encoder_sigma}) if encoder_sigma else motion
        )
        manoeuvres.append(Manoeuvre(recording, measured))
    return Posterior.of(model, manoeuvres)
