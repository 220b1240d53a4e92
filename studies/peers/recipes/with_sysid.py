"""MuJoCo's toolbox for system identification around a simulation that moves the joints as they were recorded.

The toolbox's own rollout drives joints by forces. Servos stiff enough to follow a recorded motion make accelerations of
their own, which the accelerometer would read; the residual is therefore the user's, with MuJoCo's equations of motion.
"""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
from mujoco import sysid
from scipy.interpolate import UnivariateSpline
from scipy.optimize import approx_fprime

RATE, ACCEL, ENCODER = 1e-5, 1e-5, 1e-6  # noise of the sensors [rad/s, m/s2, rad]
POINT = np.array([0.1, -0.15, 0.3])  # where the accelerometer sits [m]
BASE = "base_link"


def identify(folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return the ten quantities of the base and their standard deviations."""
    spec = mujoco.MjSpec.from_file(str(folder / "robot.urdf"))
    spec.option.gravity = np.zeros(3)
    spec.body(BASE).add_freejoint()
    model = spec.compile()
    data = mujoco.MjData(model)
    recordings = [_read(file) for file in sorted(folder.glob("manoeuvre-*.csv"))]
    body = sysid.body_inertia_param(spec, model, BASE, sysid.InertiaType.Pseudo, modifier=_change)
    params = sysid.ParameterDict({body.name: body})
    for number, (_, _, rate, _) in enumerate(recordings):
        params.add(sysid.Parameter(f"rate {number}", rate[0], rate[0] - 0.01, rate[0] + 0.01))

    def residual(x: np.ndarray, params: sysid.ParameterDict) -> tuple[list, list, list]:
        columns = []
        for column in np.reshape(x, (params.size, -1)).T:
            params.update_from_vector(column)
            changed = sysid.apply_param_modifiers(params, spec)
            parts = []
            for number, (times, joints, rate, accel) in enumerate(recordings):
                first = params[f"rate {number}"].value
                predicted = _simulate(changed, data, times, joints, first)
                parts += [(predicted[:, :3] - rate) / RATE, (predicted[:, 3:] - accel) / ACCEL]
            columns.append(np.concatenate(parts).ravel())
        return [columns[0] if x.ndim == 1 else np.stack(columns, axis=1)], [], []

    optimum, result = sysid.optimize(params, residual, verbose=False)
    covariance, _ = sysid.calculate_intervals(residual(result.x, optimum)[0], result.jac)
    theta = result.x[:10]
    slopes = approx_fprime(theta, _quantities)
    return _quantities(theta), np.sqrt(np.diag(slopes @ covariance[:10, :10] @ slopes.T))


def _change(spec: mujoco.MjSpec, body: sysid.Parameter) -> None:
    """Give the base other parameters; the toolbox leaves an orientation that MuJoCo 4.0.0 does not compile."""
    sysid.apply_body_inertia(spec, BASE, body)
    spec.body(BASE).iquat[:] = (1.0, 0.0, 0.0, 0.0)


def _quantities(theta: np.ndarray) -> np.ndarray:
    """Return mass, centre of mass and inertia about it from the toolbox's ten parameters."""
    inertial = sysid.model_modifier.pi_from_theta(theta)
    mass, lever, matrix = inertial[0], inertial[1:4] / inertial[0], inertial[4:].reshape(3, 3)
    matrix = matrix - mass * (lever @ lever * np.eye(3) - np.outer(lever, lever))
    return np.concatenate([[mass], lever, matrix[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]])


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


def _simulate(
    model: mujoco.MjModel, data: mujoco.MjData, times: np.ndarray, joints: list, rate: np.ndarray
) -> np.ndarray:
    """Return rates and accelerometer readings (T, 6), by classical Runge-Kutta from sample to sample.

    In deep space neither attitude nor velocity changes what the sensors read, so that both stay zero.
    """
    mass, bias = np.zeros((model.nv, model.nv)), np.zeros((model.nv, 1))

    def acceleration(row: int, omega: np.ndarray) -> np.ndarray:
        data.qpos[7:], data.qvel[3:6], data.qvel[6:] = joints[0][row], omega, joints[1][row]
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_fullM(model, data, mass)
        mujoco.mj_rne(model, data, 0, bias)
        return np.linalg.solve(mass[:6, :6], -bias[:6, 0] - mass[:6, 6:] @ joints[2][row])

    omega, rows = rate, []
    for k in range(len(times)):
        first = acceleration(2 * k, omega)
        felt = first[:3] + np.cross(first[3:], POINT) + np.cross(omega, np.cross(omega, POINT))
        rows.append(np.concatenate([omega, felt]))
        if k + 1 < len(times):
            h = times[k + 1] - times[k]
            second = acceleration(2 * k + 1, omega + 0.5 * h * first[3:])
            third = acceleration(2 * k + 1, omega + 0.5 * h * second[3:])
            fourth = acceleration(2 * k + 2, omega + h * third[3:])
            omega = omega + h / 6.0 * (first + 2.0 * second + 2.0 * third + fourth)[3:]
    return np.array(rows)
