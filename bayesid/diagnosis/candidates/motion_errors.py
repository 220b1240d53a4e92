"""What nobody listed and follows the motion instead of time.

A course in time needs dozens of amplitudes in each recording for what a function of the motion says with ten in all of
them, and causes with a few amplitudes that follow the motion as well would be named in its place: an encoder whose disk
is off its centre would be an error of a link, and a gyro that feels acceleration a flexible panel. The functions are
series of cosines over the range of what they depend on, or linear:

- position-dependent error of a joint: its recorded position errs by a function of the position. The links beyond the
  joint are elsewhere than recorded, and move and accelerate otherwise;
- motion-dependent error of a sensor with one axis for each coordinate: each axis errs by a function of its own reading,
  or all in proportion to the readings of another such sensor;
- rate-dependent torque: about each axis of the base, powers of the rate about it.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.diagnosis.candidates.linear_model import SignatureBank, Signatures
from bayesid.diagnosis.evidence.scales import AmplitudeGroup, CandidateCause
from bayesid.diagnosis.response.perturbed_model import Fit, PerturbedModel
from bayesid.inference.posterior import Posterior
from bayesid.robot.composite_tables import row_sensitivity, screws
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import kinematics
from bayesid.robot.robot import Robot
from bayesid.simulation.effects.arm_motion_effects import LARGEST_OFFSET, LARGEST_OFFSET_OF_SLIDE

__all__ = [
    "JOINT",
    "RATE_TORQUE",
    "SENSOR",
    "Series",
    "joint_positions",
    "joint_series",
    "motion_columns",
    "motion_signatures",
]

JOINT, SENSOR, RATE_TORQUE = "position-dependent error of a joint", "motion-dependent error of", "rate-dependent torque"
"""Names of the candidates; that of a sensor follows."""

WAVES = 6
"""Cosines of a function over a range."""

HARMONIC = 4
"""Highest harmonic of the turn of a joint that its error is to hold."""

MARGIN = 0.25
"""Share of a range by which the cosines reach beyond either end of it, since their slope is zero at their ends."""

POWERS = (2.0, 3.0)
"""Powers of the rate, with its sign, that make up a torque; a torque in proportion to the rate is a cause."""

MOVES = 0.01
"""Least range of a joint that shows how its error depends on its position [rad or m]."""


class Series(NamedTuple):
    """Cosines over a range and beyond both of its ends.

    Attributes
    ----------
    low, span : float
        Beginning and width of what they cover.
    waves : int
        Number of cosines, the constant among them.
    """

    low: float
    span: float
    waves: int

    @staticmethod
    def over(values: Floats, harmonic: float = 0.0) -> Series:
        """Return the series over the range of some values that holds sines and cosines up to a harmonic of them."""
        extent = float(np.ptp(values))
        span = (1.0 + 2.0 * MARGIN) * extent
        waves = max(WAVES, WAVES - 2 + int(np.ceil(harmonic * span / np.pi)))
        return Series(float(values.min()) - MARGIN * extent, span, waves)

    def derivatives(self, values: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the cosines at some values and their first two derivatives, (..., waves) each."""
        slope = np.pi * np.arange(self.waves) / self.span
        phase = slope * (values[..., None] - self.low)
        cosine = np.cos(phase)
        return cosine, -slope * np.sin(phase), -(slope**2) * cosine


def motion_signatures(perturbed: PerturbedModel, fit: Fit, error: float, torque: float) -> SignatureBank:
    """Return the bank of what follows the motion.

    Parameters
    ----------
    perturbed : PerturbedModel
    fit : Fit
    error : float
        Largest error of a sensor, in standard deviations of its noise.
    torque : float
        Largest torque [N m].
    """
    banks = [_joints(perturbed, fit), _sensors(perturbed, fit, error), _torque(perturbed, fit, torque)]
    return SignatureBank.joined(banks)


def motion_columns(posterior: Posterior) -> int:
    """Return the number of columns of `motion_signatures` if every joint makes half a turn.

    Parameters
    ----------
    posterior : Posterior
    """
    joints = Series.over(np.array([0.0, np.pi]), HARMONIC).waves * len(posterior.model.robot.joints)
    sensors = len(posterior.model.channels.kinds)
    return joints + 3 * sensors * (WAVES + 3 * (sensors - 1)) + 3 * len(POWERS)


def _joints(perturbed: PerturbedModel, fit: Fit) -> SignatureBank:
    """Return the bank of an error of one joint's recorded position [rad or m]; joints that hardly move have none."""
    robot, states = perturbed.posterior.model.robot, _states(fit)
    positions = joint_positions(fit)
    moving = np.flatnonzero(np.ptp(positions, axis=0) > MOVES)
    if not len(moving):
        return SignatureBank()
    tables = [[_sensitivity(robot, state) for state in side] for side in states]
    forms = []
    for index in map(int, moving):
        series = joint_series(positions[:, index])
        rows = [
            np.stack(
                [
                    _displaced(series, state, index, change[:, :, index])
                    for state, change in zip(side, changes, strict=True)
                ],
                axis=1,
            )
            for side, changes in zip(states, tables, strict=True)
        ]
        joint = robot.joints[index]
        largest = LARGEST_OFFSET_OF_SLIDE if joint.kind == "prismatic" else LARGEST_OFFSET
        columns = _responses(perturbed, fit, node_rows=rows[0], sample_rows=rows[1])
        forms.append((Signatures(f"{JOINT}, {joint.name}", columns), largest))
    return _bank(JOINT, forms)


def _states(fit: Fit) -> list[list[JointState]]:
    """Return the recorded motion at nodes and samples, of each recording."""
    motions = [flown.motion for flown in fit.posterior.manoeuvres]
    sides = [np.asarray(side.environment.time) for side in (fit.operating.node, fit.operating.sample)]
    return [[motion.evaluate(time) for motion, time in zip(motions, side, strict=True)] for side in sides]


def joint_positions(fit: Fit) -> Floats:
    """Return the recorded positions of all joints at all nodes and samples, (n, joints).

    Parameters
    ----------
    fit : Fit
    """
    return np.concatenate([state.position for side in _states(fit) for state in side])


def joint_series(visited: Floats) -> Series:
    """Return the series of a joint's error, given the positions that it takes.

    Parameters
    ----------
    visited : (n,) array
    """
    return Series.over(visited, HARMONIC)


def _sensitivity(robot: Robot, state: JointState) -> Floats:
    """Return the changes of the table's rows with position, velocity and acceleration of each joint, (3, T, n, 28)."""
    motion = kinematics(robot, state)
    return np.asarray(row_sensitivity(robot, motion, screws(robot, motion), {}))


def _displaced(series: Series, state: JointState, index: int, changes: Floats) -> Floats:
    """Return the changes of the table's rows (waves, T, 28) by errors of a joint, from those per unit, (3, T, 28)."""
    speed, acceleration = state.velocity[:, index, None], state.acceleration[:, index, None]
    value, first, second = series.derivatives(state.position[:, index])
    course = np.stack([value, first * speed, second * speed**2 + first * acceleration])
    return np.asarray(np.einsum("dtk,dtw->ktw", course, changes))


def _sensors(perturbed: PerturbedModel, fit: Fit, error: float) -> SignatureBank:
    """Return the bank of errors of each sensor that follow its own readings, or those of another sensor."""
    posterior = perturbed.posterior
    channels, readings = posterior.model.channels, fit.operating.readings.channels
    shape = fit.operating.sample.rate.shape[:2]
    read = {kind: np.asarray(readings[kind.value]) for kind in channels.kinds}
    read = {
        kind: values
        for kind, values in read.items()
        if values.shape[-1] == channels.of(kind).stop - channels.of(kind).start and np.ptp(values) > 0.0
    }
    banks = []
    for kind, own in read.items():
        columns, parts = channels.of(kind), []
        for axis in range(own.shape[-1]):
            cosines = Series.over(own[..., axis]).derivatives(own[..., axis])[0]
            part = np.zeros((cosines.shape[-1], *shape, channels.count))
            part[..., columns.start + axis] = np.moveaxis(cosines, -1, 0)
            parts.append(part)
        name = f"{SENSOR} {kind.value}"
        pushes = [(f"{name} by its reading", np.concatenate(parts))]
        for other, values in read.items():
            if other is not kind:
                each = np.moveaxis(values / np.sqrt(np.mean(values**2)), -1, 0)
                part = np.zeros((len(each), own.shape[-1], *shape, channels.count))
                for axis in range(own.shape[-1]):
                    part[:, axis, ..., columns.start + axis] = each
                pushes.append((f"{name} by {other.value}", part.reshape(-1, *part.shape[2:])))
        forms = [Signatures(label, _responses(perturbed, fit, reading=change)) for label, change in pushes]
        constant = forms[0].columns[:, 0]  # the response to one unit, in standard deviations
        high = error / float(np.sqrt(np.mean(constant[constant != 0.0] ** 2)))
        banks.append(_bank(name, [(form, high) for form in forms]))
    return SignatureBank.joined(banks)


def _torque(perturbed: PerturbedModel, fit: Fit, torque: float) -> SignatureBank:
    """Return the bank of torques about the axes of the base that follow powers of the rates about them."""
    rates = [np.asarray(side.rate) for side in (fit.operating.node, fit.operating.sample)]
    largest = np.abs(rates[1]).max(axis=(0, 1))
    if not (largest > 0.0).all():
        return SignatureBank()
    wrenches = []
    for rate in rates:
        share = rate / largest
        wrench = np.zeros((len(POWERS), 3, *rate.shape[:2], 6))
        for (row, power), axis in product(enumerate(POWERS), range(3)):
            wrench[row, axis, ..., 3 + axis] = share[..., axis] * np.abs(share[..., axis]) ** (power - 1.0)
        wrenches.append(wrench.reshape(-1, *rate.shape[:2], 6))
    columns = _responses(perturbed, fit, node_wrench=wrenches[0], sample_wrench=wrenches[1])
    return _bank(RATE_TORQUE, [(Signatures(RATE_TORQUE, columns), torque)])


def _responses(perturbed: PerturbedModel, fit: Fit, **pushes: Floats) -> Floats:
    """Return the responses to pushes whose parts have a common leading axis k, (N, k)."""
    count = len(next(iter(pushes.values())))
    columns = []
    for some in np.array_split(np.arange(count), -(-count // perturbed.most_pushes)):
        perturbation = perturbed.perturbation(len(some), None, **{name: part[some] for name, part in pushes.items()})
        columns.append(perturbed.respond(perturbation, fit.z, fit.data))
    return np.concatenate(columns, axis=1)


def _bank(name: str, sized: Sequence[tuple[Signatures, float]]) -> SignatureBank:
    """Return the bank of a candidate with one form for each of some signatures, of which the largest size is given."""
    forms = [(AmplitudeGroup(signatures.name, largest),) for signatures, largest in sized]
    cause = CandidateCause(name, forms[0], True, tuple(forms[1:]))
    return SignatureBank(tuple(signatures for signatures, _ in sized), (cause,))
