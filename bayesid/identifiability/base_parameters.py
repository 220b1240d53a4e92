"""Base parameters (temporary stand-in): QR of Pinocchio's joint torque regressor over random states."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
import scipy.linalg as sla

from bayesid.arrays import Floats
from bayesid.robot import Robot

__all__ = ["BaseParameters", "base_parameters"]

KEYS = (
    "mass",
    *(f"first.{a}" for a in "xyz"),
    *(f"inertia.{a}" for a in ("xx", "xy", "yy", "xz", "yz", "zz")),
)


@dataclass(frozen=True)
class BaseParameters:
    """What a robot's motion and torques depend on: independent = K_1 + regrouping @ K_2."""

    standard: tuple[str, ...]
    independent: tuple[str, ...]
    dependent: tuple[str, ...]
    regrouping: Floats


def base_parameters(robot: Robot) -> BaseParameters:
    """Return the base parameters of a free-flying robot."""
    model, rng = robot.model, np.random.default_rng(0)
    data = model.createData()
    frames = [f.name for f in model.frames if f.type == pin.FrameType.BODY and f.name in robot.links]
    names = [
        n for n in frames if robot.links[n].inertial.mass > 0.0 and np.allclose(robot.links[n].placement, np.eye(4))
    ]
    rows = []
    for _ in range(60):
        q = pin.neutral(model)
        q = pin.integrate(model, q, rng.normal(size=model.nv))
        rows.append(
            pin.computeJointTorqueRegressor(model, data, q, rng.normal(size=model.nv), rng.normal(size=model.nv))
        )
    regressor = np.concatenate(rows)[:, : 10 * len(names)]
    standard = tuple(f"{name}.{key}" for name in names for key in KEYS)
    _, r, order = sla.qr(regressor, mode="economic", pivoting=True)
    rank = int((np.abs(np.diag(r)) > 1e-8 * abs(r[0, 0])).sum())
    beta = np.linalg.solve(r[:rank, :rank], r[:rank, rank:])
    beta[np.abs(beta) < 1e-9] = 0.0
    return BaseParameters(
        standard, tuple(standard[k] for k in order[:rank]), tuple(standard[k] for k in order[rank:]), beta
    )
