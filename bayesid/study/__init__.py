"""Studies: the TOML file that says what was recorded, with which sensors, and what is to be found out.

A study is data only: typed, immutable, checked when it is loaded. SI units, radians, quaternions x, y, z, w. Each class
is a table of the file and each of its fields a key, so that an unknown key is an error. Tables within (joint to number)
are plain mappings and not to be changed.
"""

from bayesid.study.design import DesignLimits, DesignSection
from bayesid.study.file import Study
from bayesid.study.robot import BodySection, LoadSection, OrbitSection, RobotSection
from bayesid.study.sections import ModelSection, RecordingSection, UnknownsSection
from bayesid.study.sensors import AccelSensor, AttitudeSensor, EncoderSensor, RateSensor, SensorsSection

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
