"""Effects a model can carry; see `bayesid.simulation.effects.effect.Effect` for writing a new one.

This file is the list of shipped effects: importing a class that is decorated with `register` makes it known to study
files, and everything else that the package needs to know of an effect its class states itself.
"""

from bayesid.simulation.effects.arm_effects import LinkInertia, Payload
from bayesid.simulation.effects.arm_motion_effects import EncoderOffset, JointFlexibility, JointLatency
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import Parameter, Prior, Quantity
from bayesid.simulation.effects.environment_effects import (
    AerodynamicDrag,
    GravityGradient,
    MagneticDipole,
    RotationalDrag,
    SolarPressure,
    ThrusterLeak,
)
from bayesid.simulation.effects.instant import Instant, Modes, Readings, Resonance, Wrench
from bayesid.simulation.effects.internal_effects import FlexibleAppendage, FuelSlosh, WheelMomentum
from bayesid.simulation.effects.joint_friction import JointFriction, TorqueBias
from bayesid.simulation.effects.register import create, known_effects, register
from bayesid.simulation.effects.sensor_faults import (
    AccelBias,
    AccelDrift,
    AccelLatency,
    AccelMisalignment,
    AccelPosition,
    AccelScale,
    RateBias,
    RateDrift,
    RateLatency,
    RateMisalignment,
    RateScale,
    SensorFault,
)

__all__ = [
    "AccelBias",
    "AccelDrift",
    "AccelLatency",
    "AccelMisalignment",
    "AccelPosition",
    "AccelScale",
    "AerodynamicDrag",
    "Effect",
    "EncoderOffset",
    "FlexibleAppendage",
    "FuelSlosh",
    "GravityGradient",
    "Instant",
    "JointFlexibility",
    "JointFriction",
    "JointLatency",
    "LinkInertia",
    "MagneticDipole",
    "Modes",
    "Parameter",
    "Payload",
    "Prior",
    "Quantity",
    "RateBias",
    "RateDrift",
    "RateLatency",
    "RateMisalignment",
    "RateScale",
    "Readings",
    "Resonance",
    "RotationalDrag",
    "SensorFault",
    "SolarPressure",
    "ThrusterLeak",
    "TorqueBias",
    "WheelMomentum",
    "Wrench",
    "create",
    "known_effects",
    "register",
]
