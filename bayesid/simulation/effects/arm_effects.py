"""Effects of a link whose inertial parameters differ from those of the model."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Self

import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.recording.joint_motion import Motion
from bayesid.robot.composite_tables import link_table
from bayesid.robot.inertial_parameters import mass_com_inertia
from bayesid.robot.kinematics import kinematics
from bayesid.robot.log_cholesky import LOG_CHOLESKY, upper_cholesky, vector_from_factor
from bayesid.robot.robot import Robot
from bayesid.robot.robot_size import RobotSize, link_radius
from bayesid.simulation.effects.effect import Effect, Situation
from bayesid.simulation.effects.effect_parameters import Parameter, PhysicalBound, Quantity, three_digits
from bayesid.simulation.effects.placed import Placed
from bayesid.simulation.effects.register import register

__all__ = ["LinkInertia", "Payload"]

CHANGES = (
    Quantity("mass", "kg"),
    *(Quantity(f"com.{axis}", "m") for axis in "xyz"),
    *(Quantity(f"inertia.{axes}", "kg m2") for axes in ("xx", "yy", "zz", "xy", "xz", "yz")),
)
"""Reported changes of a link, with the inertia about the centre of mass in link axes."""

LINEAR_CHANGES = (
    Quantity("mass", "kg"),
    *(Quantity(f"first.{axis}", "kg m") for axis in "xyz"),
    *(Quantity(f"second.{axes}", "kg m2") for axes in ("xx", "xy", "yy", "xz", "yz", "zz")),
)
"""Changes in which the motion is linear, in the order of `InertialParameters.vector`: mass, first moment, and inertia
about the link's origin, link axes."""

LINK_ERROR = 0.5
"""Largest error of a link's mass relative to it; assumed, for harness and covers that a drawing leaves out."""


class _OnLink(Placed):
    """Change of one link's ten inertial parameters, after which the link is still a physical body.

    The parameters are log-Cholesky coordinates relative to the nominal link; the reported quantities are the changes of
    mass, centre of mass and inertia (`CHANGES`).
    """

    spread = 1.0
    is_body = True
    constant_names = ("factor", "vector")

    def __init__(self, place: str = "", spread: float | None = None) -> None:
        super().__init__(place)
        self.factor: Floats | None = None
        self.vector: Floats | None = None
        width = self.spread if spread is None else spread
        self.parameters = tuple(Parameter(key, "1", width) for key in LOG_CHOLESKY)

    @classmethod
    def instances(cls, model: Situation) -> Sequence[Effect]:
        """Return the effect on every link with volume that the model does not identify anyway."""
        unknown = {prior.name for prior in model.bodies}
        links = model.robot.links.items()
        return [cls(name) for name, link in links if name not in unknown and link.inertial.is_extended]

    def attach(self, robot: Robot) -> Self:
        """Return the effect with the nominal link of the robot."""
        nominal = robot.link(self.place).inertial
        if not nominal.is_extended:
            raise InputError(
                f"effect {self.label!r}: the link is not a body with volume",
                remedy="Name the link with mass to which it is fixed",
            )
        changed = copy.copy(self)
        changed.factor, changed.vector = upper_cholesky(nominal.pseudo_inertia), nominal.vector
        return changed

    @property
    def link(self) -> str | None:
        """Link that changes."""
        return self.place

    @property
    def quantities(self) -> Sequence[Quantity]:
        """Reported changes of mass, centre of mass and inertia."""
        return CHANGES

    def report(self, values: Array) -> Array:
        """Return the differences of the link from the nominal link."""
        factor, nominal = self._attached
        return mass_com_inertia(vector_from_factor(factor, values)) - mass_com_inertia(nominal)

    def table(self, robot: Robot, motion: Motion, time: Floats) -> Floats:
        """Return the kinematic table of the link."""
        return link_table(robot, self.place, kinematics(robot, motion.evaluate(time)))

    def loads(self, values: Array) -> Array:
        """Return the changes of the ten linear parameters."""
        factor, _ = self._attached
        return vector_from_factor(factor, values) - vector_from_factor(factor, jnp.zeros(len(LOG_CHOLESKY)))

    @property
    def _attached(self) -> tuple[Floats, Floats]:
        """Factor of the nominal link's pseudo-inertia and its ten parameters, also where a function is being traced."""
        if self.factor is None or self.vector is None:
            raise InputError(f"effect {self.label!r} does not yet belong to a model", remedy="Add it to a Model")
        return self.factor, self.vector


class _LinkMoments(Placed):
    """Change of a link's mass, first moment and inertia about the link's origin, in which the motion is linear.

    Nothing keeps the changed link a physical body. The scale of each parameter is that of the link itself.
    """

    def __init__(self, effect: _OnLink) -> None:
        super().__init__(effect.place)
        self.kind = effect
        _, vector = effect._attached
        mass = float(vector[0])
        extent = float(np.sqrt(np.abs(vector[[4, 6, 9]]).max() / mass))
        powers = {"kg": 0, "kg m": 1, "kg m2": 2}
        self.parameters = tuple(
            Parameter(moment.name, moment.unit, effect.spread * mass * extent ** powers[moment.unit])
            for moment in LINEAR_CHANGES
        )

    @property
    def label(self) -> str:
        """Name of the effect on the link."""
        return self.kind.label

    @property
    def link(self) -> str | None:
        """Link that changes."""
        return self.place

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return the bounds of the effect on the link."""
        return self.kind.physical_bounds(model)

    def table(self, robot: Robot, motion: Motion, time: Floats) -> Floats:
        """Return the kinematic table of the link."""
        return self.kind.table(robot, motion, time)

    def loads(self, values: Array) -> Array:
        """Return the parameters, which are the coefficients of the table."""
        return values


@register
class Payload(_OnLink):
    """Rigid body that is fixed to a link and missing from the model.

    At one standard deviation of the prior, the mass of the link is wrong by a factor of e² = 7.4.
    """

    name = "payload"
    is_added_body = True
    summary = "A body that is missing from the model is fixed to the link, such as a tool or a captured body."
    separated_by = (
        "The link's signature moves with it: move the joint of the link through a different range with the others "
        "still, and with the wrist in a different posture, to separate the effects of mass, centre of mass and inertia."
    )

    @property
    def amplitude_quantities(self) -> Sequence[Quantity]:
        """Changes of the ten linear parameters, which are the coefficients that `loads` returns."""
        return LINEAR_CHANGES

    def in_amplitudes(self) -> Effect:
        """Return the effect with the changes of the ten linear parameters as parameters."""
        return _LinkMoments(self)

    def amplitudes(self, values: Array) -> Array:
        """Return the changes of the ten linear parameters."""
        return self.loads(values)

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return the moments of a body as heavy and as large as the robot without it, fixed at the end of the link."""
        mass = RobotSize.of(model.robot).mass
        reach = link_radius(model.robot, self.place) + RobotSize.of(model.robot).radius
        body = f"A captured body is at most as heavy as the robot, {three_digits(mass)} kg"
        where = f"within {three_digits(reach)} m of the link's origin"
        return (
            PhysicalBound("kg", mass, f"{body}."),
            PhysicalBound("kg m", mass * reach, f"{body}, {where}."),
            PhysicalBound("kg m2", mass * reach**2, f"{body}, {where}."),
        )


@register
class LinkInertia(_OnLink):
    """Error of one link's inertial parameters, with a prior of 10 % in log-Cholesky coordinates and 20 % in mass.

    Its amplitudes are those coordinates: a drawing error affects the link's mass, extent and centre, and a link with
    slightly more mass everywhere differs in one coordinate, but in all ten moments about its origin.
    """

    name = "link-inertia"
    summary = "The link's mass, centre of mass or inertia differs from the model (CAD) values."
    separated_by = (
        "The link's signature moves with it: move the joint of the link through a different range with the others "
        "still; two neighbouring links can be distinguished only if the joint between them moves alone."
    )
    spread = 0.1

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return the log-Cholesky coordinates at which half of the link's mass is missing or misplaced."""
        mass = LINK_ERROR * model.robot.link(self.place).inertial.mass
        share = f"{100.0 * LINK_ERROR:g} % of the link's mass, {three_digits(mass)} kg"
        return (
            PhysicalBound("1", 0.5 * float(np.log1p(LINK_ERROR)), f"A drawing omits or misplaces at most {share}."),
        )
