"""How a study says that its telemetry was recorded, and the wrong conventions that are found in it."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bayesid._io.errors import InputError
from bayesid.app.schema import RecordingSection, Study
from bayesid.app.schema.sensor_sections import MountedSensor, SampledSensor
from bayesid.app.study_to_encoders import named_joint
from bayesid.recording.convention import Convention
from bayesid.recording.recorded_as import JointRecordedAs, RecordedAs, SensorRecordedAs
from bayesid.recording.units import ANGLES, TIMES, UNITS
from bayesid.report.numbers import format_probability
from bayesid.robot.robot import Robot
from bayesid.simulation.orbit import EARTH

__all__ = ["convention_lines", "imported_as", "recorded_as", "remedy_sentence"]

STUDY_KEYS = ("mounting", "frame", "gravity_fixed_in")  # they need the mounting, or the attitude that the study states


def recorded_as(study: Study, section: RecordingSection, robot: Robot) -> RecordedAs:
    """Return the conventions of one recording of a study.

    Parameters
    ----------
    study : Study
    section : RecordingSection
    robot : Robot
    """
    for name in study.joints:
        named_joint(name, robot, f"joints.{name}", study.file)
    return _recorded_as(study, section, {joint.name: joint.unit for joint in robot.joints})


def _recorded_as(study: Study, section: RecordingSection, units: Mapping[str, str]) -> RecordedAs:
    given, star = study.sensors, study.sensors.attitude
    sections: dict[str, SampledSensor | None] = {
        "rate": given.rate,
        "accel": given.accel,
        "attitude": given.attitude,
        **given.other,
    }
    sensors = {family: _sensor(family, sensor) for family, sensor in sections.items() if sensor is not None}
    encoder = given.encoder
    angles = ANGLES[encoder.unit] * encoder.scale
    joints = {name: _joint(study, name, angles if unit == "rad" else 1.0) for name, unit in units.items()}
    return RecordedAs(
        time_unit=TIMES[study.telemetry.time_unit] if study.telemetry.time_unit else 0.0,
        joints={name: joint for name, joint in joints.items() if joint != JointRecordedAs()},
        sensors={**sensors, "position": _sensor("position", encoder)},
        mountings={
            family: _rotation(sensor.mounting)
            for family, sensor in sections.items()
            if isinstance(sensor, MountedSensor)
        },
        scalar_first=star is not None and star.order == "wxyz",
        inverse=star is not None and star.inverse,
        frame="orbit" if star is None else star.frame,
        start=np.array(section.attitude),
        orbit_rate=0.0 if study.orbit is None else float(np.sqrt(EARTH / study.orbit.radius**3)),
    )


def imported_as(remedies: Sequence[str], joints: Sequence[str]) -> RecordedAs:
    """Return the conventions of telemetry that is imported, of which no study says anything yet.

    Parameters
    ----------
    remedies : sequence of str
        Keys and values of the sections ``joints`` and ``sensors`` of a study, such as ``joints.elbow.sign=-1`` and
        ``sensors.rate.unit=deg/s``.
    joints : sequence of str
        Joints of the recording.

    Raises
    ------
    InputError
        If a study has no such key, or it needs more than the recording.
    """
    content: dict[str, Any] = {}
    try:
        content = tomllib.loads("\n".join(map(_line, remedies)))
    except tomllib.TOMLDecodeError as error:
        problem = f"{'; '.join(remedies)} is not a list of keys with values: {error}"
        raise InputError(problem, place="--recorded", remedy='Write them like "joints.elbow.sign=-1"') from None
    for key in content.keys() - {"joints", "sensors"}:
        raise InputError(f"there is no {key}", place="--recorded", remedy="Begin with joints. or sensors.")
    sensors, moved = content.get("sensors", {}), content.get("joints", {})
    parts = [table for part in (sensors, moved) for table in (part, *(part.values() if isinstance(part, dict) else ()))]
    if not all(isinstance(part, dict) for part in parts):
        problem = f"{'; '.join(remedies)} does not name a key of a sensor or joint"
        raise InputError(problem, place="--recorded", remedy='Write it like "joints.elbow.sign=-1"')
    later = [f"sensors.{name}.{key}" for name in sensors for key in sensors[name] if key in STUDY_KEYS]
    later += [f"sensors.encoder.{key}" for key in ("unit", "scale") if key in sensors.get("encoder", {})]
    if later:
        remedy = "State it in the study, or give joints.JOINT.scale for units of single joints"
        raise InputError(f"{later[0]} cannot be converted here", place="--recorded", remedy=remedy)
    for name in moved.keys() - set(joints):
        problem = f"the recording has no joint '{name}'"
        raise InputError(problem, place="--recorded", remedy=f"Give one of {', '.join(joints)}")
    known = {"rate": {"sigma": 1.0e-5}, "accel": {"sigma": 1.0e-5, "position": [0, 0, 0]}, "attitude": {"sigma": 1e-5}}
    study = Study.from_mapping(
        {
            "title": "",
            "robot": {"urdf": "robot.urdf"},
            "sensors": sensors | {name: given | sensors.get(name, {}) for name, given in known.items()},
            "joints": moved,
            "recordings": [{"file": "recording.csv", "attitude": [0, 0, 0, 1]}],
            "unknowns": {"bodies": ["base"]},
        }
    )
    return _recorded_as(study, study.recordings[0], dict.fromkeys(joints, "rad"))


def _line(remedy: str) -> str:
    """Return a line of TOML, whose value may lack quotes."""
    key, _, value = remedy.partition("=")
    try:
        tomllib.loads(f"value = {value}")
    except tomllib.TOMLDecodeError:
        return f'{key} = "{value.strip()}"'
    return remedy


def _rotation(quaternion: Sequence[float]) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_quat(quaternion).as_matrix())


def _joint(study: Study, name: str, unit: float) -> JointRecordedAs:
    if name not in study.joints:
        return JointRecordedAs(scale=unit)
    section = study.joints[name]
    source = "" if section.column is None else section.column.partition(".")[2]
    return JointRecordedAs(float(section.sign), section.offset, section.scale * unit, source, section.latency)


def _sensor(family: str, section: SampledSensor) -> SensorRecordedAs:
    gravity = getattr(section, "gravity", None)
    return SensorRecordedAs(
        missing=section.missing,
        native_rate=section.native_rate or 0.0,
        unit=_factor(family, section),
        gravity=() if gravity is None else gravity,
        in_space=getattr(section, "gravity_fixed_in", "sensor") == "space",
        reflected=getattr(section, "reflected", False),
        latency=section.latency,
    )


def _factor(family: str, section: SampledSensor) -> float:
    unit = UNITS[family][section.unit] if family in UNITS else 1.0  # type: ignore[attr-defined]
    return unit * section.scale if isinstance(section, MountedSensor) else unit


def convention_lines(conventions: Sequence[Convention]) -> list[str]:
    """Return a sentence on each convention, for the terminal."""
    return [
        f"{convention.name} (probability {format_probability(convention.probability)}): {convention}"
        for convention in conventions
    ]


def remedy_sentence(file: Path | None) -> str:
    """Return how to write remedies into a study."""
    return f"Write this into the study, or run: bayesid init --fix {file or 'STUDY.toml'}"
