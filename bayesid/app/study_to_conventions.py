"""How a study says that its telemetry was recorded, and the wrong conventions that are found in it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bayesid.app.schema import RecordingSection, Study
from bayesid.app.schema.sensor_sections import MountedSensor, SampledSensor
from bayesid.app.study_to_encoders import named_joint
from bayesid.recording.convention import Convention
from bayesid.recording.recorded_as import JointRecordedAs, RecordedAs, SensorRecordedAs
from bayesid.recording.units import ANGLES, TIMES, UNITS
from bayesid.robot.robot import Robot
from bayesid.simulation.orbit import EARTH

__all__ = ["convention_lines", "recorded_as", "remedy_sentence"]


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
    given, star = study.sensors, study.sensors.attitude
    sections: dict[str, SampledSensor | None] = {
        "rate": given.rate,
        "accel": given.accel,
        "attitude": given.attitude,
        **given.other,
    }
    sensors = {family: _sensor(family, sensor) for family, sensor in sections.items() if sensor is not None}
    encoder = given.encoder
    angles = ANGLES[encoder.unit]
    joints = {joint.name: _joint(study, joint.name, angles if joint.unit == "rad" else 1.0) for joint in robot.joints}
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


def _rotation(quaternion: Sequence[float]) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_quat(quaternion).as_matrix())


def _joint(study: Study, name: str, unit: float) -> JointRecordedAs:
    if name not in study.joints:
        return JointRecordedAs(scale=unit)
    section = study.joints[name]
    source = "" if section.column is None else section.column.partition(".")[2]
    return JointRecordedAs(float(section.sign), section.offset, section.scale * unit, source)


def _sensor(family: str, section: SampledSensor) -> SensorRecordedAs:
    gravity = getattr(section, "gravity", None)
    return SensorRecordedAs(
        missing=section.missing,
        native_rate=section.native_rate or 0.0,
        unit=UNITS[family][section.unit] if family in UNITS else 1.0,  # type: ignore[attr-defined]
        gravity=() if gravity is None else gravity,
        in_space=getattr(section, "gravity_fixed_in", "sensor") == "space",
        reflected=getattr(section, "reflected", False),
        latency=section.latency,
    )


def convention_lines(conventions: Sequence[Convention]) -> list[str]:
    """Return a sentence on each convention, for the terminal."""
    return [f"{convention.name} (probability {convention.probability:.3g}): {convention}" for convention in conventions]


def remedy_sentence(file: Path | None) -> str:
    """Return how to write remedies into a study."""
    return f"Write that into the study, or let it be written: bayesid init --fix {file or 'STUDY.toml'}"
