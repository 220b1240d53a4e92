"""The linear regressor method (19), with the joint torques (23), which needs differentiated rates.

Rates, accelerations and joint motion are measured, so that every entry of the regressor is noisy. Least squares takes
the entries for exact: errors in variables pull the estimate towards zero. The method is given everything it can use:
the same prior, made normal in the linear parameters; smoothing of the rates by local cubics; and weights from its
residuals.

Where the right side is zero, without torques, the residuals of n equations go with the scale s of all masses, and their
weights make them n times s²; the prior holds s to its own precision P about one. The least of P (s - 1)² + n s² is at
P / (P + n), whatever the noise is: the estimate knows the prior and the number of samples, and falls with every sample.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from scipy.signal import savgol_filter

from bayesid import Manoeuvre, Robot
from bayesid._math.arrays import Floats
from bayesid.inference.unknowns import Unknowns
from bayesid.robot.body_prior import BodyPrior
from bayesid.robot.kinematics import kinematics
from bayesid.robot.regressors import torque_regressor
from studies.common.ets7 import ACCELEROMETER
from studies.whole_system.setting import LOAD, bodies, spreads

__all__ = ["linear_prior", "regress"]

WINDOW, ORDER = 9, 3  # number of samples, and order, of the local polynomials through the rates
ROUNDS = 4  # number of iterations that weight the equations by their residuals; more change the masses by less than 1 %

# speed of a joint above which its torque is used [rad/s]; below it the sign of the friction is not certain
MOVING = 5e-4

FRICTION_PRIOR = (5.0, 50.0)  # standard deviations of the priors of dry and viscous friction [N m, N m s]

# factor on the precision of the load's prior, which made normal in the linear parameters at a width of 100 % would
# exclude a load twice as heavy
VAGUE = 1e-4


def linear_prior(drawings: Robot) -> tuple[Floats, Floats]:
    """Return centre (10 B,) and covariance (10 B, 10 B) of the linear parameters of all bodies under the prior."""
    priors = tuple(BodyPrior(name, drawings.link(name).inertial, width) for name, width in spreads(drawings).items())
    unknowns = Unknowns(priors, (), 1, 0.0, (0.0,))
    centre = jnp.zeros(unknowns.size)
    slope = np.asarray(jax.jacfwd(lambda z: unknowns.values(z).inertial)(centre))
    return np.asarray(unknowns.values(centre).inertial), slope @ slope.T


def regress(manoeuvre: Manoeuvre, drawings: Robot, *, torques: bool) -> tuple[Floats, Floats]:
    """Estimate the linear parameters of all bodies from a manoeuvre, with or without its joint torques.

    Returns
    -------
    estimate, covariance : (10 B,), (10 B, 10 B) arrays
        Estimate, and the covariance that the method itself states.
    """
    recording, joints = manoeuvre.recording, drawings.joints
    time, measured = recording.vector("rate")
    interval = float(np.median(np.diff(time)))
    rate = savgol_filter(measured, WINDOW, ORDER, axis=0)
    change = savgol_filter(measured, WINDOW, ORDER, deriv=1, delta=interval, axis=0)
    felt, point = recording.vector("accel")[1], np.array(ACCELEROMETER)
    origin = felt - np.cross(change, point) - np.cross(rate, np.cross(rate, point))
    state = manoeuvre.motion.evaluate(time)
    moved = kinematics(drawings, state)
    names = bodies(drawings)
    regressor = np.asarray(torque_regressor(drawings, names, moved, rate, change, origin))
    blocks: list[tuple[Floats, Floats]] = [(regressor[:, row], np.zeros(len(time))) for row in range(6)]
    frictions = 0
    if torques:
        speed = state.velocity
        frictions = 2 * len(joints)
        for index, joint in enumerate(joints):
            rubbing = np.zeros((len(time), frictions))
            rubbing[:, 2 * index], rubbing[:, 2 * index + 1] = np.sign(speed[:, index]), speed[:, index]
            _, torque = recording.series(f"torque.{joint.name}")
            moving = np.abs(speed[:, index]) > MOVING
            blocks.append((np.concatenate([regressor[:, 6 + index], rubbing], axis=1)[moving], torque[moving]))
    centre, covariance = linear_prior(drawings)
    count = len(centre)
    precision = np.zeros((count + frictions, count + frictions))
    precision[:count, :count] = np.linalg.inv(covariance)
    load = slice(10 * names.index(LOAD), 10 * names.index(LOAD) + 10)
    precision[load, load] *= VAGUE
    precision[count:, count:] = np.diag(np.tile(np.array(FRICTION_PRIOR) ** -2.0, frictions // 2))
    blocks = [(np.pad(a, ((0, 0), (0, count + frictions - a.shape[1]))), b) for a, b in blocks]
    x = np.concatenate([centre, np.zeros(frictions)])
    start = x.copy()
    for _ in range(ROUNDS):
        normal, right = precision.copy(), precision @ start
        # residuals as bodies of the drawings' total mass would leave them: being lighter must not gain weight
        heavier = start[:count:10].sum() / x[:count:10].sum()
        for a, b in blocks:
            weight = 1.0 / np.var(b - a @ x if b.any() else heavier * (a @ x))
            normal += weight * a.T @ a
            right += weight * a.T @ b
        x = np.linalg.solve(normal, right)
    return x[:count], np.linalg.inv(normal)[:count, :count]
