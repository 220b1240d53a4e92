"""Studies with something hidden in their data, for every name of the catalogue, for pairs, outside effects and nulls.

Physical causes are bodies, springs and fields of tests/mujoco_truth.py; this file adds the faults of sensors and the
table `CASES`. Nothing here shares code with the package. The sensor sees

    measured = (1 + scale) * (rotation(misalignment) * true(t - latency)) + bias + drift * t

and a joint's encoder records true + offset. With strength 1 most causes change the sensors by 20 to 60 standard
deviations that neither the base body nor the initial rates can imitate; that number grows in proportion to `strength`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from tests import mujoco_truth as mj

Array = NDArray[np.float64]
Table = dict[str, Array]
Generator = np.random.Generator
Options = dict[str, Any]
"""Keywords of `mujoco_truth.write_study`."""

ROBOTS = Path(__file__).resolve().parent / "robots"
SERVICER3, SERVICER4, BRANCHED = (ROBOTS / f"{name}.urdf" for name in ("servicer3", "servicer4", "branched"))


# Faults of sensors ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class VectorFault:
    """Constant errors of the rate sensor or the accelerometer, one number per axis, in the sensor's units.

    Each is (3,): bias, drift [1/s], scale [1], and the rotation vector `misalignment` [rad].
    """

    sensor: str
    bias: ArrayLike = (0.0, 0.0, 0.0)
    drift: ArrayLike = (0.0, 0.0, 0.0)
    scale: ArrayLike = (0.0, 0.0, 0.0)
    misalignment: ArrayLike = (0.0, 0.0, 0.0)

    def __call__(self, table: Table, truth: mj.Truth) -> None:
        names = [f"{self.sensor}.{axis}" for axis in "xyz"]
        turned = (
            np.stack([table[name] for name in names], axis=1) @ Rotation.from_rotvec(self.misalignment).as_matrix().T
        )
        measured = (1.0 + np.asarray(self.scale)) * turned + self.bias + np.outer(truth.times, self.drift)
        table.update(zip(names, measured.T.copy(), strict=True))


@dataclass(frozen=True)
class EncoderOffset:
    """The encoder of a joint records true + offset [rad]."""

    joint: str
    offset: float

    def __call__(self, table: Table, truth: mj.Truth) -> None:
        table[f"position.{self.joint}"] += self.offset


@dataclass(frozen=True)
class ColouredNoise:
    """An Ornstein-Uhlenbeck process on each axis, beside the white noise."""

    sensor: str
    sigma: float
    correlation_time: float

    def __call__(self, table: Table, times: Array, generator: Generator) -> None:
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
        for axis in "xyz":
            name = f"{self.sensor}.{axis}"
            table[name] = self.step * np.round(table[name] / self.step)


# Studies --------------------------------------------------------------------------------------------------------------


Build = Callable[[Generator, float], Options]


@dataclass(frozen=True)
class Case:
    """A study that can be written, and the answer.

    Parameters
    ----------
    name : str
    causes : tuple of str
        The contract's names for what is hidden; empty for nulls and for outside effects.
    status : str
        "effect", "adequate" or "unknown" (outside the catalogue).
    builds : tuple of callable
        (draw, strength) -> keywords of `mujoco_truth.write_study`, one for each thing hidden.
    urdf : path
    fixed : dict
        Further keywords.
    accept : tuple of str
        Names that are as right as one of the causes, since they change the model alike.
    frame : str, optional
        Axes in which an outside wrench is fixed; "orbit" are those of each recording's start.
    """

    name: str
    causes: tuple[str, ...]
    status: str
    builds: tuple[Build, ...]
    urdf: Path
    fixed: Options
    accept: tuple[str, ...] = ()
    frame: str | None = None

    def write(self, folder: str | Path, seed: int, strength: float = 1.0) -> mj.Study:
        """Write the study; the same seed draws the same circumstances, motions and noise whatever the strength."""
        return _write(self.urdf, self._causes(seed, strength), self.fixed, folder, seed)

    def make(self, folder: str | Path, seed: int, strength: float = 1.0) -> Path:
        """Write the study and return its file."""
        return self.write(folder, seed, strength).file

    def amplitudes(self, seed: int, strength: float = 1.0) -> dict[str, Array]:
        """Return the true sizes of what is hidden, by cause, for causes that are a vector or a number."""
        found: dict[str, Array] = {}
        for options in self._causes(seed, strength):
            rotor = options["hidden"].rotor if "hidden" in options else None
            if rotor is not None:
                found["wheel-momentum"] = np.asarray(rotor.momentum)
            fault = options.get("distort")
            if isinstance(fault, VectorFault):
                sizes = {key: np.asarray(value) for key, value in vars(fault).items() if key != "sensor"}
                found |= {f"{fault.sensor}-{key}": value for key, value in sizes.items() if value.any()}
            if isinstance(fault, EncoderOffset):
                found[f"encoder-offset:{fault.joint}"] = np.array([fault.offset])
            for key, value in options.get("sensors", {}).items():
                name = key.removesuffix("_delay").replace("encoder", "joint")
                found[f"{name}-latency"] = np.array([value])
        return found

    def torque(self, seed: int, strength: float, truth: mj.Truth) -> Array:
        """Return the torque of hidden fields along a motion, base axes, (n, 3) [N m]."""
        fields = [field for options in self._causes(seed, strength) for field in options["hidden"].fields]
        turns = Rotation.from_quat(truth.attitude).as_matrix()
        rows = zip(truth.times, turns, truth.rate, strict=True)
        return np.array([sum((field(*row)[1] for field in fields), np.zeros(3)) for row in rows])

    def _causes(self, seed: int, strength: float) -> list[Options]:
        return [build(np.random.default_rng([seed, 2 + i]), strength) for i, build in enumerate(self.builds)]


def direction(draw: Generator, size: float = 1.0) -> Array:
    """Draw a vector of given length, no component near zero."""
    vector = draw.choice([-1.0, 1.0], 3) * draw.uniform(0.5, 1.0, 3)
    return size * vector / np.linalg.norm(vector)


def circumstances(draw: Generator, count: int = 3) -> Options:
    """Draw what differs from study to study whatever is hidden: orbit, places on it, manoeuvres, sensors."""
    sun = direction(draw)
    orbit = mj.Orbit(
        radius=float(draw.uniform(6.75e6, 7.1e6)), inclination=float(draw.uniform(0.6, 1.6)), sun=tuple(sun.tolist())
    )
    return {
        "orbit": orbit,
        "latitudes": draw.uniform(0.0, 2.0 * np.pi, count).tolist(),
        "manoeuvres": mj.Manoeuvres(count=count, duration=float(draw.choice([140.0, 150.0, 160.0]))),
        "sensors": mj.Sensors(accel_position=tuple(np.round(direction(draw, 0.4), 3).tolist())),
        "step": 0.25,
    }


def link_body(urdf: Path, name: str) -> mj.Body:
    """Inertial parameters of a link as its URDF has them."""
    links = ElementTree.parse(urdf).getroot().iterfind("link")
    return next(mj.read_body(link) for link in links if link.get("name") == name)


def merge(first: Options, second: Options) -> Options:
    """Join the keywords of two causes; what both hide in the robot or in the sensors acts together."""
    merged = {**first, **second}
    if "hidden" in first and "hidden" in second:
        mine, other, nothing = vars(first["hidden"]), vars(second["hidden"]), vars(mj.Hidden())
        merged["hidden"] = mj.Hidden(**{k: other[k] if other[k] != nothing[k] else mine[k] for k in mine})
    if "distort" in first and "distort" in second:
        merged["distort"] = in_turn(first["distort"], second["distort"])
    if "step" in first and "step" in second:
        merged["step"] = min(first["step"], second["step"])
    return merged


def in_turn(*distortions: mj.Distortion) -> mj.Distortion:
    """Apply distortions one after the other."""

    def both(table: Table, truth: mj.Truth) -> None:
        for distortion in distortions:
            distortion(table, truth)

    return both


def _write(urdf: Path, builds: Sequence[Options], fixed: Options, folder: str | Path, seed: int) -> mj.Study:
    options = circumstances(np.random.default_rng([seed, 1]))
    causes: Options = {}
    for build in builds:
        causes = merge(causes, build)
    for changes in (fixed, causes):
        for key, value in changes.items():
            # a mapping changes some fields of what the circumstances are
            options[key] = replace(options[key], **value) if isinstance(value, dict) and key in options else value
    # the study may declare its sensors otherwise than they are
    declared = options.pop("declared", None)
    if declared is not None:
        options["declared"] = replace(options["sensors"], **declared)
    if "declared_offset" in options:
        options["declared_accel_position"] = np.add(options["sensors"].accel_position, options.pop("declared_offset"))
    return mj.write_study(folder, urdf, np.random.default_rng(seed), title="Free-flyer", **options)


# Causes: (draw, strength) -> keywords of write_study ------------------------------------------------------------------


def _hide(**parts: Any) -> Options:
    return {"hidden": mj.Hidden(**parts)}


def no_gradient(draw: Generator, strength: float) -> Options:
    # the gradient's size is physics: a higher orbit makes it fainter
    return {"effects": (), "orbit": {"radius": float(1.0e7 * strength ** (-1.0 / 3.0))}}


def initial_rate(draw: Generator, strength: float) -> Options:
    return {"initial_rate": "zero", "manoeuvres": {"rate_spread": 6e-6 * strength}}


def wheel(draw: Generator, strength: float) -> Options:
    position = tuple(draw.uniform(-0.4, 0.4, 3).tolist())
    return _hide(rotor=mj.Rotor(tuple(direction(draw, 0.05 * strength).tolist()), position))


def air(draw: Generator, strength: float) -> Options:
    return _hide(environment=[partial(mj.drag, force=2e-4 * strength, cp=direction(draw, 0.6))])


def light(draw: Generator, strength: float) -> Options:
    return _hide(environment=[partial(mj.sunlight, force=1.2e-4 * strength, cp=direction(draw, 0.6))])


def magnet(draw: Generator, strength: float) -> Options:
    return _hide(environment=[partial(mj.magnet, moment=direction(draw, 3.0 * strength))])


def leak(draw: Generator, strength: float) -> Options:
    return _hide(fields=[mj.leak(direction(draw, 2e-4 * strength), direction(draw, 1e-4 * strength))])


def braking(draw: Generator, strength: float) -> Options:
    return _hide(fields=[mj.braking(0.05 * strength * draw.uniform(0.5, 1.0, 3))])


def panel(draw: Generator, strength: float) -> Options:
    anchor, hinge = (
        [[0.0, 0.8, 0.1], [0.0, -0.8, -0.2]][draw.integers(2)],
        [[1.0, 0.0, 0.2], [0.6, 0.0, 0.8]][draw.integers(2)],
    )
    frequency = float(draw.uniform(0.28, 0.34))
    return _hide(appendages=[mj.panel(4.5 * strength, (2.0, 0.8), anchor, hinge, frequency)]) | {"step": 0.125}


def fuel(draw: Generator, strength: float) -> Options:
    position = direction(draw, 0.7)
    return _hide(appendages=[mj.slosh(6.0 * strength, position, float(draw.uniform(0.24, 0.3)))]) | {"step": 0.125}


def payload(link: str, urdf: Path, mass: float, com: ArrayLike, draw: Generator, strength: float) -> Options:
    where = np.asarray(com) + 0.03 * direction(draw)
    added = mj.Body(mass * strength, where, mass * strength * np.diag([0.004, 0.005, 0.006]))
    return _hide(changed={link: mj.join(link_body(urdf, link), added)})


def wrong_cad(link: str, urdf: Path, spread: float, draw: Generator, strength: float) -> Options:
    return _hide(changed={link: mj.wrong_guess(link_body(urdf, link), draw, spread * strength)})


def soft_joint(joint: str, frequency: float, draw: Generator, strength: float) -> Options:
    # the deflection goes with 1 / frequency^2
    frequency = float(frequency * draw.uniform(0.95, 1.05) / np.sqrt(strength))
    return _hide(flexible=[mj.Flexibility(joint, frequency)]) | {"step": min(0.25, 0.06 / frequency)}


def vector_fault(sensor: str, kind: str, size: float, draw: Generator, strength: float) -> Options:
    return {"distort": VectorFault(sensor, **{kind: direction(draw, size * strength)})}


def misplaced(draw: Generator, strength: float) -> Options:
    return {"declared_offset": direction(draw, 0.006 * strength)}


def delay(sensor: str, size: float, draw: Generator, strength: float) -> Options:
    return {"sensors": {f"{sensor}_delay": size * strength}}


def encoder_offset(joint: str, size: float, draw: Generator, strength: float) -> Options:
    return {"distort": EncoderOffset(joint, float(draw.choice([-1.0, 1.0])) * size * strength)}


def understated(sensor: str, draw: Generator, strength: float) -> Options:
    return {"declared": {f"{sensor}_sigma": 1e-5 / (1.0 + 0.35 * strength)}}


def coloured(sensor: str, draw: Generator, strength: float) -> Options:
    return {"spoil": ColouredNoise(sensor, 7e-6 * strength, float(draw.uniform(3.0, 6.0)))}


def outliers(sensor: str, draw: Generator, strength: float) -> Options:
    return {"spoil": Outliers(sensor, 0.005 * strength, 1e-5)}


def rounded(sensor: str, draw: Generator, strength: float) -> Options:
    return {"spoil": Quantisation(sensor, 4e-5 * strength)}


# Outside the catalogue ------------------------------------------------------------------------------------------------


def pulse_train(draw: Generator, strength: float) -> Options:
    return _hide(fields=[mj.pulses(direction(draw, 4e-4 * strength), every=20.0, length=4.0, start=7.0)])


def thermal_snap(draw: Generator, strength: float) -> Options:
    start = float(draw.integers(50, 80))
    return _hide(fields=[mj.snap(direction(draw, 2.5e-3 * strength), start=start, decay=4.0)])


def growing_torque(draw: Generator, strength: float) -> Options:
    vector = direction(draw, 1e-6 * strength)
    return _hide(fields=[mj.outer_torque(lambda time: time * vector)])


def swinging_torque(draw: Generator, strength: float) -> Options:
    vector, omega = direction(draw, 1e-3 * strength), 2.0 * np.pi * draw.uniform(0.025, 0.035)
    return _hide(fields=[mj.outer_torque(lambda time: vector * np.sin(omega * time + 0.7))])


def shifting_mass(draw: Generator, strength: float) -> Options:
    body = mj.Body(3.0, direction(draw, 0.4), 0.01 * np.eye(3))
    start = float(draw.integers(60, 80))
    return _hide(movers=[mj.Mover(body, tuple(direction(draw).tolist()), 0.015 * strength, start)]) | {"step": 0.125}


# The table ------------------------------------------------------------------------------------------------------------


def _case(
    name: str,
    causes: Sequence[str],
    *builds: Build,
    urdf: Path = SERVICER3,
    accept: Sequence[str] = (),
    status: str = "effect",
    frame: str | None = None,
    **fixed: Any,
) -> Case:
    others = tuple(other for other in accept if other not in causes)
    return Case(name, tuple(causes), status, builds, urdf, fixed, others, frame)


def _effect(name: str, build: Build, **options: Any) -> Case:
    return _case(name, [name], build, **options)


def _outside(name: str, build: Build, **options: Any) -> Case:
    return _case(name, [], build, status="unknown", **options)


def _null(name: str, **options: Any) -> Case:
    return _case(name, [], status="adequate", **options)


LATENCIES = ("rate-latency", "accel-latency", "joint-latency")
HAND4 = ("payload:link4", "link-inertia:link4", "payload:tip", "link-inertia:tip")
HAND3 = ("payload:link3", "link-inertia:link3")

_payload3 = partial(payload, "link3", SERVICER3, 0.08, [0.7, 0.05, 0.03])
_payload4 = partial(payload, "link4", SERVICER4, 0.06, [0.1, 0.05, 0.2])

CASES: tuple[Case, ...] = (
    _effect("gravity-gradient", no_gradient),
    _effect("initial-rate", initial_rate, urdf=SERVICER4),
    _effect("wheel-momentum", wheel),
    _effect("aerodynamic-drag", air, urdf=SERVICER4),
    _effect("solar-pressure", light),
    _effect("magnetic-dipole", magnet, urdf=SERVICER4),
    _effect("thruster-leak", leak),
    _effect("rotational-drag", braking, urdf=SERVICER4),
    _effect("flexible-appendage", panel),
    _effect("fuel-slosh", fuel, urdf=SERVICER4),
    _effect("payload:link3", _payload3, accept=HAND3),
    _effect("payload:link4", _payload4, urdf=SERVICER4, accept=HAND4),
    _effect("link-inertia:link3", partial(wrong_cad, "link3", SERVICER4, 0.015), urdf=SERVICER4, accept=HAND3),
    _effect(
        "link-inertia:link2",
        partial(wrong_cad, "link2", SERVICER3, 0.012),
        accept=("payload:link2", "link-inertia:link2"),
    ),
    _effect("joint-flexibility:joint2", partial(soft_joint, "joint2", 0.9)),
    _effect("joint-flexibility:joint3", partial(soft_joint, "joint3", 1.0), urdf=SERVICER4),
    _effect("rate-bias", partial(vector_fault, "rate", "bias", 3e-4)),
    _effect("rate-drift", partial(vector_fault, "rate", "drift", 2e-7), urdf=SERVICER4),
    _effect("rate-scale", partial(vector_fault, "rate", "scale", 2.2e-2)),
    _effect("rate-misalignment", partial(vector_fault, "rate", "misalignment", 1.2e-3), urdf=SERVICER4),
    _effect("accel-bias", partial(vector_fault, "accel", "bias", 8e-6)),
    _effect("accel-drift", partial(vector_fault, "accel", "drift", 1e-7), urdf=SERVICER4),
    _effect("accel-scale", partial(vector_fault, "accel", "scale", 2e-2)),
    _effect("accel-misalignment", partial(vector_fault, "accel", "misalignment", 7e-3), urdf=SERVICER4),
    _effect("accel-position", misplaced),
    _effect("rate-latency", partial(delay, "rate", 0.006), accept=LATENCIES),
    _effect("accel-latency", partial(delay, "accel", 0.012), urdf=SERVICER4, accept=LATENCIES),
    _effect("joint-latency", partial(delay, "encoder", 0.006), accept=LATENCIES),
    _effect("encoder-offset:joint2", partial(encoder_offset, "joint2", 2e-3)),
    _effect("encoder-offset:joint3", partial(encoder_offset, "joint3", 4e-3), urdf=SERVICER4),
    _effect("rate-noise", partial(understated, "rate")),
    _effect("accel-noise", partial(understated, "accel"), urdf=SERVICER4),
    _effect("coloured-noise:rate", partial(coloured, "rate")),
    _effect("coloured-noise:accel", partial(coloured, "accel"), urdf=SERVICER4),
    _effect("outliers:rate", partial(outliers, "rate"), urdf=SERVICER4),
    _effect("outliers:accel", partial(outliers, "accel")),
    _effect("quantisation:rate", partial(rounded, "rate")),
    _effect("quantisation:accel", partial(rounded, "accel"), urdf=SERVICER4),
    _case(
        "wheel-momentum, accel-bias",
        ["wheel-momentum", "accel-bias"],
        wheel,
        partial(vector_fault, "accel", "bias", 8e-6),
    ),
    _case(
        "payload:link4, rate-drift",
        ["payload:link4", "rate-drift"],
        _payload4,
        partial(vector_fault, "rate", "drift", 2e-7),
        urdf=SERVICER4,
        accept=HAND4,
    ),
    _case(
        "payload:link3, rate-bias",
        ["payload:link3", "rate-bias"],
        _payload3,
        partial(vector_fault, "rate", "bias", 3e-4),
        accept=HAND3,
    ),
    _case(
        "thruster-leak, accel-scale",
        ["thruster-leak", "accel-scale"],
        leak,
        partial(vector_fault, "accel", "scale", 2e-2),
    ),
    _outside("pulse-train", pulse_train, frame="base"),
    _outside("thermal-snap", thermal_snap, urdf=SERVICER4, frame="base"),
    _outside("growing-torque", growing_torque, frame="orbit"),
    _outside("swinging-torque", swinging_torque, urdf=SERVICER4, frame="orbit"),
    _outside("shifting-mass", shifting_mass),
    _null("null, three joints"),
    _null("null, four joints, own sampling rates", urdf=SERVICER4, sensors={"rate_period": 1.0, "accel_period": 0.25}),
    _null(
        "null, gaps",
        gaps={"rate": [(40.0, 52.0)], "accel": [(70.0, 80.0), (100.0, 101.0)], "position.joint2": [(60.0, 61.5)]},
    ),
    _null("null, coarse encoder", urdf=SERVICER4, sensors={"encoder_sigma": 2e-5}),
    _null("null, uncertain arm", link_spread=0.02),
    _null("null, star sensor", urdf=SERVICER4, sensors={"rate_period": None, "attitude_period": 0.5}),
    _null("null, laboratory", orbit=None, latitudes=None),
    _null("null, slides and branches", urdf=BRANCHED, manoeuvres={"frequencies": (0.015, 0.03), "duration": 170.0}),
    _null("null, eccentric orbit", orbit={"eccentricity": 0.05, "argument_of_perigee": 1.0, "radius": 7.3e6}),
    _null("null, fast tumble", urdf=SERVICER4, manoeuvres={"rate_spread": 4e-3, "duration": 120.0}),
)
"""One case for each name of the catalogue at least, then pairs, outside effects, nulls."""
