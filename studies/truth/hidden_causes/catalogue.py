"""The catalogue of cases: at least one for each name of the contract, then pairs, outside effects, nulls."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from studies.truth.hidden_causes import causes as hide
from studies.truth.hidden_causes.case import Build, Case
from studies.truth.urdf import BRANCHED, SERVICER3, SERVICER4

__all__ = ["CASES"]


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
    """Case in which the builds act together."""
    others = tuple(other for other in accept if other not in causes)
    return Case(name, tuple(causes), status, builds, urdf, fixed, others, frame)


def _effect(name: str, build: Build, **options: Any) -> Case:
    """Case that hides one cause of the catalogue."""
    return _case(name, [name], build, **options)


def _outside(name: str, build: Build, **options: Any) -> Case:
    """Case that hides something outside the catalogue."""
    return _case(name, [], build, status="unknown", **options)


def _null(name: str, **options: Any) -> Case:
    """Case that hides nothing."""
    return _case(name, [], status="adequate", **options)


LATENCIES = ("rate-latency", "accel-latency", "joint-latency")
HAND4 = ("payload:link4", "link-inertia:link4", "payload:tip", "link-inertia:tip")
HAND3 = ("payload:link3", "link-inertia:link3")

_payload3 = partial(hide.payload, "link3", SERVICER3, 0.08, [0.7, 0.05, 0.03])
_payload4 = partial(hide.payload, "link4", SERVICER4, 0.06, [0.1, 0.05, 0.2])

CASES: tuple[Case, ...] = (
    _effect("gravity-gradient", hide.no_gradient),
    _effect("initial-rate", hide.initial_rate, urdf=SERVICER4),
    _effect("wheel-momentum", hide.wheel),
    _effect("aerodynamic-drag", hide.air, urdf=SERVICER4),
    _effect("solar-pressure", hide.light),
    _effect("magnetic-dipole", hide.magnet, urdf=SERVICER4),
    _effect("thruster-leak", hide.leak),
    _effect("rotational-drag", hide.braking, urdf=SERVICER4),
    _effect("flexible-appendage", hide.panel),
    _effect("fuel-slosh", hide.fuel, urdf=SERVICER4),
    _effect("payload:link3", _payload3, accept=HAND3),
    _effect("payload:link4", _payload4, urdf=SERVICER4, accept=HAND4),
    _effect("link-inertia:link3", partial(hide.wrong_cad, "link3", SERVICER4, 0.015), urdf=SERVICER4, accept=HAND3),
    _effect(
        "link-inertia:link2",
        partial(hide.wrong_cad, "link2", SERVICER3, 0.012),
        accept=("payload:link2", "link-inertia:link2"),
    ),
    _effect("joint-flexibility:joint2", partial(hide.soft_joint, "joint2", 0.9)),
    _effect("joint-flexibility:joint3", partial(hide.soft_joint, "joint3", 1.0), urdf=SERVICER4),
    _effect("rate-bias", partial(hide.vector_fault, "rate", "bias", 3e-4)),
    _effect("rate-drift", partial(hide.vector_fault, "rate", "drift", 2e-7), urdf=SERVICER4),
    _effect("rate-scale", partial(hide.vector_fault, "rate", "scale", 2.2e-2)),
    _effect("rate-misalignment", partial(hide.vector_fault, "rate", "misalignment", 1.2e-3), urdf=SERVICER4),
    _effect("accel-bias", partial(hide.vector_fault, "accel", "bias", 8e-6)),
    _effect("accel-drift", partial(hide.vector_fault, "accel", "drift", 1e-7), urdf=SERVICER4),
    _effect("accel-scale", partial(hide.vector_fault, "accel", "scale", 2e-2)),
    _effect("accel-misalignment", partial(hide.vector_fault, "accel", "misalignment", 7e-3), urdf=SERVICER4),
    _effect("accel-position", hide.misplaced),
    _effect("rate-latency", partial(hide.delay, "rate", 0.006), accept=LATENCIES),
    _effect("accel-latency", partial(hide.delay, "accel", 0.012), urdf=SERVICER4, accept=LATENCIES),
    _effect("joint-latency", partial(hide.delay, "encoder", 0.006), accept=LATENCIES),
    _effect("encoder-offset:joint2", partial(hide.encoder_offset, "joint2", 2e-3)),
    _effect("encoder-offset:joint3", partial(hide.encoder_offset, "joint3", 4e-3), urdf=SERVICER4),
    _effect("rate-noise", partial(hide.understated, "rate", 0.35)),
    _effect("accel-noise", partial(hide.understated, "accel", 0.35), urdf=SERVICER4),
    _effect("coloured-noise:rate", partial(hide.coloured, "rate")),
    _effect("coloured-noise:accel", partial(hide.coloured, "accel"), urdf=SERVICER4),
    _effect("outliers:rate", partial(hide.outliers, "rate"), urdf=SERVICER4),
    _effect("outliers:accel", partial(hide.outliers, "accel")),
    _effect("quantisation:rate", partial(hide.rounded, "rate")),
    _effect("quantisation:accel", partial(hide.rounded, "accel"), urdf=SERVICER4),
    _effect("encoder-noise", partial(hide.understated, "encoder", 1.5), urdf=SERVICER4),
    _effect("rate-clock", partial(hide.clock, "rate", 5e-5)),
    _effect("accel-clock", partial(hide.clock, "accel", 1e-4), urdf=SERVICER4),
    _effect(
        "attitude-misalignment",
        hide.turned_star_sensor,
        urdf=SERVICER4,
        sensors={"rate_period": None, "attitude_period": 0.5},
    ),
    _effect("wheel-history:z", hide.changing_wheel),
    _effect("mass-shift", hide.jumping_mass),
    _case(
        "wheel-momentum, accel-bias",
        ["wheel-momentum", "accel-bias"],
        hide.wheel,
        partial(hide.vector_fault, "accel", "bias", 8e-6),
    ),
    _case(
        "payload:link4, rate-drift",
        ["payload:link4", "rate-drift"],
        _payload4,
        partial(hide.vector_fault, "rate", "drift", 2e-7),
        urdf=SERVICER4,
        accept=HAND4,
    ),
    _case(
        "payload:link3, rate-bias",
        ["payload:link3", "rate-bias"],
        _payload3,
        partial(hide.vector_fault, "rate", "bias", 3e-4),
        accept=HAND3,
    ),
    _case(
        "thruster-leak, accel-scale",
        ["thruster-leak", "accel-scale"],
        hide.leak,
        partial(hide.vector_fault, "accel", "scale", 2e-2),
    ),
    _case(
        "rate-noise, accel-noise",
        ["rate-noise", "accel-noise"],
        partial(hide.understated, "rate", 0.35),
        partial(hide.understated, "accel", 0.35),
    ),
    _case(
        "coloured-noise:accel, wheel-momentum",
        ["coloured-noise:accel", "wheel-momentum"],
        partial(hide.coloured, "accel"),
        hide.wheel,
        urdf=SERVICER4,
    ),
    _outside("pulse-train", hide.pulse_train, frame="base"),
    _outside("thermal-snap", hide.thermal_snap, urdf=SERVICER4, frame="base"),
    _outside("growing-torque", hide.growing_torque, frame="orbit"),
    _outside("swinging-torque", hide.swinging_torque, urdf=SERVICER4, frame="orbit"),
    _outside("shifting-mass", hide.shifting_mass, accept=("mass-shift",)),
    _outside("bias-jump", hide.bias_jump),
    _outside("curved-gyro", hide.curved_gyro, urdf=SERVICER4),
    _outside("backlash", partial(hide.backlash, "joint2")),
    _outside("wandering-torque", hide.wandering_torque, urdf=SERVICER4, frame="orbit"),
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
    _null("null, at rest", initial_rate="zero", manoeuvres={"rate_spread": 0.0}),
    _null("null, one recording", urdf=SERVICER4, latitudes=[1.0], manoeuvres={"count": 1, "duration": 240.0}),
    _null("null, fast tumble", urdf=SERVICER4, manoeuvres={"rate_spread": 4e-3, "duration": 120.0}),
)
"""At least one case for each name of the catalogue, then pairs, outside effects, nulls."""
