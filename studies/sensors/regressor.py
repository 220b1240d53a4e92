"""The linear method (19) with a known arm, and the effect of errors in its regressor on least squares.

With the arm known, (19) is Phi_base p_base = -Phi_arm p_arm, which is not badly posed. But Phi holds measured rates,
their derivatives and accelerations, which have errors e, and least squares take Phi as exact. With Psi_e = d Phi / d e,
the normal matrix gains the covariance sum_e var_e Psi_e' Psi_e of the regressor, and the estimate is

    p = p_true - (Phi' Phi + sum_e var_e Psi_e' Psi_e)^-1 sum_e var_e Psi_e' (Psi_e p_true + d (Phi_arm p_arm) / d e)

for large samples. This is attenuation: the more noise, the smaller the estimated mass.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from bayesid._math.arrays import Floats
from bayesid.robot.composite_tables import composite_rows, link_table
from bayesid.robot.inertial_parameters import mass_com_inertia
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import kinematics
from bayesid.robot.regressors import balance_regressor
from studies.base_body import paper
from studies.common.ets7 import ACCELEROMETER, BASE, ets7
from studies.common.quantities import MASS, inertia_matrix
from studies.sensors.draws import Draws
from studies.sensors.montecarlo import PIECES
from studies.sensors.setting import Flight, Noise, motion
from studies.sensors.treatments import Differences, LowPass, Treatment, Wiener

__all__ = ["TREATED", "Balance", "Regression", "attenuation", "regress", "solve_balance"]

TREATED: tuple[Treatment, ...] = (Differences(), LowPass(), PIECES, Wiener())
"""Treatments of joints, rates and accelerations alike."""


class Balance:
    """The balance of force and torque about the base's origin, linear in the base's parameters.

    Parameters
    ----------
    states : (3, T, joints) array
        Joint positions, velocities, accelerations.
    """

    def __init__(self, states: Floats) -> None:
        robot = ets7()
        moved = kinematics(robot, JointState(*states))
        self.base = link_table(robot, BASE, moved)
        self.arm = composite_rows(robot, moved, leave_out=(BASE,))[:, :, None]

    def __call__(self, rate: Floats, change: Floats, accel: Floats) -> tuple[Floats, Floats]:
        """Return the regressor (T, 6, 10) of the base and the wrench (T, 6) that moves the arm.

        Parameters
        ----------
        rate, change : (T, 3) array
            Angular velocity and its derivative, base axes [rad/s, rad/s2].
        accel : (T, 3) array
            Acceleration as the accelerometer reads it [m/s2].
        """
        base, arm = _balance(self.base, self.arm, rate, change, accel)
        return np.asarray(base), np.asarray(arm)[..., 0]


@jax.jit
def _balance(
    base: jax.Array, arm: jax.Array, rate: jax.Array, change: jax.Array, accel: jax.Array
) -> tuple[jax.Array, jax.Array]:
    point = jnp.array(ACCELEROMETER)
    origin = accel - jnp.cross(change, point) - jnp.cross(rate, jnp.cross(rate, point))
    return balance_regressor(base, rate, change, origin), balance_regressor(arm, rate, change, origin)


@dataclass(frozen=True)
class Regression:
    """Estimates of (19) from N sets of noise.

    Attributes
    ----------
    errors : (N, 10) array
        Errors relative to the true quantities.
    unphysical : int
        Number of estimates that no rigid body can have.
    """

    errors: Floats
    unphysical: int


def regress(draws: Draws, noise: Noise, treatments: Sequence[Treatment] = TREATED) -> dict[str, Regression]:
    """Solve (19) by least squares in SI units, every signal treated alike; first and last sample left out.

    Parameters
    ----------
    draws : Draws
        Sets of noise about a flight without gravity gradient, which (19) does not hold.
    noise : Noise
        Level of noise.
    treatments : sequence of Treatment
        Treatments to compare.

    Returns
    -------
    dict of str to Regression
        Estimates by the title of the treatment.
    """
    flight = draws.flight
    truth = np.stack(motion().evaluate(flight.time))
    results = {}
    for treatment in treatments:
        joints = truth + draws.joints(treatment, noise)
        rate = draws.treated(treatment, "rate", noise)
        accel = flight.accel + draws.treated(treatment, "accel", noise)[:, 0]
        estimates = np.stack(
            [
                solve_balance(*Balance(states)(flight.rate + turning[0], turning[1], pulled))
                for states, turning, pulled in zip(joints, rate, accel, strict=True)
            ]
        )
        quantities = np.stack([mass_com_inertia(p) for p in estimates])
        unphysical = [_physical(values) for values in quantities].count(False)
        results[treatment.title] = Regression((quantities - paper.TRUTH) / np.abs(paper.TRUTH), unphysical)
    return results


def attenuation(flight: Flight, noise: Noise) -> Floats:
    """Return the relative errors of the ten quantities that central differences give for large samples, shape (10,)."""
    step = flight.time[1] - flight.time[0]
    balance = Balance(np.stack(motion().evaluate(flight.time)))
    signals = [flight.rate, flight.rate_change, flight.accel]
    base, arm = (part[1:-1] for part in balance(*signals))
    normal, right = np.einsum("tci,tcj->ij", base, base), np.zeros(10)
    true = ets7().link(BASE).inertial.vector
    for index, sd in enumerate((noise.rate, noise.rate / (np.sqrt(2.0) * step), noise.accel)):
        for axis in range(3):
            shifted = [np.array(signal) for signal in signals]
            shifted[index][:, axis] += sd
            psi, arm_part = (after[1:-1] - before for after, before in zip(balance(*shifted), (base, arm), strict=True))
            normal += np.einsum("tci,tcj->ij", psi, psi)
            right += np.einsum("tci,tc->i", psi, psi @ true + arm_part)
    estimate = true - np.linalg.solve(normal, right)
    return (np.asarray(mass_com_inertia(estimate)) - paper.TRUTH) / np.abs(paper.TRUTH)


def solve_balance(base: Floats, arm: Floats) -> Floats:
    """Return the ten linear parameters by least squares, first and last sample left out (`Balance`)."""
    design = base[1:-1].reshape(-1, 10)
    scale = np.linalg.norm(design, axis=0)
    return np.asarray(np.linalg.lstsq(design / scale, -arm[1:-1].ravel())[0] / scale)


def _physical(quantities: Floats) -> bool:
    moments = np.linalg.eigvalsh(inertia_matrix(quantities))
    return bool(quantities[MASS] > 0.0 and moments[0] > 0.0 and moments[2] < moments[0] + moments[1])
