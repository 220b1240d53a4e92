"""How well readings follow from the balance of momentum, with the unknown bodies fitted; nothing is integrated.

Without torque from outside the angular momentum is constant in space, ``I w + l + h = R'H``, and the rate follows at
every instant from the attitude reached by then; its derivative and the acceleration of the accelerometer follow by
differentiating. Everything is linear in the moments of the bodies (`bayesid.robot.composite_tables`), which have their
log-Cholesky prior. Beside them the momentum ``H`` may drift, and constant errors of the sensors are allowed for.

The readings of each sensor may miss the prediction by an unknown share, whose size is maximised over. So the evidence
of a hypothesis is relative to a generic misfit: what no hypothesis explains favours none.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from bayesid._math.arrays import Floats
from bayesid.inference.conventions.readings_on_grid import GridSensor, ReadingsOnGrid
from bayesid.robot.body_prior import BodyPrior
from bayesid.robot.composite_tables import ENTRIES, composite_rows, link_table
from bayesid.robot.inertial_parameters import BASIS
from bayesid.robot.kinematics import kinematics
from bayesid.robot.log_cholesky import upper_cholesky
from bayesid.robot.robot import Robot
from bayesid.simulation.sensors import SensorKind

__all__ = ["BalanceFit", "MomentumBalance", "mean_between"]

GENERIC = 0.02  # share of the readings by which any simulation may miss them
INDEPENDENT = 10.0  # number of instants at which errors of a simulation, which last for long, count as independent
DRIFT = 0.2  # change of the momentum within a recording, relative to that of the arm, by torques that nobody knows
START_ERROR = 0.1  # difference of the stated attitude from the first measured one that is no convention [rad]
LONGEST_STEP = 1.5  # largest change of a coordinate of the fit in one iteration
STEP = 1e-4  # of the finite differences in standard-normal coordinates
NUISANCES = 12  # momentum and its drift, constant errors of both sensors

_INVERSE_BASIS = np.linalg.pinv(BASIS.reshape(10, 16).T)


class BalanceFit(NamedTuple):
    """The best fit of one hypothesis.

    Attributes
    ----------
    log_evidence : float
        Profile over the misfit of each sensor, with the prior of the unknowns.
    misfit : dict of str to float
        Mean square of the residual of each sensor, with its floor.
    floors : dict of str to float
        What it is at least.
    signals : dict of str to float
        Mean square of what there is to explain, about its mean.
    gains : dict of str to float
        Log evidence that would be gained if nothing were left unexplained.
    z : (p,) array
        Coordinates of the fit.
    """

    log_evidence: float
    misfit: dict[str, float]
    floors: dict[str, float]
    signals: dict[str, float]
    gains: dict[str, float]
    z: Floats


@dataclass(frozen=True)
class MomentumBalance:
    """Balance of momentum of one robot with some unknown bodies.

    Attributes
    ----------
    robot : Robot
    bodies : tuple of BodyPrior
        Bodies to fit, with their priors.
    rest : float
        Prior standard deviation of the initial rate of the base [rad/s].
    uncertainty : float
        Relative uncertainty of the other links.
    """

    robot: Robot
    bodies: tuple[BodyPrior, ...]
    rest: float
    uncertainty: float = 0.0

    @cached_property
    def _factors(self) -> Floats:
        return np.stack([upper_cholesky(body.centre.pseudo_inertia) for body in self.bodies])

    def moments(self, z: Floats) -> Floats:
        """Return the inertial parameters of the bodies at coordinates (B, 10 K), shape (B, 10 K)."""
        spread = np.repeat([body.spread for body in self.bodies], 10)
        alpha, d1, d2, d3, s12, s23, s13, t1, t2, t3 = np.moveaxis((z * spread).reshape(len(z), -1, 10), -1, 0)
        u = np.zeros((*alpha.shape, 4, 4))
        for index, d in enumerate((d1, d2, d3)):
            u[..., index, index] = np.exp(d)
        u[..., 3, 3] = 1.0
        for (row, column), value in zip(
            ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)), (s12, s23, s13, t1, t2, t3), strict=True
        ):
            u[..., row, column] = value
        factor = self._factors @ (np.exp(alpha)[..., None, None] * u)
        pseudo = factor @ np.swapaxes(factor, -1, -2)
        return (pseudo.reshape(*alpha.shape, 16) @ _INVERSE_BASIS.T).reshape(len(z), -1)

    def problem(self, readings: ReadingsOnGrid) -> BalanceProblem:
        """Return the fit to the readings of one hypothesis, ready to be solved."""
        motion = kinematics(self.robot, readings.joints)
        names = [body.name for body in self.bodies]
        tables = [link_table(self.robot, name, motion) for name in names]
        table = np.concatenate(tables, axis=2) if tables else np.zeros((len(readings.time), 28, 0))
        return BalanceProblem(self, readings, composite_rows(self.robot, motion, names), table)


@dataclass(frozen=True)
class BalanceProblem:
    """Fit of one hypothesis.

    Attributes
    ----------
    balance : MomentumBalance
    readings : ReadingsOnGrid
    rows : (n, 28) array
        Moments of the known bodies.
    tables : (n, 28, 10 K) array
        Coefficients of the unknown ones.
    """

    balance: MomentumBalance
    readings: ReadingsOnGrid
    rows: Floats
    tables: Floats

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return self.tables.shape[2] + NUISANCES

    def fit(self, iterations: int, start: Floats | None = None) -> BalanceFit:
        """Return the fit after some Gauss-Newton iterations, each with the misfit that the last one left.

        Parameters
        ----------
        iterations : int
        start : (p,) array, optional
        """
        z = np.zeros(self.size) if start is None else start
        best: BalanceFit | None = None
        for iteration in range(iterations + 1):
            points = np.concatenate([z[None], z + STEP * np.eye(self.size)[:-6]])
            residuals = self._residuals(points)
            misfit = {name: float((r[0] ** 2).mean()) + self._floors[name] for name, r in residuals.items()}
            floors, signals = ({name: part[name] for name in misfit} for part in (self._floors, self._signals))
            here = BalanceFit(self._evidence(misfit, z), misfit, floors, signals, self._gains(misfit), z)
            if best is None or here.log_evidence > best.log_evidence:
                best = here
            elif iteration and np.linalg.norm(z - best.z) > 1e-3:
                z = 0.5 * (z + best.z)  # too long a step
                continue
            if iteration == iterations:
                break
            hessian, gradient = np.eye(self.size), z.copy()
            for name, r in residuals.items():
                slope = np.concatenate([(r[1:] - r[0]) / STEP, self._constant(name, r.shape[1])])
                weight = self._counts[name] / (len(r[0]) * misfit[name])
                hessian += weight * slope @ slope.T
                gradient += weight * slope @ r[0]
            step = -np.linalg.solve(hessian, gradient)
            z = z + step * min(1.0, LONGEST_STEP / float(np.abs(step).max() + 1e-300))
        assert best is not None
        return best

    def _gains(self, misfit: dict[str, float]) -> dict[str, float]:
        return {
            name: 0.5 * self._counts[name] * float(np.log(value / self._floors[name])) for name, value in misfit.items()
        }

    def _evidence(self, misfit: dict[str, float], z: Floats) -> float:
        total = -0.5 * float(z @ z)
        for name, value in misfit.items():
            unit = self.readings.sensors[SensorKind.of(name)].unit if name in ("rate", "accel") else 1.0
            total -= 0.5 * self._counts[name] * float(np.log(value / unit**2))
        return total

    def _constant(self, name: str, samples: int) -> Floats:
        """Return the slopes of a residual (6, samples) with the constant errors of rate sensor and accelerometer."""
        slopes = np.zeros((6, samples // 3, 3))
        place, sign = {"rate": (0, -1.0), "turning": (0, 1.0), "accel": (1, -1.0)}.get(name, (0, 0.0))
        for axis in range(3):
            slopes[3 * place + axis, :, axis] = sign * self._scales[6 + 3 * place]
        return slopes.reshape(6, samples)

    @cached_property
    def _counts(self) -> dict[str, float]:
        """Number of independent readings of each sensor."""
        counts = {kind.value: 3.0 * INDEPENDENT for kind in self.readings.sensors}
        turns = len(self.readings.turns[0])
        if turns:
            counts["attitude"] = 3.0 * min(INDEPENDENT, float(turns))
        if turns and SensorKind.RATE in self.readings.sensors:
            counts["turning"] = counts["attitude"]
        if self.readings.begins:
            counts["start"] = 12.0
        return counts

    @cached_property
    def _floors(self) -> dict[str, float]:
        """Mean square that a residual has at least, by noise and by what any simulation lacks."""
        share = GENERIC**2 + self.balance.uncertainty**2
        floors = {
            kind.value: sensor.sigma**2 + share * self._signals[kind.value]
            for kind, sensor in self.readings.sensors.items()
        }
        pairs = self.readings.turns[0]
        if len(pairs):
            noise = np.sqrt(2.0) * self.readings.attitude_sigma / float(np.median(np.diff(pairs, axis=1)))
            floors["attitude"] = noise**2 + share * self._signals["attitude"]
            floors["turning"] = floors["attitude"] + floors.get("rate", 0.0)
        floors["start"] = START_ERROR**2 + self.readings.start_sigma**2
        return floors

    @cached_property
    def _signals(self) -> dict[str, float]:
        """Variance of the readings of each sensor, of the axis where it is largest."""
        signals = {
            kind.value: float(sensor.values[sensor.present].var(axis=0).max())
            for kind, sensor in self.readings.sensors.items()
        }
        pairs, rate = self.readings.turns
        if len(pairs):
            signals["attitude"] = signals["turning"] = float(rate.var(axis=0).max())
        return signals | {"start": 0.0}

    @cached_property
    def _scales(self) -> Floats:
        """Standard deviations of the nuisances: momentum, its drift, and constant errors of the sensors."""
        centre = self._composite(np.zeros((1, self.tables.shape[2])))
        arm = float(np.sqrt((centre.spin[0] ** 2).sum(axis=-1).mean())) + 1e-12
        inertia = float(np.trace(centre.inertia[0].mean(axis=0))) / 3.0
        fastest = max((float(np.abs(sensor.in_base).max()) for sensor in self._of(SensorKind.RATE)), default=0.0)
        start = 0.0 if self.balance.rest == 0.0 else inertia * max(self.balance.rest, 3.0 * fastest)
        errors = [
            0.0 if not sensor else 3.0 * sensor[0].unit * kind.instrument.bias_sigma
            for kind, sensor in ((kind, self._of(kind)) for kind in (SensorKind.RATE, SensorKind.ACCEL))
        ]
        return np.repeat([start + GENERIC * arm, DRIFT * arm, *errors], 3)

    def _of(self, kind: SensorKind) -> list[GridSensor]:
        return [self.readings.sensors[kind]] if kind in self.readings.sensors else []

    def _composite(self, z: Floats) -> _Composite:
        entries = (
            self.rows + np.moveaxis(self.tables @ self.balance.moments(z).T, -1, 0) if z.shape[1] else self.rows[None]
        )
        return _Composite(entries)

    def _residuals(self, z: Floats) -> dict[str, Floats]:
        """Return the residuals of all sensors at points (B, p), each of shape (B, samples)."""
        bodies, nuisance = z[:, :-NUISANCES], z[:, -NUISANCES:] * self._scales
        start, drift, rate_error, accel_error = (nuisance[:, None, 3 * k : 3 * k + 3] for k in range(4))
        composite, seen = self._composite(bodies), self.readings
        share = ((seen.time - seen.time[0]) / (seen.time[-1] - seen.time[0]))[:, None]
        about_centre = seen.torque - _cross(composite.centre[0], seen.force)
        pushed = _accumulated(seen.time, np.einsum("tij,tj->ti", seen.turned, about_centre))
        turned = start + drift * share + pushed
        momentum = np.einsum("tij,bti->btj", seen.turned, turned)
        rate = _times(composite.inverse, momentum - seen.wheels - composite.spin)
        result: dict[str, Floats] = {}
        if (gyro := seen.sensors.get(SensorKind.RATE)) is not None:
            miss = (gyro.in_base - rate - rate_error)[:, gyro.present]
            result["rate"] = miss.reshape(len(z), -1)
        if (accelerometer := seen.sensors.get(SensorKind.ACCEL)) is not None:
            expected = composite.acceleration(
                rate, momentum, seen.torque - seen.wheel_torque, seen.force, accelerometer.position
            )
            miss = (accelerometer.in_base - expected - accel_error)[:, accelerometer.present]
            result["accel"] = miss.reshape(len(z), -1)
        pairs, turning = seen.turns
        if len(pairs):
            mean = mean_between(seen.time, rate, pairs)
            result["attitude"] = (turning - mean).reshape(len(z), -1)
            if gyro is not None:
                mean = mean_between(seen.time, gyro.in_base[None] - rate_error, pairs)
                result["turning"] = (turning - mean).reshape(len(z), -1)
        if seen.begins:
            off = (Rotation.from_quat(seen.start).inv() * Rotation.from_quat(seen.attitude[0])).as_rotvec()
            result["start"] = np.broadcast_to(off, (len(z), 3))
        return result


class _Composite:
    """Moments of all bodies in base axes about their centre of mass, at B points and n instants."""

    def __init__(self, entries: Floats) -> None:
        entry = {name: entries[..., columns] for name, columns in ENTRIES.items()}
        mass = entry["mass"]
        self.mass, self.first, self.flow, self.surge = (
            mass,
            entry["first"],
            entry["first_rate"],
            entry["first_acceleration"],
        )
        centre = self.first / mass
        self.centre = centre
        second, second_rate = _symmetric(entry["second"]), _symmetric(entry["second_rate"])
        outer = self.first[..., :, None] * self.flow[..., None, :]
        self.inertia = _inertia(second - centre[..., :, None] * self.first[..., None, :])
        self.inertia_rate = _inertia(second_rate - (outer + np.swapaxes(outer, -1, -2)) / mass[..., None])
        self.inverse = _inverse(self.inertia)
        self.spin = entry["spin"] - _cross(centre, self.flow)
        self.spin_rate = entry["spin_rate"] - _cross(centre, self.surge)

    def acceleration(self, rate: Floats, momentum: Floats, torque: Floats, force: Floats, point: Floats) -> Floats:
        """Return the specific force at a point of the base (B, n, 3)."""
        about_centre = torque - _cross(self.centre, force)
        change = about_centre - _cross(rate, momentum) - _times(self.inertia_rate, rate) - self.spin_rate
        turning = _times(self.inverse, change)
        lever = point - self.centre
        pushed = force / self.mass - self.surge / self.mass
        return (
            pushed
            - 2.0 * _cross(rate, self.flow / self.mass)
            + _cross(turning, lever)
            + _cross(rate, _cross(rate, lever))
        )


def _cross(a: Floats, b: Floats) -> Floats:
    return a[..., [1, 2, 0]] * b[..., [2, 0, 1]] - a[..., [2, 0, 1]] * b[..., [1, 2, 0]]


def _symmetric(upper: Floats) -> Floats:
    """Return symmetric matrices of xx, yy, zz, xy, xz, yz."""
    return upper[..., [[0, 3, 4], [3, 1, 5], [4, 5, 2]]]


def _inertia(second: Floats) -> Floats:
    return np.trace(second, axis1=-2, axis2=-1)[..., None, None] * np.eye(3) - second


def _inverse(matrix: Floats) -> Floats:
    """Return the inverses of symmetric matrices, by their adjugates."""
    first, second = matrix[..., 0, :], matrix[..., 1, :]
    columns = (_cross(second, matrix[..., 2, :]), _cross(matrix[..., 2, :], first), _cross(first, second))
    return np.stack(columns, axis=-1) / (first * columns[0]).sum(axis=-1)[..., None, None]


def _times(matrix: Floats, vector: Floats) -> Floats:
    return np.asarray(np.einsum("...ij,...j->...i", matrix, vector))


def _accumulated(time: Floats, values: Floats) -> Floats:
    """Return the integral of values (n, 3) from the first time on."""
    steps = 0.5 * (values[1:] + values[:-1]) * np.diff(time)[:, None]
    return np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])


def mean_between(time: Floats, rate: Floats, pairs: Floats) -> Floats:
    """Return the means of rates between pairs of times, shape (B, m, 3) [rad/s].

    Parameters
    ----------
    time : (n,) array
        [s]
    rate : (B, n, 3) array
        [rad/s]
    pairs : (m, 2) array
        [s]
    """
    steps = 0.5 * (rate[:, 1:] + rate[:, :-1]) * np.diff(time)[:, None]
    total = np.concatenate([np.zeros((len(rate), 1, 3)), np.cumsum(steps, axis=1)], axis=1)

    def at(when: Floats) -> Floats:
        left = np.clip(np.searchsorted(time, when) - 1, 0, len(time) - 2)
        share = np.clip((when - time[left]) / (time[left + 1] - time[left]), -1.0, 2.0)[:, None]
        return total[:, left] + share * (total[:, left + 1] - total[:, left])

    return (at(pairs[:, 1]) - at(pairs[:, 0])) / np.diff(pairs, axis=1)
