"""Arm, panel, fuel and wheel as Basilisk's state effectors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from Basilisk.architecture import messaging
from Basilisk.simulation import (
    hingedRigidBodyStateEffector,
    linearSpringMassDamper,
    reactionWheelStateEffector,
    spacecraft,
    spinningBodyNDOFStateEffector,
)
from Basilisk.utilities import macros, simIncludeRW

from studies.truth.basilisk.arm import Link
from studies.truth.basilisk.parts import Panel, Slosh, Wheel
from studies.truth.numerics import Array
from studies.truth.urdf import rotation_from_rpy

__all__ = ["arm_effector", "column", "panel_effector", "slosh_effectors", "wheel_effector"]


def column(vector: Sequence[float] | Array) -> list[list[float]]:
    """Vector as a column, which is how Basilisk takes it."""
    return [[float(value)] for value in vector]


def arm_effector(
    arm: Sequence[Link], position: Array, stiffness: Array, damping: Array
) -> spinningBodyNDOFStateEffector.SpinningBodyNDOFStateEffector:
    """Arm whose joints are held by springs and dampers."""
    effector = spinningBodyNDOFStateEffector.SpinningBodyNDOFStateEffector()
    effector.ModelTag = "arm"
    for index, link in enumerate(arm):
        part = spinningBodyNDOFStateEffector.SpinningBody()
        part.setMass(link.body.mass)
        part.setISPntSc_S(link.body.inertia.tolist())
        part.setR_ScS_S(column(link.body.com))
        part.setR_SP_P(column(link.offset))
        part.setDCM_S0P(link.rotation.T.tolist())
        part.setSHat_S(column(link.axis))
        part.setThetaInit(float(position[index]))
        part.setK(float(stiffness[index]))
        part.setC(float(damping[index]))
        effector.addSpinningBody(part)
    return effector


def panel_effector(panel: Panel) -> hingedRigidBodyStateEffector.HingedRigidBodyStateEffector:
    """Panel on its spring."""
    effector = hingedRigidBodyStateEffector.HingedRigidBodyStateEffector()
    effector.ModelTag = "panel"
    omega, about_hinge = 2.0 * np.pi * panel.frequency, panel.inertia[1] + panel.mass * panel.reach**2
    effector.mass, effector.d = panel.mass, panel.reach
    effector.IPntS_S = np.diag(panel.inertia).tolist()
    effector.r_HB_B = column(panel.hinge)
    effector.dcm_HB = rotation_from_rpy(panel.rpy).T.tolist()
    effector.k, effector.c = about_hinge * omega**2, 2.0 * panel.damping * about_hinge * omega
    return effector


def slosh_effectors(slosh: Slosh) -> list[linearSpringMassDamper.LinearSpringMassDamper]:
    """Particles of fuel, one free along each base axis."""
    effectors, omega = [], 2.0 * np.pi * slosh.frequency
    for axis in np.eye(3):
        effector = linearSpringMassDamper.LinearSpringMassDamper()
        effector.massInit = slosh.mass
        effector.k, effector.c = slosh.mass * omega**2, 2.0 * slosh.damping * slosh.mass * omega
        effector.r_PB_B, effector.pHat_B = column(slosh.position), column(axis)
        effectors.append(effector)
    return effectors


def wheel_effector(wheel: Wheel, craft: spacecraft.Spacecraft) -> reactionWheelStateEffector.ReactionWheelStateEffector:
    """Wheel that spins freely on the craft."""
    effector, factory = reactionWheelStateEffector.ReactionWheelStateEffector(), simIncludeRW.rwFactory()
    size = float(np.linalg.norm(wheel.momentum))
    factory.create(
        "custom",
        [value / size for value in wheel.momentum],
        Js=wheel.spin_inertia,
        Omega=size / wheel.spin_inertia / macros.RPM,
        RWModel=messaging.BalancedWheels,
        useMaxTorque=False,
    )
    factory.addToSpacecraft("wheel", effector, craft)
    return effector
