"""Hidden causes of the catalogue, faults of sensors and outside effects.

A cause is a function (draw, strength) -> keywords of `studies.truth.mujoco.write_study`, and under ``true`` the
magnitudes of what is hidden where they are a vector or a number. A sensor with constant errors sees

    measured = (1 + scale) * (rotation(misalignment) * true(t - latency)) + bias + drift * t

and a joint's encoder records true + offset.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from studies.truth import mujoco as mj
from studies.truth.bodies import link_body
from studies.truth.numerics import Array
from studies.truth.recordings import Distortion, Table, Truth, by_axis, stacked

Generator = np.random.Generator
Options = dict[str, Any]
Vector = Sequence[float] | Array

JUMP = 0.1  # time within which a mass jumps [s], shorter than the step between two samples


def direction(draw: Generator, size: float = 1.0) -> Array:
    """Random vector of given length, no component near zero."""
    vector = draw.choice([-1.0, 1.0], 3) * draw.uniform(0.5, 1.0, 3)
    return size * vector / np.linalg.norm(vector)


def triple(vector: Array) -> tuple[float, float, float]:
    """Vector (3,) as a tuple of floats."""
    x, y, z = vector.tolist()
    return x, y, z


def merge(first: Options, second: Options) -> Options:
    """Keywords of two causes joined; what both hide in the robot or in the sensors acts together."""
    merged = {**first, **second}
    both = first.keys() & second.keys()
    if "spoil" in both:
        raise ValueError("two causes spoil samples of one study: give them a common cause")
    if "hidden" in both:
        mine, other, nothing = vars(first["hidden"]), vars(second["hidden"]), vars(mj.Hidden())
        merged["hidden"] = mj.Hidden(**{k: other[k] if other[k] != nothing[k] else mine[k] for k in mine})
    if "distort" in both:
        merged["distort"] = _in_turn(first["distort"], second["distort"])
    for key in both & {"declared", "true"}:
        merged[key] = {**first[key], **second[key]}
    if "step" in both:
        merged["step"] = min(first["step"], second["step"])
    return merged


def _in_turn(*distortions: Distortion) -> Distortion:
    def both(table: Table, truth: Truth) -> None:
        for distortion in distortions:
            distortion(table, truth)

    return both


@dataclass(frozen=True)
class VectorFault:
    """Constant errors of the rate sensor or the accelerometer, one number per axis, in the sensor's units.

    Each is (3,): bias, drift [1/s], scale [1], and the rotation vector `misalignment` [rad].
    """

    sensor: str
    bias: Vector = (0.0, 0.0, 0.0)
    drift: Vector = (0.0, 0.0, 0.0)
    scale: Vector = (0.0, 0.0, 0.0)
    misalignment: Vector = (0.0, 0.0, 0.0)

    def __call__(self, table: Table, truth: Truth) -> None:
        """Change the noise-free columns in place."""
        turned = stacked(table, self.sensor) @ Rotation.from_rotvec(self.misalignment).as_matrix().T
        measured = (1.0 + np.asarray(self.scale)) * turned + np.asarray(self.bias) + np.outer(truth.times, self.drift)
        table |= by_axis(self.sensor, "xyz", measured)


@dataclass(frozen=True)
class EncoderOffset:
    """The encoder of a joint records true + offset [rad]."""

    joint: str
    offset: float

    def __call__(self, table: Table, truth: Truth) -> None:
        """Change the noise-free columns in place."""
        table[f"position.{self.joint}"] += self.offset


@dataclass(frozen=True)
class ColouredNoise:
    """An Ornstein-Uhlenbeck process on each axis, beside the white noise."""

    sensor: str
    sigma: float
    correlation_time: float

    def __call__(self, table: Table, times: Array, generator: Generator) -> None:
        """Change the noisy columns in place."""
        decay = np.exp(-np.diff(times) / self.correlation_time)
        for axis in "xyz":
            kicks = self.sigma * generator.standard_normal(len(times))
            error = kicks.copy()
            for k, a in enumerate(decay):
                error[k + 1] = a * error[k] + np.sqrt(1.0 - a**2) * kicks[k + 1]
            table[f"{self.sensor}.{axis}"] += error


@dataclass(frozen=True)
class Outliers:
    """A fraction of the scalar samples is wrong by 10 to 20 sigma, either way."""

    sensor: str
    fraction: float
    sigma: float

    def __call__(self, table: Table, times: Array, generator: Generator) -> None:
        """Change the noisy columns in place."""
        for axis in "xyz":
            hit = generator.random(len(times)) < self.fraction
            error = generator.choice([-1.0, 1.0], len(times)) * generator.uniform(10.0, 20.0, len(times))
            table[f"{self.sensor}.{axis}"] += np.where(hit, self.sigma * error, 0.0)


@dataclass(frozen=True)
class Quantisation:
    """Samples are rounded to multiples of the step."""

    sensor: str
    step: float

    def __call__(self, table: Table, times: Array, generator: Generator) -> None:
        """Change the noisy columns in place."""
        for axis in "xyz":
            name = f"{self.sensor}.{axis}"
            table[name] = self.step * np.round(table[name] / self.step)


def _hide(**parts: Any) -> Options:
    return {"hidden": mj.Hidden(**parts)}


def no_gradient(draw: Generator, strength: float) -> Options:
    """Gravity gradient, which the model of the study lacks; a higher orbit makes it fainter."""
    return {"effects": (), "orbit": {"radius": float(1.0e7 * strength ** (-1.0 / 3.0))}}


def initial_rate(draw: Generator, strength: float) -> Options:
    """Rate at the start, which the study takes for zero."""
    return {"initial_rate": "zero", "manoeuvres": {"rate_spread": 6e-6 * strength}}


def wheel(draw: Generator, strength: float) -> Options:
    """Momentum of a wheel in the base."""
    position, momentum = triple(draw.uniform(-0.4, 0.4, 3)), direction(draw, 0.05 * strength)
    return _hide(rotor=mj.Rotor(triple(momentum), position)) | {"true": {"wheel-momentum": momentum}}


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
    vector = direction(draw, size * strength)
    return {"distort": VectorFault(sensor, **{kind: vector}), "true": {f"{sensor}-{kind}": vector}}


def misplaced(draw: Generator, strength: float) -> Options:
    """Accelerometer that is not where the study says."""
    return {"declared_offset": direction(draw, 0.006 * strength)}


def delay(sensor: str, size: float, draw: Generator, strength: float) -> Options:
    """Latency of a sensor."""
    name, late = f"{sensor.replace('encoder', 'joint')}-latency", size * strength
    return {"sensors": {f"{sensor}_delay": late}, "true": {name: np.array([late])}}


def encoder_offset(joint: str, size: float, draw: Generator, strength: float) -> Options:
    """Constant error of an encoder."""
    offset = float(draw.choice([-1.0, 1.0])) * size * strength
    return {"distort": EncoderOffset(joint, offset), "true": {f"encoder-offset:{joint}": np.array([offset])}}


def clock(sensor: str, size: float, draw: Generator, strength: float) -> Options:
    """Clock of a sensor that runs fast or slow: samples are stamped with the true time times (1 + rate)."""
    rate = float(draw.choice([-1.0, 1.0])) * size * strength

    def distort(table: Table, truth: Truth) -> None:
        for name in (f"{sensor}.{axis}" for axis in "xyz"):
            there = np.isfinite(table[name])
            spline = CubicSpline(truth.times[there], table[name][there])
            table[name] = np.where(there, spline(truth.times / (1.0 + rate)), np.nan)

    return {"distort": distort, "true": {f"{sensor}-clock": np.array([rate])}}


def turned_star_sensor(draw: Generator, strength: float) -> Options:
    """Star sensor that is mounted otherwise than stated, by a rotation vector in base axes."""
    vector = direction(draw, 5e-5 * strength)

    def distort(table: Table, truth: Truth) -> None:
        values = stacked(table, "attitude", "xyzw")
        there = np.isfinite(values[:, 0])
        values[there] = (Rotation.from_quat(values[there]) * Rotation.from_rotvec(vector)).as_quat()
        table |= by_axis("attitude", "xyzw", values)

    return {"distort": distort, "true": {"attitude-misalignment": vector}}


def changing_wheel(draw: Generator, strength: float) -> Options:
    """Wheel along z whose momentum goes up and down in straight lines, and is not recorded."""
    times = np.concatenate([[0.0], np.sort(draw.uniform(20.0, 130.0, 4)), [200.0]])
    levels = 0.02 * strength * draw.uniform(-1.0, 1.0, len(times))
    return _hide(fields=[mj.SpunWheel(np.array([0.0, 0.0, 1.0]), times, levels)])


def understated(sensor: str, size: float, draw: Generator, strength: float) -> Options:
    """Noise that is stronger than the study says."""
    name = f"{sensor}_sigma"
    return {"declared": {name: getattr(mj.Sensors(), name) / (1.0 + size * strength)}}


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
    """Panel that takes momentum from the base: a torque that appears at once and dies away."""
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
    return _moved(mj.Mover(body, triple(direction(draw)), 0.015 * strength, start))


def jumping_mass(draw: Generator, strength: float) -> Options:
    """Mass that moves within the base once in each recording, in a tenth of a second between two samples."""
    body = mj.Body(6.0, direction(draw, 0.4), 0.01 * np.eye(3))
    starts = 0.5 * draw.integers(60, 220, 3) + draw.uniform(0.05, 0.35, 3)
    travel = triple(direction(draw))
    return _moved(mj.Mover(body, travel, 0.3 * strength, float(starts[0]), JUMP, tuple(starts.tolist())))


def _moved(mover: mj.Mover) -> Options:
    return _hide(movers=[mover]) | {"true": {"mass-shift": mover.moments}}


def bias_jump(draw: Generator, strength: float, sensor: str = "rate", size: float = 4e-5) -> Options:
    """Bias of the rate sensor, or of the accelerometer, that jumps once."""
    jump, instant = direction(draw, size * strength), float(draw.uniform(40.0, 100.0))

    def distort(table: Table, truth: Truth) -> None:
        for axis, change in zip("xyz", jump, strict=True):
            table[f"{sensor}.{axis}"] += np.where(truth.times >= instant, change, 0.0)

    return {"distort": distort}


def curved_gyro(draw: Generator, strength: float) -> Options:
    """Rate sensor that errs by a multiple of the rate's square along each axis [s/rad]."""
    curvature = direction(draw, 0.1 * strength)

    def distort(table: Table, truth: Truth) -> None:
        for axis, size in zip("xyz", curvature, strict=True):
            table[f"rate.{axis}"] += size * table[f"rate.{axis}"] ** 2

    return {"distort": distort}


def backlash(joint: str, draw: Generator, strength: float) -> Options:
    """Gear of a joint with a gap: the encoder leads or trails by half of it [rad], by the sense of the motion.

    The change of sense takes about the time in which the joint moves slowly [rad/s].
    """
    gap, slow, name = 6e-4 * strength, 5e-4, f"position.{joint}"

    def distort(table: Table, truth: Truth) -> None:
        there = np.isfinite(table[name])
        speed = CubicSpline(truth.times[there], table[name][there])(truth.times, 1)
        table[name] = table[name] + 0.5 * gap * np.tanh(speed / slow)

    return {"distort": distort}


def wandering_torque(draw: Generator, strength: float) -> Options:
    """Torque that wanders at random with a memory of 15 s, fixed in orbit axes."""
    times = np.arange(0.0, 400.0, 5.0)
    decay = np.exp(-5.0 / 15.0)
    values = np.zeros((len(times), 3))
    for row in range(1, len(times)):
        values[row] = decay * values[row - 1] + np.sqrt(1.0 - decay**2) * draw.normal(size=3)
    history = CubicSpline(times, 4e-4 * strength * values)
    return _hide(fields=[mj.outer_torque(history)])
