"""What the robot is, or its joints do, differently from what the model believes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Self, cast

import jax.numpy as jnp
import numpy as np
import pinocchio as pin
from jax import Array
from scipy.interpolate import make_interp_spline

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats, namespace
from bayesid.recording.joint_motion import Motion
from bayesid.robot.composite_tables import composite_rows, link_table
from bayesid.robot.inertial_parameters import mass_com_inertia
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import configuration, kinematics
from bayesid.robot.log_cholesky import LOG_CHOLESKY, upper_cholesky, vector_from_factor
from bayesid.robot.robot import Robot
from bayesid.simulation.effects.effect import Effect, Parameter, Prior, Quantity, register
from bayesid.simulation.effects.placed import OnJoint, Placed

__all__ = ["EncoderOffset", "JointFlexibility", "JointLatency", "LinkInertia", "Payload"]

CHANGES = (
    Quantity("mass", "kg"),
    *(Quantity(f"com.{axis}", "m") for axis in "xyz"),
    *(Quantity(f"inertia.{axes}", "kg m2") for axes in ("xx", "yy", "zz", "xy", "xz", "yz")),
)


class _OnLink(Placed):
    """A change of one link's ten inertial parameters that leaves the link a physical body.

    The coordinates are log-Cholesky relative to the nominal link; reported are changes of mass, centre of mass and
    inertia about it, link axes.
    """

    spread = 1.0
    constant_names = ("factor", "vector")

    def __init__(self, place: str = "", spread: float | None = None) -> None:
        super().__init__(place)
        self.factor: Floats | None = None
        self.vector: Floats | None = None
        width = self.spread if spread is None else spread
        self.parameters = tuple(Parameter(key, "1", width) for key in LOG_CHOLESKY)

    def attach(self, robot: Robot) -> Self:
        """Take the nominal link from the robot."""
        nominal = robot.link(self.place).inertial
        if not nominal.is_extended:
            raise InputError(
                f"effect {self.label!r}: the link is no body with volume",
                remedy="Name the link with mass that it is fixed on",
            )
        changed = self.copied()
        changed.factor, changed.vector = upper_cholesky(nominal.pseudo_inertia), nominal.vector
        return changed

    @property
    def link(self) -> str | None:
        """The link."""
        return self.place

    @property
    def quantities(self) -> Sequence[Quantity]:
        """Changes of mass, centre of mass and inertia."""
        return CHANGES

    def report(self, values: Array) -> Array:
        """Return the link less the nominal link."""
        factor, nominal = self._attached
        return mass_com_inertia(vector_from_factor(factor, values)) - mass_com_inertia(nominal)

    def table(self, robot: Robot, motion: Motion, time: Floats) -> Floats:
        """Return the link's own table."""
        return link_table(robot, self.place, kinematics(robot, motion.evaluate(time)))

    def loads(self, values: Array) -> Array:
        """Return the change of the ten parameters."""
        factor, nominal = self._attached
        return vector_from_factor(factor, values) - nominal

    @property
    def _attached(self) -> tuple[Array, Array]:
        """Factor of the nominal link's pseudo-inertia and its ten parameters."""
        if self.factor is None or self.vector is None:
            raise InputError(f"effect {self.label!r} belongs to no model yet", remedy="Put it into a Model")
        return jnp.asarray(self.factor), jnp.asarray(self.vector)


@register
class Payload(_OnLink):
    """A rigid body nobody mentioned, fixed on a link.

    The prior is that of a link of the nominal mass, wrong by a factor of e^2 at one standard deviation.
    """

    name = "payload"
    summary = "Something is fixed on the link that the model does not have: a tool, a captured body."


@register
class LinkInertia(_OnLink):
    """An error of one link's inertial parameters; the prior is 10 % in log-Cholesky coordinates, 20 % of the mass."""

    name = "link-inertia"
    summary = "The link's mass, centre of mass or inertia differ from the model's (CAD) values."
    spread = 0.1


OFFSET_STEP = 0.02
"""Joint offset at which the tables are sampled for a quadratic [rad or m]; its cubic rest is below 1e-5 at 0.03 rad."""


@register
class EncoderOffset(OnJoint):
    """Constant error of a joint's recorded position: recorded = true + offset.

    The prior of 0.02 rad is a wrong zero by a degree.
    """

    name = "encoder-offset"
    summary = "The joint's encoder has a wrong zero: the arm stands elsewhere than the recording says."

    def __init__(self, place: str = "", sigma: float = 0.02) -> None:
        super().__init__(place)
        self.parameters = (Parameter("offset", "rad", sigma),)

    def table(self, robot: Robot, motion: Motion, time: Floats) -> Floats:
        """Return first and second differences of the tables in the joint's position."""
        index = self.index_in(robot)
        state = motion.evaluate(time)
        rows = []
        for step in (-OFFSET_STEP, 0.0, OFFSET_STEP):
            position = state.position + step * np.eye(len(robot.joints))[index]
            rows.append(composite_rows(robot, kinematics(robot, state._replace(position=position))))
        return _quadratic(rows, OFFSET_STEP)

    def loads(self, values: Array) -> Array:
        """Return the powers of the offset: the true position is the recorded one less it."""
        return jnp.stack([-values[0], values[0] ** 2])


LATENCY_STEP = 0.15
"""Delay at which the tables are sampled for a quartic [s]."""


@register
class JointLatency(Effect):
    """Delay of the joint record: the position stamped t is that of t - delay.

    The prior of 0.2 s is a few cycles of a slow data bus.
    """

    name = "joint-latency"
    summary = "The joints' record is late: the arm has moved on from where the recording says it is."

    def __init__(self, sigma: float = 0.2) -> None:
        self.parameters = (Parameter("delay", "s", sigma),)

    def table(self, robot: Robot, motion: Motion, time: Floats) -> Floats:
        """Return the quartic's coefficients through five samples of the tables."""
        shifts = LATENCY_STEP * np.arange(-2, 3)
        rows = [composite_rows(robot, kinematics(robot, motion.evaluate(time + shift))) for shift in shifts]
        powers = np.linalg.inv(np.vander(shifts, increasing=True))[1:]
        xp = namespace(rows[0])
        return cast("Floats", xp.einsum("ps,std->tdp", powers, xp.stack(rows)))

    def loads(self, values: Array) -> Array:
        """Return the powers of the delay, after which the record will show the arm."""
        return values[0] ** jnp.arange(1, 5)


@register
class JointFlexibility(OnJoint):
    """A joint whose link side gives way behind the measured motor side, on a damped spring.

    ``frequency`` is that of everything beyond the joint swinging on the spring with the base and the other joints held,
    at the start of the motion. The deflection follows the torque through the joint as long as the motion is slow
    against that frequency: to second order in the ratio of frequencies here, which holds above about 0.2 Hz.
    """

    name = "joint-flexibility"
    summary = "The joint's gear is elastic: what is beyond it lags behind the encoder when the arm accelerates."

    def __init__(self, place: str = "", frequency: float = 1.0, spread: float = 0.7) -> None:
        super().__init__(place)
        self.parameters = (
            Parameter("frequency", "Hz", spread, frequency, Prior.LOG_NORMAL),
            Parameter("damping", "1", 1.0, 0.03, Prior.LOG_NORMAL),
        )

    @property
    def starts(self) -> Sequence[Floats]:
        """Stiff, so that the fit is nearly linear in the compliance."""
        return [np.array([1.5, 0.0])]

    def table(self, robot: Robot, motion: Motion, time: Floats) -> Floats:
        """Return changes of the tables by the deflection that the joint's torque makes, and by its derivatives."""
        index, state = self.index_in(robot), motion.evaluate(time)
        deflection = _Deflection(robot, motion, index, float(time[-1]))
        columns = []
        for order in (0, 2, 1):
            rows = []
            for sign in (-1.0, 1.0):
                changed = [np.array(values) for values in state]
                for derivative in range(3):
                    changed[derivative][:, index] += sign * deflection.derivative(time, order + derivative)
                rows.append(composite_rows(robot, kinematics(robot, JointState(*changed))))
            columns.append(0.5 * (rows[1] - rows[0]))
        return np.stack(columns, axis=2)

    def loads(self, values: Array) -> Array:
        """Expand the slow response of the oscillator in the inverse of its frequency."""
        omega, damping = 2.0 * jnp.pi * values[0], values[1]
        return jnp.stack([omega**-2, -(1.0 - 4.0 * damping**2) * omega**-4, -2.0 * damping * omega**-3])


KNOTS = 0.5
"""Distance of the instants at which a joint's torque is computed [s]."""


class _Deflection:
    """Less the torque through a joint over the inertia beyond it at the start [1/s2], as a function of time."""

    def __init__(self, robot: Robot, motion: Motion, index: int, end: float) -> None:
        knots = np.linspace(0.0, end, int(np.ceil(end / KNOTS)) + 1)
        model = _loaded(robot)
        data = model.createData()
        state = motion.evaluate(knots)
        ratio = np.zeros(len(knots))
        beyond = 0.0
        for row in range(len(knots)):
            q = configuration(robot, state.position[row])
            velocity = np.concatenate([np.zeros(6), state.velocity[row]])
            acceleration = np.concatenate([np.zeros(6), state.acceleration[row]])
            mass = pin.crba(model, data, q)
            mass = np.triu(mass) + np.triu(mass, 1).T
            if row == 0:
                beyond = mass[6 + index, 6 + index]
            drift = pin.nonLinearEffects(model, data, q, velocity)
            # the base floats: its acceleration leaves no wrench on it
            base = np.linalg.solve(mass[:6, :6], -mass[:6, 6:] @ acceleration[6:] - drift[:6])
            torque = mass[6 + index, :6] @ base + mass[6 + index, 6:] @ acceleration[6:] + drift[6 + index]
            ratio[row] = -torque / beyond
        self.spline = make_interp_spline(knots, ratio, k=5)
        self.span = (knots[0], knots[-1])

    def derivative(self, time: Floats, order: int) -> Floats:
        """Return a derivative at some times."""
        return np.asarray(self.spline(np.clip(time, *self.span), nu=order))


def _loaded(robot: Robot) -> pin.Model:
    """Pinocchio's model with the robot's present links and loads."""
    model = robot.model.copy()
    for joint in range(1, model.njoints):
        model.inertias[joint] = pin.Inertia.Zero()
    for link in robot.links.values():
        if link.inertial.mass > 0.0:
            model.inertias[link.joint + 2] += pin.SE3(link.placement).act(
                pin.Inertia.FromDynamicParameters(link.inertial.vector)
            )
    return model


def _quadratic(rows: list[Floats], step: float) -> Floats:
    before, here, after = rows
    xp = namespace(here)
    slopes = [(after - before) / (2.0 * step), (after - 2.0 * here + before) / (2.0 * step**2)]
    return cast("Floats", xp.stack(slopes, axis=2))
