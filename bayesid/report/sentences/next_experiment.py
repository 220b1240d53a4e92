"""Advice on the next experiment: the manoeuvre that would bring a cause out, by the name of the cause."""

from __future__ import annotations

from bayesid.simulation.sensors import Kind

__all__ = ["advice"]

ADVICE = {
    "wheel-momentum": "Its torque grows with the base's rate: repeat with the base turning faster, and about other "
    "axes; a torque that acts at rest does not come from wheels.",
    "gravity-gradient": "It turns with the direction of the Earth: repeat with the base turned to another attitude, "
    "or with the arm stretched along another axis.",
    "aerodynamic-drag": "It keeps the direction of flight: repeat with the base turned to another attitude.",
    "solar-pressure": "It keeps the direction of the Sun and ends in eclipse: repeat with the base turned to another "
    "attitude, or on the orbit's night side.",
    "magnetic-dipole": "It follows the Earth's field along the orbit: repeat at another argument of latitude, a "
    "quarter of an orbit away, and in another attitude.",
    "thruster-leak": "It keeps its direction in the base: repeat with the base turned to another attitude, so that "
    "what is fixed in the orbit or in inertial space changes its direction in base axes and the leak does not; record "
    "with the arm at rest too.",
    "rotational-drag": "It brakes every rotation: let the base turn freely, with the arm at rest, at two rates.",
    "flexible-appendage": "It goes on swinging: excite it with one quick motion, then record with the arm at rest.",
    "fuel-slosh": "It goes on swinging: excite it with one quick motion, then record with the arm at rest.",
    "payload": "It moves with its link: move that joint through another range with the other joints still, and with "
    "the wrist in another posture, so that mass, centre of mass and inertia act apart.",
    "link-inertia": "It moves with its link: move that joint through another range with the other joints still; two "
    "neighbouring links act apart only if the joint between them moves alone.",
    "encoder-offset": "It acts as a wrong posture: move that joint through another range with the others still; the "
    "offset stays the same, an error of a mass does not.",
    "joint-flexibility": "It grows with the joint's acceleration: repeat the motion of that joint twice as fast.",
    "joint-friction": "It changes sign with the joint's speed, not with its acceleration: run that joint at two "
    "constant speeds, forwards and back, with the others still.",
    "torque-bias": "It remains when the joint carries no load: read the torques at rest, before and after the motion.",
    "latency": "It grows with speed: repeat the same motion twice as fast; errors of bodies keep their ratio to the "
    "motion, a delay's grow with frequency.",
    "bias": "It acts at rest and does not depend on the motion: record a longer rest before and after the motion, and "
    "reverse the motion; what the dynamics cause changes its sign, a bias does not.",
    "drift": "It grows with time and does not depend on the motion: record a longer rest before and after the motion, "
    "and repeat the motion in reverse.",
    "scale": "It grows with the reading: move in reverse and faster, with larger readings about each axis in turn.",
    "misalignment": "It mixes the axes: turn about one axis at a time, with large readings.",
    "accel-position": "It grows with the base's rate squared and angular acceleration: turn the base faster about "
    "each axis in turn.",
    "initial-rate": "It is there before the arm moves: record a rest before the motion.",
    "noise": "It is present at rest: record the sensor with the arm at rest.",
    "outliers": "They are single samples: look at the readings themselves, and record at rest.",
    "quantisation": "The readings lie on a lattice: record at rest, and compare with the resolution in the data sheet.",
}
"""Manoeuvre that would bring a cause out, by its name in the catalogue or the name without its sensor."""

ANYTHING = "Repeat with other amplitudes, other speeds and the base in another attitude."
"""Advice on a cause that the table does not hold."""

SENSORS = (*(kind.value for kind in Kind), "joint", "coloured")
"""Prefixes of a cause's name that say where it acts and not what it is."""


def advice(name: str) -> str:
    """Return the manoeuvre that would bring a cause out, as a sentence."""
    bare = name.partition(":")[0]
    names = (bare, *(bare.removeprefix(f"{prefix}-") for prefix in SENSORS))
    return next((ADVICE[key] for key in names if key in ADVICE), ANYTHING)
