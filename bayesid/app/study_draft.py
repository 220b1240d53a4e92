"""First study file of a robot and its recordings, with what they show filled in and the rest marked for the user."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.app.schema import Study
from bayesid.diagnosis.noise.encoder_fault import noise_of
from bayesid.recording.joint_motion import check_joints
from bayesid.recording.plausibility import refuse_impossible_motion, unwrapped
from bayesid.recording.recording import Recording
from bayesid.recording.smoothing import JointSamples, smooth
from bayesid.robot.robot import Joint, Robot
from bayesid.robot.robot_size import RobotSize

__all__ = ["CHECK", "channel_noise", "draft_study", "open_places"]

CHECK = "# please check"
"""Mark of every value that recordings cannot tell."""

# noise of a sensor whose readings show none [rad/s, m/s2, rad]
UNSEEN = {"rate": 1e-5, "accel": 1e-5, "attitude": 1e-5}
ALIKE = 1.5  # ratio up to which the noises of several axes or joints are written as one number
NOTES = 32  # column at which the notes begin, unless a value is longer
ROTOR, ROTOR_RADIUS = 2e-3, 0.05  # mass of a rotor over the robot's, and its radius over the base's length; a guess
# sensors of the base, with the units of their noise
UNITS = {"rate": "rad/s", "accel": "m/s2", "attitude": "rad, small rotation in base axes"}


def draft_study(
    robot: Robot,
    urdf: Path,
    recordings: Sequence[Recording],
    folder: Path,
    title: str,
    *,
    nearest_physical: bool = False,
) -> str:
    """Return the text of a study file.

    Parameters
    ----------
    robot : Robot
        Robot, all of whose moving joints are recorded.
    urdf : Path
        File of the robot.
    recordings : sequence of Recording
        Recordings with their files.
    folder : Path
        Folder of the study file, to which its paths are relative.
    title : str
        Title of the study.
    nearest_physical : bool
        Whether the robot was read with the nearest physical inertias.

    Raises
    ------
    InputError
        If a recording lacks a joint, holds an unknown one, or moves one beyond all limits, or if no sensor of the base
        is in all of them.
    """
    recordings = [unwrapped(recording, robot) for recording in recordings]
    for recording in recordings:
        check_joints(recording, robot)
        refuse_impossible_motion(recording, robot)
    _require_base_sensor(recordings)
    sections = [
        _head(title),
        _robot(robot, urdf, folder, nearest_physical),
        *(_wheel(name, robot) for name in dict.fromkeys(name for each in recordings for name in each.wheels)),
        ORBIT,
        *(_vector_sensor(recordings, family) for family in UNITS),
        _encoder(robot, recordings),
        _torque(recordings),
        *(_recording(recording, folder) for recording in recordings),
        _unknowns(robot),
        MODEL,
    ]
    return "\n".join(section for section in sections if section)


def open_places(study: Study) -> list[str]:
    """Return a sentence on how many places of a study are still as drafted, or none."""
    text = "" if study.file is None else study.file.read_text(encoding="utf-8-sig")
    count = text.count(CHECK)
    if count == 0:
        return []
    places = "1 place is" if count == 1 else f"{count} places are"
    return [f"{places} still marked `{CHECK}` in {study.file}: the drafted values there are guesses."]


def _line(content: str, note: str = "") -> str:
    """Return a line of the file with a note, all of which begin at one column."""
    return f"{content:<{NOTES}} # {note}" if note else content


def _unsure(content: str, note: str) -> str:
    """Return a line whose value the user has to check."""
    return f"{content:<{NOTES}} {CHECK}: {note}"


def _section(*lines: str) -> str:
    return "\n".join((*lines, ""))


def _head(title: str) -> str:
    return _section(
        "# Study for bayesid, drafted from its recordings. SI units, radians, quaternions x, y, z, w.",
        "# For completion and validation in editors: bayesid schema --output study.schema.json, and the first line",
        "# #:schema study.schema.json",
        f"title = {_quoted(title)}",
    )


def _robot(robot: Robot, urdf: Path, folder: Path, nearest_physical: bool) -> str:
    return _section(
        _line("[robot]", f"base {robot.base}, {len(robot.joints)} moving joints, {robot.mass:.6g} kg"),
        f"urdf = {_path(urdf, folder)}",
        *(["nearest_physical = true"] if nearest_physical else []),
        _unsure("link_spread = 0.0", "uncertainty of all other links in length, masses by twice that; 0 = exact"),
        "# joints, all recorded:" if robot.joints else "# no moving joints",
        *(f"#   {joint.name}: {joint.kind}, {_limits(joint)}" for joint in robot.joints),
    )


def _wheel(name: str, robot: Robot) -> str:
    """Return the section of a wheel whose speed is recorded, with a guess of its inertia from the robot's size."""
    size = RobotSize.of(robot)
    inertia = ROTOR * size.mass * (ROTOR_RADIUS * size.length) ** 2
    return _section(
        _line("[[robot.wheels]]", "its momentum follows from its recorded speed"),
        f"name = {_quoted(name)}",
        _unsure("axis = [0.0, 0.0, 1.0]", "unit vector, base axes"),
        _unsure(f"inertia = {inertia:.1e}", "kg m2 about the axis; included in the inertia of the base"),
        _unsure("position = [0.0, 0.0, 0.0]", "m, base frame; used only for an imbalance"),
    )


def _limits(joint: Joint) -> str:
    if not np.isfinite([joint.lower, joint.upper]).all():
        return f"no limits, in {joint.unit}"
    return f"limits {joint.lower:.4g} to {joint.upper:.4g} {joint.unit}"


ORBIT = _section(
    _unsure("# [orbit]", "for a robot in orbit, uncomment these two lines"),
    _line("# radius = 6.916e6", "m, from the Earth's centre"),
)

MODEL = _section(
    "[model]",
    _unsure("effects = []", 'in orbit ["gravity-gradient"]; `bayesid catalogue` lists all effects'),
    _unsure('initial_rate = "unknown"', '"zero" if the base is at rest at time 0'),
)


def _holding(recordings: Sequence[Recording], family: str) -> list[Recording]:
    return [recording for recording in recordings if f"{family}.x" in recording.channels]


def _require_base_sensor(recordings: Sequence[Recording]) -> None:
    if not any(len(_holding(recordings, family)) == len(recordings) for family in UNITS):
        raise InputError(
            f"no sensor of the base is in all recordings ({', '.join(recording.name for recording in recordings)})",
            remedy="Give recordings that all contain rate.x|y|z, accel.x|y|z or attitude.x|y|z|w",
        )


def _vector_sensor(recordings: Sequence[Recording], family: str) -> str:
    """Return the section of a sensor of the base, commented out where only some recordings hold it."""
    holding = _holding(recordings, family)
    if not holding:
        return ""
    sigma = _vector_noise(holding, family)
    source = "estimated from the recordings" if sigma else "a guess, because the readings contain no noise"
    shown = _one_or_each(sigma or (UNSEEN[family],) * 3)
    lines = [f"[sensors.{family}]", _unsure(f"sigma = {shown}", f"{UNITS[family]}, per sample, {source}")]
    if family == "accel":
        lines.append(_unsure("position = [0.0, 0.0, 0.0]", "m, of the accelerometer from the base origin"))
        lines.append(_line("# bias_sigma = 1e-4", "m/s2, for a model with a constant bias"))
    if family != "attitude":
        lines.append(_unsure("mounting = [0.0, 0.0, 0.0, 1.0]", "quaternion from sensor to base axes"))
    if len(holding) < len(recordings):
        missing = ", ".join(recording.name for recording in recordings if recording not in holding)
        lines = [f"{CHECK}: the sensor is omitted because {missing} lacks it", *(f"# {line}" for line in lines)]
    return _section(*lines)


def _encoder(robot: Robot, recordings: Sequence[Recording]) -> str:
    lines = [_line("[sensors.encoder]", "omitted values are estimated when the recordings are read")]
    for key, family, unit in (("sigma", "position", "rad or m"), ("velocity_sigma", "velocity", "rad/s or m/s")):
        seen = {joint.name: channel_noise(recordings, f"{family}.{joint.name}") for joint in robot.joints}
        estimated = {name: sigma for name, sigma in seen.items() if sigma is not None}
        if not estimated:
            continue
        alike = len(estimated) == len(robot.joints) and max(estimated.values()) <= ALIKE * min(estimated.values())
        each = ", ".join(f"{_quoted(name)} = {sigma:.1e}" for name, sigma in estimated.items())
        value = f"{np.median(list(estimated.values())):.1e}" if alike else f"{{ {each} }}"
        lines.append(_unsure(f"{key} = {value}", f"{unit}, per sample, estimated from the recordings"))
    return _section(*lines)


def _torque(recordings: Sequence[Recording]) -> str:
    if not any(column.startswith("torque.") for recording in recordings for column in recording.channels):
        return ""
    return _section(
        _unsure("# [sensors.torque]", "joint torques are recorded, but used only with this section"),
        _line("# sigma = 0.1", "N m or N"),
    )


def _recording(recording: Recording, folder: Path) -> str:
    lines = ["[[recordings]]", f"file = {_path(recording.file or Path(recording.name), folder)}"]
    if "attitude.x" in recording.channels:
        time, quaternion = recording.vector("attitude", ("x", "y", "z", "w"))
        first = ", ".join(f"{value:.9g}" for value in quaternion[0])
        sigma = max(_vector_noise([recording], "attitude") or (UNSEEN["attitude"],))
        lines.append(f"attitude = [{first}]")
        lines.append(_unsure(f"attitude_sigma = {sigma:.1e}", f"rad; attitude is the sample at {time[0]:.3g} s"))
    else:
        lines.append(_unsure("attitude = [0.0, 0.0, 0.0, 1.0]", "base to orbit axes at time 0"))
        lines.append(_unsure("attitude_sigma = 0.0", "rad; 0 = exact"))
    lines.append(
        _line("# argument_of_latitude = 0.0", "rad at time 0, for effects that depend on the orbital position")
    )
    driven = [name for name in recording.joints if f"position.{name}" not in recording.channels]
    if driven:
        start = ", ".join(f"{_quoted(name)} = 0.0" for name in driven)
        lines.append(_unsure(f"start = {{ {start} }}", "positions at time 0 of joints recorded by speed only"))
    return _section(*lines)


def _unknowns(robot: Robot) -> str:
    return _section(
        "[unknowns]",
        _unsure(f"bodies = [{_quoted(robot.base)}]", "links or loads whose ten inertial parameters are identified"),
        _unsure("spread = 1.0", "relative width of their prior about the values in the robot's file"),
    )


def _one_or_each(sigma: Sequence[float]) -> str:
    if max(sigma) <= ALIKE * min(sigma):
        return f"{np.sqrt(np.mean(np.square(sigma))):.1e}"
    return f"[{', '.join(f'{value:.1e}' for value in sigma)}]"


def _path(file: Path, folder: Path) -> str:
    return _quoted(Path(os.path.relpath(file, folder)).as_posix())


def _quoted(text: str) -> str:
    """Return text as a string of TOML, which takes the escapes of JSON."""
    return json.dumps(text, ensure_ascii=False)


LEAST = 1e-9  # noise relative to the range of the samples below which there is none: it is the rounding of their digits
# degrees of freedom of the differences from which on they are taken, since smoothing takes some noise for motion
FEWEST = 3.0
MOST = 500  # number of samples that are smoothed at most, because more make the estimate slow and no better


def channel_noise(recordings: Sequence[Recording], column: str) -> float | None:
    """Return the standard deviation per sample of a channel, the median over the recordings; None if none is seen.

    High differences of the samples leave noise and no motion, and the median over them leaves out where the motion is
    rough; where the samples are too uneven for differences, the likelihood of a smoothing spline says how noisy they
    are.

    Parameters
    ----------
    recordings : sequence of Recording
    column : str
        Name of the channel, such as ``position.joint1``.
    """
    sigmas = [_noise(*recording.series(column)) for recording in recordings if column in recording.channels]
    return _median(sigmas)


def _vector_noise(recordings: Sequence[Recording], family: str) -> tuple[float, float, float] | None:
    """Return the standard deviations per sample of the three axes of a sensor, None if one of them shows no noise.

    Those of an attitude are small rotations in base axes [rad].
    """
    axes = [
        _median([_noise(time, values[:, axis]) for time, values in _vectors(recordings, family)]) for axis in range(3)
    ]
    if None in axes:
        return None
    x, y, z = (float(sigma or 0.0) for sigma in axes)
    return x, y, z


def _vectors(recordings: Sequence[Recording], family: str) -> list[tuple[Floats, Floats]]:
    if family != "attitude":
        return [recording.vector(family) for recording in recordings]
    return [_turned(*recording.vector(family, ("x", "y", "z", "w"))) for recording in recordings]


def _turned(time: Floats, quaternion: Floats) -> tuple[Floats, Floats]:
    """Return the sum of the small rotations from sample to sample, whose noise is that of the samples."""
    attitude = Rotation.from_quat(quaternion)
    steps = (attitude[:-1].inv() * attitude[1:]).as_rotvec()
    return time, np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])


def _noise(time: Floats, values: Floats) -> float | None:
    differences = noise_of([JointSamples(0, time, values, 1.0)], FEWEST)
    if differences is not None:
        sigma = float(np.sqrt(differences.ratio))
    else:
        middle = slice(max(0, (len(time) - MOST) // 2), (len(time) + MOST) // 2)
        sigma = smooth([JointSamples(0, time[middle], values[middle], None)]).sigmas[0]
    return sigma if sigma > LEAST * float(np.ptp(values)) and sigma > 0.0 else None


def _median(sigmas: Sequence[float | None]) -> float | None:
    seen = [sigma for sigma in sigmas if sigma is not None]
    return float(np.median(seen)) if seen else None
