"""SciPy's least squares around a step-by-step simulation with Pinocchio, as an ordinary user writes it."""

from pathlib import Path

import numpy as np
import pinocchio as pin
from scipy.interpolate import UnivariateSpline
from scipy.optimize import least_squares

RATE, ACCEL, ENCODER = 1e-5, 1e-5, 1e-6  # noise of the sensors [rad/s, m/s2, rad]
POINT = np.array([0.1, -0.15, 0.3])  # where the accelerometer sits [m]


def identify(folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return the ten quantities of the base and their standard deviations."""
    model = pin.buildModelFromUrdf(str(folder / "robot.urdf"), pin.JointModelFreeFlyer())
    model.gravity.setZero()
    data = model.createData()
    recordings = [_read(file) for file in sorted(folder.glob("manoeuvre-*.csv"))]
    base = model.inertias[1]
    tensor = base.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    start = np.concatenate([[base.mass], base.lever, tensor, *(rate[0] for _, _, rate, _ in recordings)])

    def residuals(x: np.ndarray) -> np.ndarray:
        xx, yy, zz, xy, xz, yz = x[4:10]
        matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        model.inertias[1] = pin.Inertia(x[0], x[1:4], matrix)
        parts = []
        for (times, joints, rate, accel), first in zip(recordings, x[10:].reshape(-1, 3), strict=True):
            predicted = _simulate(model, data, times, joints, first)
            parts += [(predicted[:, :3] - rate) / RATE, (predicted[:, 3:] - accel) / ACCEL]
        return np.concatenate(parts).ravel()

    fit = least_squares(residuals, start, x_scale="jac", method="lm")
    variance, jac = 2.0 * fit.cost / (len(fit.fun) - len(fit.x)), np.asarray(fit.jac)
    covariance = variance * np.linalg.inv(jac.T @ jac)
    return fit.x[:10], np.sqrt(np.diag(covariance))[:10]


def _read(file: Path) -> tuple:
    """Return times, smoothed joint motion with two derivatives at samples and midpoints, rates and accelerations."""
    table = np.genfromtxt(file, delimiter=",", names=True, deletechars="")
    times, names = table["time"], table.dtype.names or ()
    both = np.linspace(times[0], times[-1], 2 * len(times) - 1)
    columns = [table[name] for name in names if name.startswith("position.")]
    splines = [UnivariateSpline(times, q, w=np.full(len(times), 1.0 / ENCODER), k=5, s=len(times)) for q in columns]
    joints = [np.stack([spline.derivative(n)(both) for spline in splines], axis=1) for n in range(3)]
    rate, accel = (np.stack([table[f"{kind}.{axis}"] for axis in "xyz"], axis=1) for kind in ("rate", "accel"))
    return times, joints, rate, accel


def _simulate(model: pin.Model, data: pin.Data, times: np.ndarray, joints: list, rate: np.ndarray) -> np.ndarray:
    """Return rates and accelerometer readings (T, 6), by classical Runge-Kutta from sample to sample."""
    q, v = pin.neutral(model), np.zeros(model.nv)

    def acceleration(row: int, twist: np.ndarray) -> np.ndarray:
        q[7:], v[:6], v[6:] = joints[0][row], twist, joints[1][row]
        mass = pin.crba(model, data, q)
        mass = np.triu(mass) + np.triu(mass, 1).T
        bias = pin.nonLinearEffects(model, data, q, v)
        return np.linalg.solve(mass[:6, :6], -bias[:6] - mass[:6, 6:] @ joints[2][row])

    twist, rows = np.concatenate([np.zeros(3), rate]), []
    for k in range(len(times)):
        first = acceleration(2 * k, twist)
        omega = twist[3:]
        felt = first[:3] + np.cross(omega, twist[:3]) + np.cross(first[3:], POINT)
        rows.append(np.concatenate([omega, felt + np.cross(omega, np.cross(omega, POINT))]))
        if k + 1 < len(times):
            h = times[k + 1] - times[k]
            second = acceleration(2 * k + 1, twist + 0.5 * h * first)
            third = acceleration(2 * k + 1, twist + 0.5 * h * second)
            fourth = acceleration(2 * k + 2, twist + h * third)
            twist = twist + h / 6.0 * (first + 2.0 * second + 2.0 * third + fourth)
    return np.array(rows)
