"""Studies: the TOML file that says what was recorded, with which sensors, and what is to be found out.

A study is data only: typed, immutable, checked when it is loaded. SI units, radians, quaternions x, y, z, w. Each class
is a table of the file and each of its fields a key, so that an unknown key is an error. Tables within (joint to number)
are plain mappings and not to be changed. The schema imports nothing that takes long, not even NumPy before a body needs
it, so that an error in the file is told at once.
"""

from bayesid.app.schema.design_section import DesignLimits, DesignSection
from bayesid.app.schema.robot_section import BodySection, LoadSection, OrbitSection, RobotSection
from bayesid.app.schema.sensor_sections import AccelSensor, AttitudeSensor, EncoderSensor, RateSensor, SensorsSection
from bayesid.app.schema.study_file import Study
from bayesid.app.schema.study_sections import ModelSection, RecordingSection, UnknownsSection

__all__ = [
    "AccelSensor",
    "AttitudeSensor",
    "BodySection",
    "DesignLimits",
    "DesignSection",
    "EncoderSensor",
    "LoadSection",
    "ModelSection",
    "OrbitSection",
    "RateSensor",
    "RecordingSection",
    "RobotSection",
    "SensorsSection",
    "Study",
    "UnknownsSection",
]
