"""Schema of a study, the TOML file that names recordings, sensors and the unknowns to identify.

A study is data only: typed, immutable, and checked when it is loaded. Values are in SI units and radians, quaternions
in the order x, y, z, w. Each class is a table of the file and each of its fields a key, so that an unknown key is an
error. Inner tables (joint to number) are plain mappings and must not be changed. The schema imports no slow package,
not even NumPy before a body needs it, so that errors in the file are reported at once.
"""

from bayesid.app.schema.design_section import DesignLimits, DesignSection
from bayesid.app.schema.sensor_sections import (
    AccelSensor,
    AttitudeSensor,
    EncoderSensor,
    OtherSensor,
    RateSensor,
    SensorsSection,
)
from bayesid.app.schema.study_file import Study
from bayesid.app.schema.study_sections import (
    BodySection,
    DiagnosisSection,
    LoadSection,
    ModelSection,
    OrbitSection,
    RecordingSection,
    RobotSection,
    UnknownsSection,
    WheelSection,
)
from bayesid.app.schema.telemetry_section import TelemetrySection

__all__ = [
    "AccelSensor",
    "AttitudeSensor",
    "BodySection",
    "DesignLimits",
    "DesignSection",
    "DiagnosisSection",
    "EncoderSensor",
    "LoadSection",
    "ModelSection",
    "OrbitSection",
    "OtherSensor",
    "RateSensor",
    "RecordingSection",
    "RobotSection",
    "SensorsSection",
    "Study",
    "TelemetrySection",
    "UnknownsSection",
    "WheelSection",
]
