"""Robots flown in MuJoCo with hidden parts and actions, and studies written from their flights."""

from studies.truth.bodies import Body, join, nearby, wrong_guess
from studies.truth.motions import Manoeuvres, Motion, smooth_motion
from studies.truth.mujoco.fields import (
    Field,
    SpunWheel,
    braking,
    drag,
    leak,
    magnet,
    outer_torque,
    pulses,
    snap,
    sunlight,
)
from studies.truth.mujoco.model import TruthModel
from studies.truth.mujoco.parts import Appendage, Flexibility, Mover, Rotor, Thrust, panel, slosh
from studies.truth.mujoco.rollout import rollout
from studies.truth.mujoco.study import Hidden, Study, write_study
from studies.truth.orbit import EARTH_FIELD, EARTH_RADIUS, MU, Orbit
from studies.truth.readings import Truth
from studies.truth.recordings import Distortion, Sensors, Spoiling
from studies.truth.urdf import read_body, rotation_from_rpy, write_urdf

__all__ = [
    "EARTH_FIELD",
    "EARTH_RADIUS",
    "MU",
    "Appendage",
    "Body",
    "Distortion",
    "Field",
    "Flexibility",
    "Hidden",
    "Manoeuvres",
    "Motion",
    "Mover",
    "Orbit",
    "Rotor",
    "Sensors",
    "Spoiling",
    "SpunWheel",
    "Study",
    "Thrust",
    "Truth",
    "TruthModel",
    "braking",
    "drag",
    "join",
    "leak",
    "magnet",
    "nearby",
    "outer_torque",
    "panel",
    "pulses",
    "read_body",
    "rollout",
    "rotation_from_rpy",
    "slosh",
    "smooth_motion",
    "snap",
    "sunlight",
    "write_study",
    "write_urdf",
    "wrong_guess",
]
