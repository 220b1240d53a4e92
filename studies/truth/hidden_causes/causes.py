"""Hidden causes of the catalogue and outside effects: (draw, strength) -> keywords of `write_study`."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from studies.truth import mujoco as mj
from studies.truth.hidden_causes.case import Generator, Options, direction
from studies.truth.hidden_causes.sensor_faults import (
    Backlash,
    BiasJump,
    ColouredNoise,
    CurvedGyro,
    EncoderOffset,
    Outliers,
    Quantisation,
    TurnedStarSensor,
    VectorFault,
    WrongClock,
)
from studies.truth.urdf import link_body

JUMP = 0.1
"""Time within which a mass jumps [s], shorter than the step between two samples."""


def _hide(**parts: Any) -> Options:
    """Keywords that hide parts or fields."""
    return {"hidden": mj.Hidden(**parts)}


def no_gradient(draw: Generator, strength: float) -> Options:
    """Gravity gradient, which the model of the study lacks; a higher orbit makes it fainter."""
    return {"effects": (), "orbit": {"radius": float(1.0e7 * strength ** (-1.0 / 3.0))}}


def initial_rate(draw: Generator, strength: float) -> Options:
    """Rate at the start, which the study takes for zero."""
    return {"initial_rate": "zero", "manoeuvres": {"rate_spread": 6e-6 * strength}}


def wheel(draw: Generator, strength: float) -> Options:
    """Momentum of a wheel in the base."""
    position = tuple(draw.uniform(-0.4, 0.4, 3).tolist())
    return _hide(rotor=mj.Rotor(tuple(direction(draw, 0.05 * strength).tolist()), position))


def air(draw: Generator, strength: float) -> Options:
    """Air drag."""
    return _hide(environment=[partial(mj.drag, force=2e-4 * strength, cp=direction(draw, 0.6))])


def light(draw: Generator, strength: float) -> Options:
    """Solar pressure."""
    return _hide(environment=[partial(mj.sunlight, force=1.2e-4 * strength, cp=direction(draw, 0.6))])


def magnet(draw: Generator, strength: float) -> Options:
    """Magnetic moment of the base."""
    return _hide(environment=[partial(mj.magnet, moment=direction(draw, 3.0 * strength))])


def leak(draw: Generator, strength: float) -> Options:
    """Leak of a thruster."""
    return _hide(fields=[mj.leak(direction(draw, 2e-4 * strength), direction(draw, 1e-4 * strength))])


def braking(draw: Generator, strength: float) -> Options:
    """Torque against the rate of the base."""
    return _hide(fields=[mj.braking(0.05 * strength * draw.uniform(0.5, 1.0, 3))])


def panel(draw: Generator, strength: float) -> Options:
    """Solar panel on a spring."""
    anchor, hinge = (
        [[0.0, 0.8, 0.1], [0.0, -0.8, -0.2]][draw.integers(2)],
        [[1.0, 0.0, 0.2], [0.6, 0.0, 0.8]][draw.integers(2)],
    )
    frequency = float(draw.uniform(0.28, 0.34))
    return _hide(appendages=[mj.panel(4.5 * strength, (2.0, 0.8), anchor, hinge, frequency)]) | {"step": 0.125}


def fuel(draw: Generator, strength: float) -> Options:
    """Sloshing fuel."""
    position = direction(draw, 0.7)
    return _hide(appendages=[mj.slosh(6.0 * strength, position, float(draw.uniform(0.24, 0.3)))]) | {"step": 0.125}


def payload(link: str, urdf: Path, mass: float, com: ArrayLike, draw: Generator, strength: float) -> Options:
    """Payload on a link."""
    where = np.asarray(com) + 0.03 * direction(draw)
    added = mj.Body(mass * strength, where, mass * strength * np.diag([0.004, 0.005, 0.006]))
    return _hide(changed={link: mj.join(link_body(urdf, link), added)})


def wrong_cad(link: str, urdf: Path, spread: float, draw: Generator, strength: float) -> Options:
    """Link whose inertial parameters differ from its drawing."""
    return _hide(changed={link: mj.wrong_guess(link_body(urdf, link), draw, spread * strength)})


def soft_joint(joint: str, frequency: float, draw: Generator, strength: float) -> Options:
    """Flexible joint; its deflection goes with 1 / frequency^2."""
    frequency = float(frequency * draw.uniform(0.95, 1.05) / np.sqrt(strength))
    return _hide(flexible=[mj.Flexibility(joint, frequency)]) | {"step": min(0.25, 0.06 / frequency)}


def vector_fault(sensor: str, kind: str, size: float, draw: Generator, strength: float) -> Options:
    """Constant error of the rate sensor or the accelerometer."""
    return {"distort": VectorFault(sensor, **{kind: direction(draw, size * strength)})}


def misplaced(draw: Generator, strength: float) -> Options:
    """Accelerometer that is not where the study says."""
    return {"declared_offset": direction(draw, 0.006 * strength)}


def delay(sensor: str, size: float, draw: Generator, strength: float) -> Options:
    """Latency of a sensor."""
    return {"sensors": {f"{sensor}_delay": size * strength}}


def encoder_offset(joint: str, size: float, draw: Generator, strength: float) -> Options:
    """Constant error of an encoder."""
    return {"distort": EncoderOffset(joint, float(draw.choice([-1.0, 1.0])) * size * strength)}


def clock(sensor: str, size: float, draw: Generator, strength: float) -> Options:
    """Clock of a sensor that runs fast or slow."""
    return {"distort": WrongClock(sensor, float(draw.choice([-1.0, 1.0])) * size * strength)}


def turned_star_sensor(draw: Generator, strength: float) -> Options:
    """Star sensor that is mounted otherwise than stated."""
    return {"distort": TurnedStarSensor(direction(draw, 5e-5 * strength))}


def changing_wheel(draw: Generator, strength: float) -> Options:
    """Wheel along z whose momentum goes up and down in straight lines, and is not recorded."""
    times = np.concatenate([[0.0], np.sort(draw.uniform(20.0, 130.0, 4)), [200.0]])
    levels = 0.02 * strength * draw.uniform(-1.0, 1.0, len(times))
    return _hide(fields=[mj.SpunWheel(np.array([0.0, 0.0, 1.0]), times, levels)])


def understated(sensor: str, size: float, draw: Generator, strength: float) -> Options:
    """Noise that is stronger than the study says."""
    true = {"rate": 1e-5, "accel": 1e-5, "encoder": 1e-6}[sensor]
    return {"declared": {f"{sensor}_sigma": true / (1.0 + size * strength)}}


def coloured(sensor: str, draw: Generator, strength: float) -> Options:
    """Coloured noise beside the white."""
    return {"spoil": ColouredNoise(sensor, 7e-6 * strength, float(draw.uniform(3.0, 6.0)))}


def outliers(sensor: str, draw: Generator, strength: float) -> Options:
    """Outliers among the samples."""
    return {"spoil": Outliers(sensor, 0.005 * strength, 1e-5)}


def rounded(sensor: str, draw: Generator, strength: float) -> Options:
    """Coarse quantisation of the samples."""
    return {"spoil": Quantisation(sensor, 4e-5 * strength)}


def pulse_train(draw: Generator, strength: float) -> Options:
    """Pulses of torque at regular intervals."""
    return _hide(fields=[mj.pulses(direction(draw, 4e-4 * strength), every=20.0, length=4.0, start=7.0)])


def thermal_snap(draw: Generator, strength: float) -> Options:
    """Torque that appears at once and dies away."""
    start = float(draw.integers(50, 80))
    return _hide(fields=[mj.snap(direction(draw, 2.5e-3 * strength), start=start, decay=4.0)])


def growing_torque(draw: Generator, strength: float) -> Options:
    """Torque that grows in proportion to time."""
    vector = direction(draw, 1e-6 * strength)
    return _hide(fields=[mj.outer_torque(lambda time: time * vector)])


def swinging_torque(draw: Generator, strength: float) -> Options:
    """Torque that swings at a frequency outside the catalogue."""
    vector, omega = direction(draw, 1e-3 * strength), 2.0 * np.pi * draw.uniform(0.025, 0.035)
    return _hide(fields=[mj.outer_torque(lambda time: vector * np.sin(omega * time + 0.7))])


def shifting_mass(draw: Generator, strength: float) -> Options:
    """Mass that moves within the base once."""
    body = mj.Body(3.0, direction(draw, 0.4), 0.01 * np.eye(3))
    start = float(draw.integers(60, 80))
    return _hide(movers=[mj.Mover(body, tuple(direction(draw).tolist()), 0.015 * strength, start)])


def jumping_mass(draw: Generator, strength: float) -> Options:
    """Mass that moves within the base once in each recording, in a tenth of a second between two samples."""
    body = mj.Body(6.0, direction(draw, 0.4), 0.01 * np.eye(3))
    starts = 0.5 * draw.integers(60, 220, 3) + draw.uniform(0.05, 0.35, 3)
    travel = tuple(direction(draw).tolist())
    path = mj.Mover(body, travel, 0.3 * strength, float(starts[0]), JUMP, tuple(starts.tolist()))
    return _hide(movers=[path])


def bias_jump(draw: Generator, strength: float) -> Options:
    """Bias of the rate sensor that jumps once."""
    return {"distort": BiasJump("rate", direction(draw, 4e-5 * strength), float(draw.uniform(40.0, 100.0)))}


def curved_gyro(draw: Generator, strength: float) -> Options:
    """Rate sensor whose error goes with the square of the rate."""
    return {"distort": CurvedGyro(direction(draw, 0.1 * strength))}


def backlash(joint: str, draw: Generator, strength: float) -> Options:
    """Gear of a joint with a gap."""
    return {"distort": Backlash(joint, 6e-4 * strength)}


def wandering_torque(draw: Generator, strength: float) -> Options:
    """Torque that wanders at random with a memory of 15 s, fixed in orbit axes."""
    times = np.arange(0.0, 400.0, 5.0)
    decay = np.exp(-5.0 / 15.0)
    values = np.zeros((len(times), 3))
    for row in range(1, len(times)):
        values[row] = decay * values[row - 1] + np.sqrt(1.0 - decay**2) * draw.normal(size=3)
    history = CubicSpline(times, 4e-4 * strength * values)
    return _hide(fields=[mj.outer_torque(history)])
