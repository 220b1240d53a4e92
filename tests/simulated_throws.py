"""Throws of a known body, simulated with SciPy alone and written as the raw counts of the device."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from studies.throws.data import WHEEL_INERTIA
from studies.throws.raw import ACCEL_SCALE, ERPM, RATE_SCALE, SIGNS, Timing

MASS = 0.28
INERTIA = np.array([[2.3e-4, 4e-6, -3e-6], [4e-6, 5.2e-4, 5e-6], [-3e-6, 5e-6, 4.6e-4]])
COM = np.array([-0.002, 0.011, 0.03])
RATE_NOISE, ACCEL_NOISE = 6e-3, 0.15
"""Of one raw value [rad/s, m/s2], white."""


def wheel(time):
    """Speed of the wheel relative to the body [rad/s] and its derivative: idle, run up, run down.

    It idles at a speed that changes: a held reading tells the time of its value by its change alone.
    """
    idle = 200.0 + 300.0 * np.asarray(time)
    up, down = (np.clip(np.asarray(time) - start, 0.0, None) for start in (0.19, 0.37))
    rise, fall = 1.0 - np.exp(-up / 0.055), 1.0 - np.exp(-down / 0.05)
    slope = np.where(up > 0.0, 1270.0 / 0.055 * np.exp(-up / 0.055), 0.0)
    slope = slope - np.where(down > 0.0, 1230.0 / 0.05 * np.exp(-down / 0.05), 0.0)
    return -(idle + 1270.0 * rise - 1230.0 * fall), -(slope + 300.0)


def write_throws(folder: Path, body: str, rates, rng, *, drag=(0.0, 0.0, 0.0), tilt=(0.0, 0.0), shake=0.0) -> None:
    """Write one file for each initial rate [rad/s], with drag coefficients [N m s] and a tilted wheel [rad].

    A force on the x axis of the accelerometer shakes once per turn of the wheel with an amplitude, at 1000 rad/s, of
    ``shake`` [m/s2].
    """
    (folder / "throws").mkdir(parents=True, exist_ok=True)
    axis, brake = np.array([*tilt, 1.0]), np.array(drag)

    def change(time, rate):
        speed, slope = wheel(time)
        momentum = INERTIA @ rate + WHEEL_INERTIA * speed * axis
        torque = -np.cross(rate, momentum) - brake * rate - WHEEL_INERTIA * slope * axis
        return np.linalg.solve(INERTIA, torque)

    clock = np.arange(-0.1, 0.6, 1.0 / 4030.0)
    for index, rate in enumerate(rates):
        options = {"method": "DOP853", "rtol": 1e-9, "atol": 1e-9, "max_step": 0.005}
        rate = solve_ivp(change, (clock[0], clock[-1]), rate, t_eval=clock, **options).y.T
        slope = np.array([change(t, w) for t, w in zip(clock, rate, strict=True)])
        force = -np.cross(slope, COM) - np.cross(rate, np.cross(rate, COM))
        speed = np.abs(wheel(clock)[0])
        turn = np.cumsum(speed) * (clock[1] - clock[0])
        force[:, 0] += shake * (speed / 1000.0) ** 2 * np.cos(turn)
        columns = [1e6 * clock]
        for values, noise, scale in ((rate, RATE_NOISE, RATE_SCALE), (force, ACCEL_NOISE, ACCEL_SCALE)):
            seen = (values + noise * rng.normal(size=values.shape)) * SIGNS / scale
            columns += list(np.round(seen).T)
        table = np.column_stack([*columns, _held(clock)])
        file = folder / "throws" / f"{body}_LOG{index + 1:05}.csv"
        np.savetxt(file, table, delimiter=",", header="t_us,gx,gy,gz,ax,ay,az,erpm", comments="", fmt="%.10g")


def _held(clock):
    """Reading of the wheel's speed, new after every electrical period and held until the next."""
    timing, time, reading = Timing(), clock[0], np.zeros(len(clock))
    late = 0.5 * (clock[1] - clock[0])  # of a reading until the next raw sample, on average
    while time < clock[-1]:
        period = 2.0 * np.pi / (ERPM * abs(wheel(time)[0]) / timing.wheel_count)
        at = time + late - timing.delay - timing.delay_periods * period
        reading[clock >= time] = np.round(abs(wheel(at)[0]) / timing.wheel_count)
        time += period
    return reading
