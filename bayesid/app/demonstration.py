"""Demonstration studies: shipped recordings of MuJoCo with a hidden cause, and a simulated ETS-VII."""

from __future__ import annotations

import json
from importlib.resources import files
from pathlib import Path

import numpy as np

from bayesid._io.files import create_folder, write_text
from bayesid.inference.simulated_recordings import simulate_manoeuvre
from bayesid.recording.joint_motion import Excitation
from bayesid.robot.body_prior import BodyPrior
from bayesid.robot.inertial_parameters import InertialParameters
from bayesid.robot.robot import Robot
from bayesid.simulation.effects import GravityGradient
from bayesid.simulation.model import Model
from bayesid.simulation.orbit import Orbit
from bayesid.simulation.sensors import Kind, Sensor, White

__all__ = ["copy_demonstration", "write_demo"]

RATE_SIGMA, ACCEL_SIGMA, ENCODER_SIGMA = 1.0e-5, 1.0e-5, 1.0e-6
"""Noise per sample of gyro [rad/s], accelerometer [m/s2] and encoders [rad], typical of good instruments."""

ACCELEROMETER = (0.4, 0.3, 0.8)
"""Position of the accelerometer from the base origin, base axes [m]."""

RADIUS = 6.916e6
"""Radius of the orbit [m], about 540 km above the ground."""

INTERVAL = 0.5
"""Interval between samples [s]."""

MANOEUVRES = (
    ((0.63, -2.18, 0.05, 0.4, -0.3, 0.2), (-0.9, -0.15, -0.56, 0.3, 0.4, 0.2)),
    ((-0.4, -0.8, 1.0, -0.5, 0.6, 0.0), (0.5, 0.7, -0.4, 0.5, -0.3, 0.4)),
    ((1.2, -1.2, -0.7, 0.3, 0.2, -0.5), (-0.3, 0.5, 0.8, -0.4, 0.5, 0.3)),
)
"""Offsets and amplitudes of (27) on the six joints [rad]; the wrist moves too, so that the manoeuvres differ."""

STUDY = """title = "Demonstration: the base of ETS-VII"

[robot]
urdf = "robot.urdf"

[orbit]
radius = {radius}

[sensors.rate]
sigma = {rate}

[sensors.accel]
sigma = {accel}
position = {position}

[sensors.encoder]
sigma = {encoder}
{recordings}
[unknowns]
bodies = ["base_link"]

[model]
effects = ["gravity-gradient"]
"""
"""Template of the study file."""

RECORDING = """
[[recordings]]
file = "{file}"
attitude = {attitude}
"""
"""Template of a recording's section in the study file."""


def copy_demonstration(folder: Path) -> dict[str, dict[str, float]]:
    """Copy the shipped study into a folder.

    Returns
    -------
    dict
        True values of the effects hidden in its recordings, by effect and key, in SI units.
    """
    create_folder(folder)
    shipped = files("bayesid.app") / "demonstration_data"
    answer: dict[str, dict[str, float]] = {}
    for item in shipped.iterdir():
        text = item.read_text(encoding="utf-8")
        if item.name == "hidden.json":
            answer = json.loads(text)
        else:
            write_text(folder / item.name, text)
    return answer


def write_demo(folder: Path, seed: int) -> InertialParameters:
    """Write a study of the simulated ETS-VII and its recordings, with a wrong guess of the base in the URDF.

    Returns
    -------
    InertialParameters
        Inertial parameters of the true base.
    """
    rng = np.random.default_rng(seed)
    robot = Robot.shipped("ets7")
    truth = robot.link(robot.base).inertial
    model = Model(
        robot=robot,
        sensors=(Sensor(Kind.RATE, White(RATE_SIGMA)), Sensor(Kind.ACCEL, White(ACCEL_SIGMA), position=ACCELEROMETER)),
        priors=(BodyPrior(robot.base, truth, 1.0),),
        orbit=Orbit(RADIUS),
        effects=(GravityGradient(),),
    )
    create_folder(folder)
    sections = []
    for number, (offset, amplitude) in enumerate(MANOEUVRES, start=1):
        motion = Excitation(np.array(offset), np.array(amplitude), 2.0 * np.pi / 30.0, periods=2, ramp=30.0)
        time = np.arange(0.0, motion.duration + 1e-9, INTERVAL)
        attitude = rng.normal(size=4)
        attitude /= np.linalg.norm(attitude)
        name = f"manoeuvre-{number}"
        recording = simulate_manoeuvre(
            model, motion, time, name=name, attitude=attitude, rng=rng, encoder_sigma=ENCODER_SIGMA
        )
        recording.write(folder / f"{name}.csv")
        sections.append(RECORDING.format(file=f"{name}.csv", attitude=[float(f"{value:.12g}") for value in attitude]))
    robot.perturbed(robot.base, 0.15, rng).write_urdf(folder / "robot.urdf")
    text = STUDY.format(
        radius=RADIUS,
        rate=RATE_SIGMA,
        accel=ACCEL_SIGMA,
        position=list(ACCELEROMETER),
        encoder=ENCODER_SIGMA,
        recordings="".join(sections),
    )
    write_text(folder / "study.toml", text)
    return truth
