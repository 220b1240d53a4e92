"""Joint torques: the sensors that measure them, and the torques that move the bodies beyond each joint.

The torque through a joint is the virtual power, per unit of its speed, of the wrench that moves all bodies beyond it,
less that of the gravity gradient on those bodies. It is computed from the kinematic tables of the bodies beyond the
joint.
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
from bayesid._math.small_matrices import symmetric
from bayesid.robot.composite_tables import ENTRIES, WIDTH, composite_rows
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import Kinematics
from bayesid.robot.regressors import balance_regressor, carried_bodies, joint_axes
from bayesid.robot.robot import Robot

__all__ = ["BaseMotion", "Beyond", "TorqueSensor", "beyond_joints", "joint_torques", "no_joints"]


@dataclass(frozen=True)
class TorqueSensor:
    """Sensors of the torques (forces of prismatic joints) that parent links exert on child links, at the motor side.

    Friction of a joint is part of the reading if the model has it as an effect (`JointFriction`).

    Parameters
    ----------
    joints : tuple of str
        Names of the joints with a sensor.
    sigma : tuple of float
        Standard deviation of the white noise per sample, for each joint [N m, N].
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
    """Bodies beyond each of n joints at T instants; n is 0 where no torque is measured.

    Attributes
    ----------
    known : (T, n, 28) array
        Rows of the tables of the known bodies beyond each joint.
    carried : (T, n, p) array
        One where a column of the unknown tables belongs to a body beyond the joint, zero elsewhere.
    axis : (T, n, 6) array
        Twist at the base origin of the bodies beyond each joint at unit joint speed, linear part first, base axes.
    velocity : (T, n) array
        Speeds of the joints [rad/s or m/s].
    """

    known: Traceable
    carried: Traceable
    axis: Traceable
    velocity: Traceable


def no_joints(count: int, columns: int) -> Beyond:
    """Return an empty `Beyond` at ``count`` instants, for models without torque sensors.

    Parameters
    ----------
    count : int
        Number of instants.
    columns : int
        Number of columns of the unknown tables.
    """
    return Beyond(*(np.zeros((count, *shape)) for shape in ((0, WIDTH), (0, columns), (0, 6), (0,))))


def beyond_joints(
    robot: Robot, state: JointState, moved: Kinematics, unknown: Sequence[str] = (), owners: Sequence[str | None] = ()
) -> Beyond:
    """Return the bodies beyond all joints along a motion.

    Parameters
    ----------
    robot : Robot
    state, moved : JointState, Kinematics
        Motion of the joints and of their frames at T instants.
    unknown : sequence of str
        Links that are not among the known bodies.
    owners : sequence of str or None
        Link to which each of the p columns of the unknown tables belongs, None if to none.
    """
    links = list(robot.links)
    beyond = carried_bodies(robot, links)
    rows = [
        composite_rows(robot, moved, leave_out={*unknown, *(n for n, far in zip(links, mask, strict=True) if not far)})
        for mask in beyond
    ]
    carried = np.array([[0.0 if name is None else mask[links.index(name)] for name in owners] for mask in beyond])
    return Beyond(
        known=np.stack(rows, axis=1),
        carried=np.tile(carried, (len(state.position), 1, 1)),
        axis=joint_axes(robot, moved),
        velocity=state.velocity,
    )


class BaseMotion(NamedTuple):
    """Angular velocity of the base, its derivative, and the specific force at the base origin, in base axes."""

    rate: Array
    rate_change: Array
    acceleration: Array


def joint_torques(
    beyond: Beyond, unknown: Array, loads: Array, motion: BaseMotion, com: Array, gravity_gradient_tensor: Array
) -> Array:
    """Return the joint torques at one instant, shape (n,).

    Parameters
    ----------
    beyond : Beyond
        Bodies beyond the joints at the instant, without the leading axis.
    unknown : (28, p) array
        Tables of the unknown bodies and of the effects.
    loads : (p,) array
        Factors of the columns of these tables.
    motion : BaseMotion
        Motion of the base.
    com : (3,) array
        Centre of mass of the whole system, base axes [m].
    gravity_gradient_tensor : (3, 3) array
        Gravitational acceleration per distance from the centre of mass, base axes [1/s2].
    """
    if not len(beyond.known):
        return jnp.zeros(0)
    rows = beyond.known + (beyond.carried * loads) @ unknown.T
    wrench = balance_regressor(rows.T[None], *(part[None] for part in motion))[0].T
    pulled = jax.vmap(_pulled, (0, None, None))(rows, com, gravity_gradient_tensor)
    return jnp.einsum("jk,jk->j", beyond.axis, wrench - pulled)


def _pulled(row: Array, com: Array, gravity_gradient_tensor: Array) -> Array:
    """Return the force and torque about the base origin that the gravity gradient about ``com`` exerts."""
    mass, first = row[ENTRIES["mass"]], row[ENTRIES["first"]]
    # integral of r (G r)' over the mass, whose antisymmetric part is the torque
    spread = symmetric(row[ENTRIES["second"]]) @ gravity_gradient_tensor
    torque = jnp.stack([spread[1, 2] - spread[2, 1], spread[2, 0] - spread[0, 2], spread[0, 1] - spread[1, 0]])
    return jnp.concatenate(
        [gravity_gradient_tensor @ (first - mass * com), torque - jnp.cross(first, gravity_gradient_tensor @ com)]
    )
