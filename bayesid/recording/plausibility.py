"""Recorded motion that no robot can have made is refused; the angles of endless joints are unwrapped."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.recording.convention import Convention, ConventionError
from bayesid.recording.recording import Recording
from bayesid.recording.units import ANGLES, UNITS
from bayesid.robot.robot import Joint, Robot

__all__ = [
    "refuse_impossible_joints",
    "refuse_impossible_motion",
    "refuse_unfollowed_base",
    "unwrapped",
    "whirling_rate",
]

FASTEST = 5.0  # speed of a joint relative to its limit that none reaches
READING_ERROR = 0.01  # largest change of a reading by the noise and the steps of a coarse encoder [rad or m]
SPAN = 1.0  # time in which a joint in wrong units moves by much more than that error even where its limit is low [s]
FASTEST_BASE = 20.0  # angular speed of the base above which rates are rarely in rad/s, three turns per second [rad/s]
FOLLOWED = 1.0  # rotation from one reading to the next beyond which they do not determine the motion between [rad]
TURN = 2.0 * np.pi  # by which an angle jumps where its reading begins anew [rad]
NEAR_TURN = 0.5  # difference from a turn by which a joint may move from one sample to the next beside the jump [rad]
GARBLED = 0.01  # share of the samples up to which those outside the limits are garbled, not in another unit
OFTEN = 3  # number of times that one value outside the limits comes and goes where it is filled in
LONELY = 0.8  # probability that one joint alone is in degrees where all others stay within a turn of them
MOST_DEGREES = 1000.0  # largest angle that is taken for degrees where arcseconds would be within the limits too
RATE = ("rate.x", "rate.y", "rate.z")  # columns of the angular velocity of the base


def refuse_impossible_motion(recording: Recording, robot: Robot) -> None:
    """Refuse what degrees or arcseconds make of radians: joints far outside their limits, a base too fast to follow.

    Parameters
    ----------
    recording : Recording
    robot : Robot

    Raises
    ------
    InputError
        If a position is beyond a limit by more than a tenth of the range, a speed is above five times its limit, or
        most rates of the base are above 20 rad/s and turn it by more than a radian from one reading to the next.
    """
    refuse_impossible_joints(recording, robot)
    refuse_unfollowed_base(recording)


def refuse_unfollowed_base(recording: Recording) -> None:
    """Refuse rates of the base above 20 rad/s that turn it by more than a radian from one reading to the next.

    Its motion between the readings is then undetermined, and a simulation that followed it would take steps so short
    that neither time nor memory suffices.

    Parameters
    ----------
    recording : Recording

    Raises
    ------
    ConventionError
    """
    whirling = whirling_rate(recording)
    if whirling is None or whirling[1] * recording.interval(whirling[0]) < FOLLOWED:
        return
    name, speed = whirling
    units = [u for u, f in UNITS["rate"].items() if f * speed < FASTEST_BASE and u in ("deg/s", "arcsec/s")]
    conventions = [
        Convention(
            "convention:unit:rate",
            "rate",
            f'[sensors.rate]\nunit = "{unit}"',
            f"The readings of rate are in {unit}, not in rad/s.",
            1.0 / len(units),
        )
        for unit in units
    ]
    raise ConventionError(
        conventions,
        f"half of the readings exceed {speed:.3g} rad/s, {speed * recording.interval(name):.2g} rad between readings",
        file=recording.file or recording.name,
        place=f"column {name}",
        remedy="Give rates in rad/s, not in arcseconds or degrees per second",
    )


def whirling_rate(recording: Recording) -> tuple[str, float] | None:
    """Return the column of the fastest rate of the base and its median size [rad/s] where that is above 20 rad/s.

    Such a rate is unusual and not impossible: small bodies that are thrown by hand turn as fast.

    Parameters
    ----------
    recording : Recording
    """
    # single readings may be garbled
    speeds = {name: float(np.median(np.abs(recording.series(name)[1]))) for name in RATE if name in recording.channels}
    name = max(speeds, key=lambda column: speeds[column], default="")
    return (name, speeds[name]) if name and speeds[name] > FASTEST_BASE else None


def unwrapped(recording: Recording, robot: Robot) -> Recording:
    """Return a recording in which the angles of continuous joints do not jump by whole turns.

    The reading of an endless joint begins anew after a turn, at pi or two pi. A limited joint's does not: such jumps
    of one are refused.

    Parameters
    ----------
    recording : Recording
    robot : Robot

    Raises
    ------
    InputError
        If the reading of a limited joint jumps by a turn.
    """
    channels = {}
    for joint in robot.joints:
        name = f"position.{joint.name}"
        if joint.unit != "rad" or name not in recording.channels:
            continue
        time, position = recording.series(name)
        jumps = np.abs(np.abs(np.diff(position)) - TURN) < NEAR_TURN
        if not jumps.any() or np.ptp(position) > TURN + NEAR_TURN:
            continue
        if joint.kind != "continuous":
            raise InputError(
                f"the angle jumps by a full turn at time {time[int(np.argmax(jumps)) + 1]:g} s, like a wrapped "
                f"reading ({int(jumps.sum())} such jumps)",
                file=recording.file or recording.name,
                place=f"column {name}",
                remedy="Unwrap it (numpy.unwrap), or make the joint continuous in the URDF if it has no stops",
            )
        values = recording.channels[name].copy()
        values[np.isfinite(values)] = np.unwrap(position)
        channels[name] = values
    return replace(recording, channels={**recording.channels, **channels}) if channels else recording


def refuse_impossible_joints(recording: Recording, robot: Robot) -> None:
    """Refuse joints far outside their limits or faster than they can be.

    Parameters
    ----------
    recording : Recording
    robot : Robot

    Raises
    ------
    InputError
        As `refuse_impossible_motion`, of the joints alone.
    """
    file = recording.file or recording.name
    for joint in robot.joints:
        name = f"position.{joint.name}"
        if name not in recording.channels:
            continue
        time, position = recording.series(name)
        slack = 0.1 * (joint.upper - joint.lower) if np.isfinite(joint.upper - joint.lower) else 0.0
        outside = (position < joint.lower - slack) | (position > joint.upper + slack)
        other = (
            "If the positions are in degrees, give them in radians"
            if joint.unit == "rad"
            else "If the positions are in millimetres, give them in metres"
        )
        if outside.any():
            row, count = int(np.argmax(outside)), int(outside.sum())
            runs = int(np.sum(np.diff(outside.astype(int)) == 1))
            filled = len(set(position[outside].tolist())) == 1 and runs >= OFTEN
            garbled = filled or count <= GARBLED * len(outside)
            conventions = _fill(name, position[outside]) if garbled else _other_conventions(recording, robot, joint)
            remedy = f"{count} of {len(outside)} samples are corrupted: empty their cells" if garbled else other
            raise ConventionError(
                conventions,
                f"{position[row]:g} {joint.unit} at time {time[row]:g} s is outside the joint's limits "
                f"[{joint.lower:g}, {joint.upper:g}]",
                file=file,
                place=f"column {name}",
                remedy=f"{_or_stated(conventions)}{remedy}, or correct the limits in the URDF",
            )
        if fast := _impossible_speed(time, position, joint.velocity):
            raise InputError(
                f"the joint moves at {fast[1]:.3g} {joint.unit}/s at time {fast[0]:g} s; "
                f"its limit is {joint.velocity:g}",
                file=file,
                place=f"column {name}",
                remedy=f"{other}, or correct the limit in the URDF",
            )


def _or_stated(conventions: Sequence[Convention]) -> str:
    return "".join(f"{convention} Or: " for convention in conventions)


def _fill(name: str, outside: Floats) -> list[Convention]:
    """Return the convention that samples outside the limits of a joint, all the same, are fill values."""
    if len(set(outside.tolist())) > 1:
        return []
    line = f"[sensors.encoder]\nmissing = {outside[0]:.12g}"
    text = f"{len(outside)} samples of {name} contain the fill value {outside[0]:g}."
    return [Convention(f"convention:fill:{name}", name, line, text)]


def _other_conventions(recording: Recording, robot: Robot, joint: Joint) -> list[Convention]:
    """Return the conventions by which a joint that is outside its limits would be within them."""
    quoted = f'[joints."{joint.name}"]'

    def within(values: Floats, of: Joint = joint) -> bool:
        return bool(of.lower - READING_ERROR <= values.min() and values.max() <= of.upper + READING_ERROR)

    def seen(of: Joint) -> Floats:
        return (
            recording.series(f"position.{of.name}")[1] if f"position.{of.name}" in recording.channels else np.zeros(1)
        )

    position, conventions = seen(joint), []
    text = f"Joint {joint.name} has the opposite sign to that in the robot's file."
    if within(-position):
        conventions.append(Convention(f"convention:sign:{joint.name}", joint.name, f"{quoted}\nsign = -1", text))
    for other in robot.joints:
        if other.unit == joint.unit and other != joint and within(seen(other)) and within(position, other):
            lines = (
                f'{quoted}\ncolumn = "position.{other.name}"\n[joints."{other.name}"]\ncolumn = "position.{joint.name}"'
            )
            name = f"{joint.name},{other.name}"
            text = f"The columns of joints {joint.name} and {other.name} are exchanged."
            conventions.append(Convention(f"convention:exchanged:{name}", name, lines, text))
    if joint.unit == "rad":
        turns = [other for other in robot.joints if other.unit == "rad"]
        units = [u for u, f in ANGLES.items() if f < 1.0 and all(within(f * seen(other), other) for other in turns)]
        largest = max(float(np.abs(seen(other)).max()) for other in turns)
        if "deg" in units and largest < MOST_DEGREES:
            units = ["deg"]
        elif largest > TURN and all((seen(other) % 1.0 == 0.0).all() for other in turns):
            units = []
            text = "The joints are in counts: scale is 6.28319 divided by the counts per turn."
            line = f"[sensors.encoder]\nscale = {TURN / _counts_of_turn(largest):.6g}"
            conventions.append(Convention("convention:unit:position", "position", line, text))
        for unit in units if largest > TURN else ():
            line, text = f'[sensors.encoder]\nunit = "{unit}"', f"The joints are in {unit}, not in rad."
            conventions.append(Convention("convention:unit:position", "position", line, text))
    elif within(1e-3 * position):
        text = f"Joint {joint.name} is in mm, not in m."
        conventions.append(Convention(f"convention:unit:{joint.name}", joint.name, f"{quoted}\nscale = 0.001", text))
    share = 1.0 / len(conventions) if conventions else 0.0
    conventions = [replace(convention, probability=share) for convention in conventions]
    others = [float(np.abs(seen(other)).max()) for other in robot.joints if other.unit == "rad" and other != joint]
    if joint.unit == "rad" and others and max(others) < TURN and within(ANGLES["deg"] * position):
        line, text = f"{quoted}\nscale = {ANGLES['deg']:.9g}", f"Joint {joint.name} is in degrees, the others are not."
        alone = Convention(f"convention:unit:{joint.name}", joint.name, line, text, LONELY)
        conventions = [alone, *(replace(other, probability=(1.0 - LONELY) * share) for other in conventions)]
    return conventions


def _counts_of_turn(largest: float) -> float:
    """Return the smallest power of two that is a turn where no reading is larger than half of one."""
    return float(2.0 ** np.ceil(np.log2(2.0 * largest)))


def _impossible_speed(time: Floats, position: Floats, limit: float) -> tuple[float, float] | None:
    """Return the first time of an impossible speed and that speed, between neighbours or over a longer span."""
    first = np.arange(len(time) - 1)
    over_span = np.minimum(np.searchsorted(time, time[:-1] + SPAN), len(time) - 1)
    for last in (first + 1, over_span):
        change, duration = np.abs(position[last] - position[first]), time[last] - time[first]
        fast = change - READING_ERROR > FASTEST * limit * duration
        if fast.any():
            row = int(np.argmax(fast))
            return float(time[row]), float(change[row] / duration[row])
    return None
