"""Effects that a model can have; `bayesid.simulation.effects.effect.Effect` describes how to write a new one.

This file lists the shipped effects. The import of a class that is decorated with `register` makes the effect known to
study files; the class states everything else that the package needs to know of the effect.
"""

# the order of registration is that of the catalogue
# isort: off
from bayesid.simulation.effects.arm_effects import LinkInertia, Payload
from bayesid.simulation.effects.arm_motion_effects import EncoderOffset, JointFlexibility, JointLatency
from bayesid.simulation.effects.joint_backlash import JointBacklash
from bayesid.simulation.effects.systematic_faults import (
    AccelPosition,
    AttitudeMisalignment,
    SensorBias,
    SensorClock,
    SensorDrift,
    SystematicFault,
    SensorLatency,
    SensorMisalignment,
    SensorScale,
)
from bayesid.simulation.effects.bias_jump import AccelBiasJump, RateBiasJump
from bayesid.simulation.effects.effect import Effect, Situation, bounds_by_label
from bayesid.simulation.effects.effect_parameters import Parameter, Prior, Quantity
from bayesid.simulation.effects.environment_effects import (
    AerodynamicDrag,
    GravityGradient,
    MagneticDipole,
    RotationalDrag,
    SolarPressure,
    ThrusterLeak,
)
from bayesid.simulation.effects.internal_effects import FlexibleAppendage, FuelSlosh, WheelMomentum
from bayesid.simulation.effects.joint_friction import JointFriction, TorqueBias
from bayesid.simulation.effects.mass_shift import MassShift
from bayesid.simulation.effects.thruster_pulses import PulseTrain, ThrusterPulses
from bayesid.simulation.effects.events import EVERY, Event, Events
from bayesid.simulation.effects.kicks import Kicks
from bayesid.simulation.effects.thermal_snap import ThermalSnap
from bayesid.simulation.effects.effect_parameters import PhysicalBound
from bayesid.simulation.effects.register import create, known_effects, register
from bayesid.simulation.effects.wheel_history import WheelHistory
from bayesid.simulation.effects.wheel_faults import WheelImbalance, WheelInertia, WheelLatency, WheelTilt
from bayesid.simulation.instant import Instant, Modes, Readings, Resonance, Wrench

# isort: on

__all__ = [
    "EVERY",
    "AccelBiasJump",
    "AccelPosition",
    "AerodynamicDrag",
    "AttitudeMisalignment",
    "Effect",
    "EncoderOffset",
    "Event",
    "Events",
    "FlexibleAppendage",
    "FuelSlosh",
    "GravityGradient",
    "Instant",
    "JointBacklash",
    "JointFlexibility",
    "JointFriction",
    "JointLatency",
    "Kicks",
    "LinkInertia",
    "MagneticDipole",
    "MassShift",
    "Modes",
    "Parameter",
    "Payload",
    "PhysicalBound",
    "Prior",
    "PulseTrain",
    "Quantity",
    "RateBiasJump",
    "Readings",
    "Resonance",
    "RotationalDrag",
    "SensorBias",
    "SensorClock",
    "SensorDrift",
    "SensorLatency",
    "SensorMisalignment",
    "SensorScale",
    "Situation",
    "SolarPressure",
    "SystematicFault",
    "ThermalSnap",
    "ThrusterLeak",
    "ThrusterPulses",
    "TorqueBias",
    "WheelHistory",
    "WheelImbalance",
    "WheelInertia",
    "WheelLatency",
    "WheelMomentum",
    "WheelTilt",
    "Wrench",
    "bounds_by_label",
    "create",
    "known_effects",
    "register",
]
