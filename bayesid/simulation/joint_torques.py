"""Joint torques: the sensors that measure them, and what they read of the bodies that each joint carries.

The torque through a joint is the power per unit of its speed of the wrench that moves everything beyond it, less what
the gravity gradient gives those bodies. It takes rows of kinematic tables of the bodies beyond the joint.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._io.errors import InputError
from bayesid._math.arrays import Traceable
from bayesid.robot.composite_tables import ENTRIES, WIDTH, composite_rows
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import Kinematics
from bayesid.robot.regressors import balance_regressor, carried_bodies, joint_axes
from bayesid.robot.robot import Robot

__all__ = ["BaseMotion", "Beyond", "TorqueSensor", "beyond_joints", "joint_torques", "no_joints"]


@dataclass(frozen=True)
class TorqueSensor:
    """Torque (force of a prismatic joint) that the parent exerts on the child along the axis, at the motor's side.

    Friction of the joint is part of the reading as far as the model has it (`JointFriction`).

    Parameters
    ----------
    joints : tuple of str
    sigma : tuple of float
        White noise per sample of each of them [N m, N].
    """

    joints: tuple[str, ...]
    sigma: tuple[float, ...]

    def __post_init__(self) -> None:
        if not self.joints or len(self.joints) != len(self.sigma):
            raise InputError(
                f"{len(self.joints)} joints and {len(self.sigma)} values of torque noise", remedy="Give one per joint"
            )
        for joint, sigma in zip(self.joints, self.sigma, strict=True):
            if not sigma > 0.0:
                raise InputError(f"torque noise {sigma:g} of {joint} is not positive", remedy="Give it in N m or N")

    def columns(self, robot: Robot) -> list[int]:
        """Return the indices of the joints in `Robot.joints`; an `InputError` where one does not exist."""
        return [robot.joint_index(joint) for joint in self.joints]


class Beyond(NamedTuple):
    """What each of n joints carries, at T instants; no joint where no torque is measured.

    known (T, n, 28): table rows of the known bodies beyond a joint; carried (T, n, p): one where a column of the
    unknown tables belongs to a body beyond the joint; axis (T, n, 6): velocity of what is beyond per unit of joint
    speed, linear at the base origin and angular, base axes; velocity (T, n): of the joints.
    """

    known: Traceable
    carried: Traceable
    axis: Traceable
    velocity: Traceable


def no_joints(count: int, columns: int) -> Beyond:
    """Return what is needed at ``count`` instants where no torque is measured."""
    return Beyond(*(np.zeros((count, *shape)) for shape in ((0, WIDTH), (0, columns), (0, 6), (0,))))


def beyond_joints(
    robot: Robot, state: JointState, moved: Kinematics, unknown: Sequence[str] = (), owners: Sequence[str | None] = ()
) -> Beyond:
    """Reduce a motion to what the torques of all joints need.

    Parameters
    ----------
    robot : Robot
    state, moved : JointState, Kinematics
        The motion at T instants.
    unknown : sequence of str
        Links that are not among the known bodies.
    owners : sequence of str or None
        Link that each of the p columns of the unknown tables belongs to.
    """
    links = list(robot.links)
    beyond = carried_bodies(robot, links)
    rows = [
        composite_rows(robot, moved, leave_out={*unknown, *(n for n, far in zip(links, own, strict=True) if not far)})
        for own in beyond
    ]
    carried = np.array([[0.0 if name is None else own[links.index(name)] for name in owners] for own in beyond])
    return Beyond(
        known=np.stack(rows, axis=1),
        carried=np.tile(carried, (len(state.position), 1, 1)),
        axis=joint_axes(robot, moved),
        velocity=state.velocity,
    )


class BaseMotion(NamedTuple):
    """Angular velocity of the base, its derivative and the non-gravitational acceleration of its origin, base axes."""

    rate: Array
    rate_change: Array
    acceleration: Array


def joint_torques(
    beyond: Beyond, unknown: Array, loads: Array, motion: BaseMotion, com: Array, gravity_gradient_tensor: Array
) -> Array:
    """Return the torques of one instant, shape (n,).

    Parameters
    ----------
    beyond : Beyond
        Of the instant, without the leading axis.
    unknown : (28, p) array
        The unknown tables.
    loads : (p,) array
        What multiplies them.
    motion : BaseMotion
    com : (3,) array
        Centre of mass of the whole system, base axes [m].
    tide : (3, 3) array
        Gravitational acceleration per distance from it, base axes [1/s2].
    """
    if not len(beyond.known):
        return jnp.zeros(0)
    rows = beyond.known + (beyond.carried * loads) @ unknown.T
    wrench = balance_regressor(rows.T[None], *(part[None] for part in motion))[0].T
    pulled = jax.vmap(_pulled, (0, None, None))(rows, com, gravity_gradient_tensor)
    return jnp.einsum("jk,jk->j", beyond.axis, wrench - pulled)


def _pulled(row: Array, com: Array, gravity_gradient_tensor: Array) -> Array:
    """Force and torque about the base origin that a field growing linearly from ``com`` exerts on bodies."""
    mass, first = row[ENTRIES["mass"]], row[ENTRIES["first"]]
    xx, yy, zz, xy, xz, yz = row[ENTRIES["second"]]
    second = jnp.stack([jnp.stack([xx, xy, xz]), jnp.stack([xy, yy, yz]), jnp.stack([xz, yz, zz])])
    spread = second @ gravity_gradient_tensor  # integral of r (tide r)'; its antisymmetric part is the torque
    torque = jnp.stack([spread[1, 2] - spread[2, 1], spread[2, 0] - spread[0, 2], spread[0, 1] - spread[1, 0]])
    return jnp.concatenate(
        [gravity_gradient_tensor @ (first - mass * com), torque - jnp.cross(first, gravity_gradient_tensor @ com)]
    )
