"""Robots flown in MuJoCo with hidden parts and actions, and studies written from their flights."""

from studies.truth.bodies import Body, join, nearby, read_body, rotation_from_rpy, write_urdf, wrong_guess
from studies.truth.motions import Manoeuvres, Motion, smooth_motion
from studies.truth.mujoco.model import TruthModel, rollout
from studies.truth.mujoco.parts import (
    Appendage,
    DrivenWheel,
    Field,
    Flexibility,
    Mover,
    Rotor,
    SpunWheel,
    Thrust,
    braking,
    drag,
    leak,
    magnet,
    outer_torque,
    panel,
    pulses,
    slosh,
    snap,
    sunlight,
)
from studies.truth.mujoco.study import Hidden, Study, write_study
from studies.truth.orbit import EARTH_FIELD, EARTH_RADIUS, MU, Orbit
from studies.truth.recordings import Distortion, Sensors, Spoiling, Truth

__all__ = ["EARTH_FIELD", "EARTH_RADIUS", "MU", "Appendage", "Body", "Distortion", "DrivenWheel"]
__all__ += ["Field", "Flexibility", "Hidden"]
__all__ += ["Manoeuvres", "Motion", "Mover", "Orbit", "Rotor", "Sensors", "Spoiling", "SpunWheel", "Study", "Thrust"]
__all__ += ["Truth", "TruthModel", "braking", "drag", "join", "leak", "magnet", "nearby", "outer_torque", "panel"]
__all__ += ["pulses", "read_body", "rollout", "rotation_from_rpy", "slosh", "smooth_motion", "snap", "sunlight"]
__all__ += ["write_study", "write_urdf", "wrong_guess"]
