"""Further cases of the campaign: events, satellites of wheels, fast telemetry, pairs, and what no candidate describes.

The effects outside are of the kinds that real spacecraft show and that are not in the catalogue. With strength 1 they
change the sensors by some 50 standard deviations that neither the base body nor the initial rates can imitate.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np

from studies.truth import mujoco as mj
from studies.truth import wheels
from studies.truth.bodies import SERVICER4
from studies.truth.hidden_causes import causes as hide
from studies.truth.hidden_causes.catalogue import CASES, Build, Case, hidden_case
from studies.truth.hidden_causes.causes import Generator, Options, direction, triple
from studies.truth.mujoco.study import Study
from studies.truth.numerics import Array, cross
from studies.truth.recordings import Table, Truth

# sensors of a 1 kHz inertial unit with encoders at 500 Hz, whose noise per root hertz is that of the others at 2 Hz
FAST = {"rate_period": 0.001, "accel_period": 0.001, "encoder_period": 0.002}
FAST_NOISE = {"rate_sigma": 1e-5 * 500.0**0.5, "accel_sigma": 1e-5 * 500.0**0.5, "encoder_sigma": 1e-6 * 250.0**0.5}
SHORT = {"count": 2, "duration": 70.0}


# events ---------------------------------------------------------------------------------------------------------------


def valve(draw: Generator, strength: float) -> Options:
    """Pulses of a valve: force and torque, period, width and first pulse drawn at random."""
    every, length = 0.5 * float(draw.integers(24, 60)), 0.5 * float(draw.integers(2, 9))
    torque, force = direction(draw, 4e-4 * strength * 4.0 / length), direction(draw, 2e-4 * strength)
    pushed = mj.pulses(torque, every=every, length=length, start=0.5 * float(draw.integers(4, 20)), force=force)
    return {"hidden": mj.Hidden(fields=[pushed])}


def kicks(draw: Generator, strength: float) -> Options:
    """One or two kicks in every recording, momentum and angular momentum each, within a quarter of a second."""
    fields = []
    for start in 0.5 * draw.choice(np.arange(60, 220), int(draw.integers(1, 3)), replace=False) + 0.25:
        torque, force = direction(draw, 2e-2 * strength), direction(draw, 2e-2 * strength)
        fields.append(mj.pulses(torque, every=np.inf, length=0.25, start=float(start), force=force))
    return {"hidden": mj.Hidden(fields=fields)}


# outside the catalogue ------------------------------------------------------------------------------------------------


def _by_axes(sensor: str, change: Callable[[Truth], Array]) -> Options:
    """Add a change (n, 3) to the columns of a sensor."""

    def distort(table: Table, truth: Truth) -> None:
        for axis, values in zip("xyz", change(truth).T, strict=True):
            table[f"{sensor}.{axis}"] += values

    return {"distort": distort}


def g_sensitive_gyro(draw: Generator, strength: float) -> Options:
    """Rate sensor that errs in proportion to the acceleration that it feels [rad/s per m/s2]."""
    matrix = 7e-3 * strength * draw.uniform(-1.0, 1.0, (3, 3))
    return _by_axes("rate", lambda truth: truth.accel @ matrix.T)


def warming_gyro(draw: Generator, strength: float) -> Options:
    """Rate sensor whose scale factors change in proportion to time as it warms up."""
    factor = direction(draw, 0.02 * strength)
    return _by_axes("rate", lambda truth: factor * truth.rate * (truth.times / truth.times[-1])[:, None])


def curved_accelerometer(draw: Generator, strength: float) -> Options:
    """Accelerometer that errs by a multiple of the acceleration's square along each axis [s2/m]."""
    curvature = direction(draw, 3.0 * strength)
    return _by_axes("accel", lambda truth: curvature * truth.accel**2)


def breathing_bias(draw: Generator, strength: float) -> Options:
    """Bias of the rate sensor that swings with the temperature."""
    vector, omega = direction(draw, 1e-5 * strength), 2.0 * np.pi / draw.uniform(35.0, 60.0)
    return _by_axes("rate", lambda truth: np.outer(np.sin(omega * truth.times + 0.4), vector))


def saturated_gyro(draw: Generator, strength: float) -> Options:
    """Rate sensor that cannot read beyond a limit, which a few samples of each axis exceed by up to so much [rad/s]."""
    beyond = 6e-5 * strength

    def distort(table: Table, truth: Truth) -> None:
        for axis in range(3):
            true = truth.rate[:, axis]
            table[f"rate.{'xyz'[axis]}"] += np.clip(true, true.min() + beyond, true.max() - beyond) - true

    return {"distort": distort}


def frozen_gyro(draw: Generator, strength: float) -> Options:
    """Rate sensor that repeats its last reading for a second or more, once in each recording."""
    start, length = float(draw.uniform(40.0, 90.0)), 1.0 + strength

    def distort(table: Table, truth: Truth) -> None:
        frozen = (truth.times >= start) & (truth.times < start + length)
        last = max(int(np.searchsorted(truth.times, start)) - 1, 0)
        for axis in range(3):
            table[f"rate.{'xyz'[axis]}"] += np.where(frozen, truth.rate[last, axis] - truth.rate[:, axis], 0.0)

    return {"distort": distort}


def eccentric_encoder(joint: str, draw: Generator, strength: float) -> Options:
    """Hide an encoder whose disk is off its centre, so that it errs by the sine of the angle."""
    size, phase, name = 2e-3 * strength, float(draw.uniform(0.0, 2.0 * np.pi)), f"position.{joint}"

    def distort(table: Table, truth: Truth) -> None:
        table[name] = table[name] + size * np.sin(2.0 * table[name] + phase)

    return {"distort": distort}


def rippled_encoder(joint: str, draw: Generator, strength: float) -> Options:
    """Hide an encoder that errs twelve times per turn, by the ripple of its gear or of its interpolation."""
    size, phase, name = 3e-4 * strength, float(draw.uniform(0.0, 2.0 * np.pi)), f"position.{joint}"

    def distort(table: Table, truth: Truth) -> None:
        table[name] = table[name] + size * np.sin(12.0 * table[name] + phase)

    return {"distort": distort}


def swinging_mass(draw: Generator, strength: float) -> Options:
    """Mass that a pump or a mechanism moves to and fro within the base, along a line, at a frequency of its own."""
    body = mj.Body(3.0, direction(draw, 0.4), 0.01 * np.eye(3))
    period = float(draw.uniform(25.0, 45.0))
    return {"hidden": mj.Hidden(movers=[Swinging(body, triple(direction(draw)), 0.02 * strength, 0.0, period)])}


@dataclass(frozen=True)
class Swinging(mj.Mover):
    """A body in the base that moves to and fro by `travel`; the duration is its period."""

    def motion(self, time: float) -> tuple[float, float, float]:
        """Position, speed and acceleration, all zero at the start but for the acceleration."""
        omega = 2.0 * np.pi / self.duration
        angle, size = omega * time, self.travel
        return size * (1.0 - np.cos(angle)), size * omega * np.sin(angle), size * omega**2 * np.cos(angle)


def creeping_mass(draw: Generator, strength: float) -> Options:
    """Mass that creeps through the base for as long as a recording takes, as propellant between two tanks does."""
    body = mj.Body(6.0, direction(draw, 0.4), 0.01 * np.eye(3))
    return {"hidden": mj.Hidden(movers=[mj.Mover(body, triple(direction(draw)), 0.25 * strength, 5.0, 130.0)])}


def quadratic_drag(draw: Generator, strength: float) -> Options:
    """Torque against the rate, in proportion to its square."""
    factor = 20.0 * strength * draw.uniform(0.5, 1.0, 3)
    return {"hidden": mj.Hidden(fields=[lambda time, attitude, rate: (np.zeros(3), -factor * np.abs(rate) * rate)])}


def coupled_drag(draw: Generator, strength: float) -> Options:
    """Torque against the rate, in proportion to its magnitude times a matrix: the axes brake each other."""
    matrix = np.diag(draw.uniform(0.5, 1.0, 3)) + 0.3 * draw.uniform(-1.0, 1.0, (3, 3))
    size = 20.0 * strength

    def brake(time: float, attitude: Array, rate: Array) -> tuple[Array, Array]:
        return np.zeros(3), -size * float(np.linalg.norm(rate)) * matrix @ rate

    return {"hidden": mj.Hidden(fields=[brake])}


def aligning_torque(draw: Generator, strength: float) -> Options:
    """Torque that turns an axis of the base towards a direction fixed in space, as a tether does."""
    own, there = direction(draw), direction(draw, 2e-4 * strength)
    return {"hidden": mj.Hidden(fields=[lambda time, attitude, rate: (np.zeros(3), cross(own, attitude.T @ there))])}


# satellites of wheels -------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class WheelCase:
    """A study of a satellite of wheels, and the answer."""

    name: str
    causes: tuple[str, ...]
    fault: Callable[[float], wheels.Fault]  # strength -> what is wrong with the first wheel
    slews: wheels.Slews = field(default_factory=lambda: wheels.Slews(duration=120.0))
    accept: tuple[str, ...] = ()

    @property
    def status(self) -> str:
        """What a verdict should say: "effect" or "adequate"."""
        return "effect" if self.causes else "adequate"

    def write(self, folder: str | Path, seed: int, strength: float = 1.0) -> Study:
        """Write the study; motions and noise follow from the seed and do not depend on the strength."""
        faults = {self.slews.wheels[0].name: self.fault(strength)}
        return Study(*wheels.write_slews(folder, np.random.default_rng(seed), slews=self.slews, faults=faults))

    def make(self, folder: str | Path, seed: int, strength: float = 1.0) -> Path:
        """Write the study and return its file."""
        return self.write(folder, seed, strength).file

    def amplitudes(self, seed: int, strength: float = 1.0) -> dict[str, Array]:
        """Return nothing: the faults are stated by other numbers than the amplitudes of the candidates."""
        return {}


NOISY = wheels.Slews(duration=120.0, speed_sigma=0.02)

WHEEL_CASES = (
    WheelCase("null, wheels", (), lambda strength: wheels.Fault()),
    WheelCase(
        "null, noisy tachometers", (), lambda strength: wheels.Fault(), wheels.Slews(duration=120.0, speed_sigma=0.02)
    ),
    WheelCase("wheel-inertia:wheel1", ("wheel-inertia:wheel1",), lambda s: wheels.Fault(inertia=1.0 + 1.5e-4 * s)),
    WheelCase("wheel-tilt:wheel1", ("wheel-tilt:wheel1",), lambda s: wheels.Fault(tilt=(7e-5 * s, -7e-5 * s))),
    WheelCase("wheel-latency:wheel1", ("wheel-latency:wheel1",), lambda s: wheels.Fault(delay=8e-4 * s)),
)


# all ------------------------------------------------------------------------------------------------------------------

_effect, _outside = partial(hidden_case, status="effect"), partial(hidden_case, status="unknown")
_null = partial(hidden_case, status="adequate")
_by_name = {case.name: case for case in CASES}


def _inside(name: str, cause: str, accept: tuple[str, ...] = ()) -> Case:
    """Return a former outside case, whose cause has become a candidate."""
    return replace(_by_name[name], name=f"{name}, listed", status="effect", causes=(cause,), accept=accept, frame=None)


def _fast(case: Case) -> Case:
    """Return a case in the telemetry of a 1 kHz inertial unit."""
    fixed = {**case.fixed, "sensors": {**FAST, **FAST_NOISE}, "manoeuvres": SHORT, "latitudes": [0.4, 2.9]}
    builds = tuple(partial(_stronger, build) for build in case.builds)
    return replace(case, name=f"{case.name} at 1 kHz", builds=builds, fixed={**fixed, "flown": 0.05})


def _stronger(build: Build, draw: Generator, strength: float) -> Options:
    """Hide a cause with three times its strength, since the recordings are shorter and fewer."""
    return build(draw, 3.0 * strength)


FURTHER_CASES: tuple[Case | WheelCase, ...] = (
    _effect("thruster-pulses", valve),
    _effect("kicks", kicks, urdf=SERVICER4),
    _inside("thermal-snap", "thermal-snap"),
    _inside("bias-jump", "rate-bias-jump"),
    _inside("shifting-mass", "mass-shift"),
    _inside("backlash", "joint-backlash:joint2"),
    _effect("accel-bias-jump", partial(hide.bias_jump, sensor="accel", size=1.5e-5), urdf=SERVICER4),
    _effect("thruster-pulses, wheel-momentum", valve, hide.wheel),
    _effect("kicks, accel-bias", kicks, partial(hide.vector_fault, "accel", "bias", 8e-6)),
    _effect("thermal-snap, thruster-leak", hide.thermal_snap, hide.leak, urdf=SERVICER4),
    _effect("rate-bias-jump, flexible-appendage", hide.bias_jump, hide.panel),
    *WHEEL_CASES,
    *(_fast(_by_name[name]) for name in ("null, three joints", "wheel-momentum", "thruster-leak", "payload:link3")),
    _outside("g-sensitive-gyro", g_sensitive_gyro),
    _outside("curved-accelerometer", curved_accelerometer, urdf=SERVICER4),
    _outside("breathing-bias", breathing_bias),
    _outside("saturated-gyro", saturated_gyro, urdf=SERVICER4),
    _outside("frozen-gyro", frozen_gyro),
    _outside("eccentric-encoder", partial(eccentric_encoder, "joint2"), urdf=SERVICER4),
    _outside("swinging-mass", swinging_mass),
    _outside("creeping-mass", creeping_mass, urdf=SERVICER4),
    _outside("quadratic-drag", quadratic_drag, frame="base"),
    _outside("aligning-torque", aligning_torque, urdf=SERVICER4, frame="orbit"),
    _outside("warming-gyro", warming_gyro),
    _outside("rippled-encoder", partial(rippled_encoder, "joint2"), urdf=SERVICER4),
    _outside("coupled-drag", coupled_drag, frame="base"),
)

NOW_LISTED = ("pulse-train", "thermal-snap", "shifting-mass", "bias-jump", "backlash")
"""Cases outside the catalogue of the second release, whose causes are candidates by now."""
