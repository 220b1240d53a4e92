"""Cases: studies that hide something, and the answer; at least one for each name of the contract.

With strength 1 most causes change the sensors by 20 to 60 standard deviations that neither the base body nor the
initial rates can imitate; that number grows in proportion to the strength.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from studies.truth.bodies import BRANCHED, SERVICER3, SERVICER4
from studies.truth.hidden_causes import causes as hide
from studies.truth.hidden_causes.causes import Generator, Options, direction, merge, triple
from studies.truth.motions import Manoeuvres
from studies.truth.mujoco.study import Study, write_study
from studies.truth.numerics import Array
from studies.truth.orbit import Orbit
from studies.truth.recordings import Sensors, Truth

Build = Callable[[Generator, float], Options]  # source of random numbers and strength -> keywords that hide one thing


@dataclass(frozen=True)
class Case:
    """A study that can be written, and the answer."""

    name: str
    causes: tuple[str, ...]  # the contract's names for what is hidden; empty for nulls and for outside effects
    status: str  # "effect", "adequate" or "unknown" (outside the catalogue)
    builds: tuple[Build, ...]  # (draw, strength) -> keywords of `write_study`, one for each thing hidden
    urdf: Path
    fixed: Options  # further keywords
    # names that are as right as one of the causes, since they change the model alike; outside the catalogue, causes
    # that come as close as unknown
    accept: tuple[str, ...] = ()
    frame: str | None = None  # axes in which an outside wrench is fixed; "orbit" are those of each recording's start

    def write(self, folder: str | Path, seed: int, strength: float = 1.0) -> Study:
        """Write the study; circumstances, motions and noise follow from the seed and do not depend on the strength."""
        options = circumstances(np.random.default_rng([seed, 1]))
        causes: Options = {}
        for cause in self._causes(seed, strength):
            causes = merge(causes, cause)
        causes.pop("true", None)
        for changes in (self.fixed, causes):
            for key, value in changes.items():
                # a mapping changes some fields of what the circumstances are
                options[key] = replace(options[key], **value) if isinstance(value, dict) and key in options else value
        # the study may declare its sensors otherwise than they are
        if "declared" in options:
            options["declared"] = replace(options["sensors"], **options["declared"])
        if "declared_offset" in options:
            true = options["sensors"].accel_position
            options["declared_accel_position"] = np.add(true, options.pop("declared_offset"))
        return write_study(folder, self.urdf, np.random.default_rng(seed), title="Free-flyer", **options)

    def make(self, folder: str | Path, seed: int, strength: float = 1.0) -> Path:
        """Write the study and return its file."""
        return self.write(folder, seed, strength).file

    def amplitudes(self, seed: int, strength: float = 1.0) -> dict[str, Array]:
        """Magnitudes of what is hidden, by cause, for causes that are a vector or a number."""
        true: dict[str, Array] = {}
        for options in self._causes(seed, strength):
            true |= options.get("true", {})
        return true

    def torque(self, seed: int, strength: float, truth: Truth) -> Array:
        """Torque of hidden fields along a motion, base axes, (n, 3) [N m]."""
        fields = [field for options in self._causes(seed, strength) for field in options["hidden"].fields]
        turns = Rotation.from_quat(truth.attitude).as_matrix()
        rows = zip(truth.times, turns, truth.rate, strict=True)
        return np.array([sum((field(*row)[1] for field in fields), np.zeros(3)) for row in rows])

    def _causes(self, seed: int, strength: float) -> list[Options]:
        return [build(np.random.default_rng([seed, 2 + i]), strength) for i, build in enumerate(self.builds)]


def circumstances(draw: Generator, count: int = 3) -> Options:
    """Orbit, places on it, manoeuvres and sensors of a study, drawn at random; they do not depend on what is hidden."""
    sun = triple(direction(draw))
    orbit = Orbit(radius=float(draw.uniform(6.75e6, 7.1e6)), inclination=float(draw.uniform(0.6, 1.6)), sun=sun)
    return {
        "orbit": orbit,
        "latitudes": draw.uniform(0.0, 2.0 * np.pi, count).tolist(),
        "manoeuvres": Manoeuvres(count=count, duration=float(draw.choice([140.0, 150.0, 160.0]))),
        "sensors": Sensors(accel_position=triple(np.round(direction(draw, 0.4), 3))),
        "step": 0.25,
    }


def hidden_case(
    name: str,
    *builds: Build,
    urdf: Path = SERVICER3,
    accept: Sequence[str] = (),
    status: str = "effect",
    frame: str | None = None,
    **fixed: Any,
) -> Case:
    """Return a case in which the builds act together; that of an effect is named after its causes."""
    causes = tuple(name.split(", ")) if status == "effect" else ()
    return Case(name, causes, status, builds, urdf, fixed, tuple(a for a in accept if a not in causes), frame)


_outside, _null = partial(hidden_case, status="unknown"), partial(hidden_case, status="adequate")


def _vector(sensor: str, kind: str, size: float) -> Build:
    return partial(hide.vector_fault, sensor, kind, size)


LATENCIES = ("rate-latency", "accel-latency", "joint-latency")
HAND4 = ("payload:link4", "link-inertia:link4", "payload:tip", "link-inertia:tip")
HAND3 = ("payload:link3", "link-inertia:link3")
STAR_SENSOR = {"rate_period": None, "attitude_period": 0.5}

_payload3 = partial(hide.payload, "link3", SERVICER3, 0.08, [0.7, 0.05, 0.03])
_payload4 = partial(hide.payload, "link4", SERVICER4, 0.06, [0.1, 0.05, 0.2])

# at least one case for each name of the catalogue, then pairs, outside effects, nulls
CASES: tuple[Case, ...] = (
    hidden_case("gravity-gradient", hide.no_gradient),
    hidden_case("initial-rate", hide.initial_rate, urdf=SERVICER4),
    hidden_case("wheel-momentum", hide.wheel),
    hidden_case("aerodynamic-drag", hide.air, urdf=SERVICER4),
    hidden_case("solar-pressure", hide.light),
    hidden_case("magnetic-dipole", hide.magnet, urdf=SERVICER4),
    hidden_case("thruster-leak", hide.leak),
    hidden_case("rotational-drag", hide.braking, urdf=SERVICER4),
    hidden_case("flexible-appendage", hide.panel),
    hidden_case("fuel-slosh", hide.fuel, urdf=SERVICER4),
    hidden_case("payload:link3", _payload3, accept=HAND3),
    hidden_case("payload:link4", _payload4, urdf=SERVICER4, accept=HAND4),
    hidden_case("link-inertia:link3", partial(hide.wrong_cad, "link3", SERVICER4, 0.015), urdf=SERVICER4, accept=HAND3),
    hidden_case("link-inertia:link2", partial(hide.wrong_cad, "link2", SERVICER3, 0.012), accept=["payload:link2"]),
    hidden_case("joint-flexibility:joint2", partial(hide.soft_joint, "joint2", 0.9)),
    hidden_case("joint-flexibility:joint3", partial(hide.soft_joint, "joint3", 1.0), urdf=SERVICER4),
    hidden_case("rate-bias", _vector("rate", "bias", 3e-4)),
    hidden_case("rate-drift", _vector("rate", "drift", 2e-7), urdf=SERVICER4),
    hidden_case("rate-scale", _vector("rate", "scale", 2.2e-2)),
    hidden_case("rate-misalignment", _vector("rate", "misalignment", 1.2e-3), urdf=SERVICER4),
    hidden_case("accel-bias", _vector("accel", "bias", 8e-6)),
    hidden_case("accel-drift", _vector("accel", "drift", 1e-7), urdf=SERVICER4),
    hidden_case("accel-scale", _vector("accel", "scale", 2e-2)),
    hidden_case("accel-misalignment", _vector("accel", "misalignment", 7e-3), urdf=SERVICER4),
    hidden_case("accel-position", hide.misplaced),
    hidden_case("rate-latency", partial(hide.delay, "rate", 0.006), accept=LATENCIES),
    hidden_case("accel-latency", partial(hide.delay, "accel", 0.012), urdf=SERVICER4, accept=LATENCIES),
    hidden_case("joint-latency", partial(hide.delay, "encoder", 0.006), accept=LATENCIES),
    hidden_case("encoder-offset:joint2", partial(hide.encoder_offset, "joint2", 2e-3)),
    hidden_case("encoder-offset:joint3", partial(hide.encoder_offset, "joint3", 4e-3), urdf=SERVICER4),
    hidden_case("rate-noise", partial(hide.understated, "rate", 0.35)),
    hidden_case("accel-noise", partial(hide.understated, "accel", 0.35), urdf=SERVICER4),
    hidden_case("coloured-noise:rate", partial(hide.coloured, "rate")),
    hidden_case("coloured-noise:accel", partial(hide.coloured, "accel"), urdf=SERVICER4),
    hidden_case("outliers:rate", partial(hide.outliers, "rate"), urdf=SERVICER4),
    hidden_case("outliers:accel", partial(hide.outliers, "accel")),
    hidden_case("quantisation:rate", partial(hide.rounded, "rate")),
    hidden_case("quantisation:accel", partial(hide.rounded, "accel"), urdf=SERVICER4),
    hidden_case("encoder-noise", partial(hide.understated, "encoder", 1.5), urdf=SERVICER4),
    hidden_case("rate-clock", partial(hide.clock, "rate", 5e-5)),
    hidden_case("accel-clock", partial(hide.clock, "accel", 1e-4), urdf=SERVICER4),
    hidden_case("attitude-misalignment", hide.turned_star_sensor, urdf=SERVICER4, sensors=STAR_SENSOR),
    hidden_case("wheel-history:z", hide.changing_wheel),
    hidden_case("mass-shift", hide.jumping_mass),
    hidden_case("wheel-momentum, accel-bias", hide.wheel, _vector("accel", "bias", 8e-6)),
    hidden_case("payload:link4, rate-drift", _payload4, _vector("rate", "drift", 2e-7), urdf=SERVICER4, accept=HAND4),
    hidden_case("payload:link3, rate-bias", _payload3, _vector("rate", "bias", 3e-4), accept=HAND3),
    hidden_case("thruster-leak, accel-scale", hide.leak, _vector("accel", "scale", 2e-2)),
    hidden_case("rate-noise, accel-noise", *(partial(hide.understated, sensor, 0.35) for sensor in ("rate", "accel"))),
    hidden_case("coloured-noise:accel, wheel-momentum", partial(hide.coloured, "accel"), hide.wheel, urdf=SERVICER4),
    _outside("pulse-train", hide.pulse_train, frame="base", accept=("thruster-pulses",)),
    _outside("thermal-snap", hide.thermal_snap, urdf=SERVICER4, frame="base", accept=("thermal-snap",)),
    _outside("growing-torque", hide.growing_torque, frame="orbit"),
    _outside("swinging-torque", hide.swinging_torque, urdf=SERVICER4, frame="orbit"),
    _outside("shifting-mass", hide.shifting_mass, accept=("mass-shift",)),
    _outside("bias-jump", hide.bias_jump, accept=("rate-bias-jump",)),
    _outside("curved-gyro", hide.curved_gyro, urdf=SERVICER4),
    _outside("backlash", partial(hide.backlash, "joint2"), accept=("joint-backlash:joint2",)),
    _outside("wandering-torque", hide.wandering_torque, urdf=SERVICER4, frame="orbit"),
    _null("null, three joints"),
    _null("null, four joints, own sampling rates", urdf=SERVICER4, sensors={"rate_period": 1.0, "accel_period": 0.25}),
    _null(
        "null, gaps",
        gaps={"rate": [(40.0, 52.0)], "accel": [(70.0, 80.0), (100.0, 101.0)], "position.joint2": [(60.0, 61.5)]},
    ),
    _null("null, coarse encoder", urdf=SERVICER4, sensors={"encoder_sigma": 2e-5}),
    _null("null, uncertain arm", link_spread=0.02),
    _null("null, star sensor", urdf=SERVICER4, sensors=STAR_SENSOR),
    _null("null, laboratory", orbit=None, latitudes=None),
    _null("null, slides and branches", urdf=BRANCHED, manoeuvres={"frequencies": (0.015, 0.03), "duration": 170.0}),
    _null("null, eccentric orbit", orbit={"eccentricity": 0.05, "argument_of_perigee": 1.0, "radius": 7.3e6}),
    _null("null, at rest", initial_rate="zero", manoeuvres={"rate_spread": 0.0}),
    _null("null, one recording", urdf=SERVICER4, latitudes=[1.0], manoeuvres={"count": 1, "duration": 240.0}),
    _null("null, fast tumble", urdf=SERVICER4, manoeuvres={"rate_spread": 4e-3, "duration": 120.0}),
)
