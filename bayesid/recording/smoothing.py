"""Smoothing spline of measured joint motion, as the posterior of a Gauss-Markov process.

The joint's position is an integrated Wiener process: its ``order``-th derivative is white noise. The posterior mean
given the samples is the smoothing spline of degree ``2 order - 1`` (Wahba 1978), and the posterior covariance is what
the likelihood needs: the uncertainty of velocity and acceleration with their correlation in time. The order, the
intensity of the process, and any noise level the user did not declare, maximise the marginal likelihood. All algebra
is banded. Instants at which the acceleration or the jerk jumps, and intensities that change along the recording, are
found elsewhere (`bayesid.recording.jumps`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy.linalg as sla
from scipy.interpolate import PPoly
from scipy.optimize import minimize, minimize_scalar
from scipy.sparse import csr_array

from bayesid._math.arrays import Floats, Integers
from bayesid.recording.blocks import Blocks
from bayesid.recording.integrated_process import IntegratedProcess, Jump, covariances_by_distance
from bayesid.recording.lattice import lattice_step, mean_deviation

__all__ = ["EXTENDED", "ORDERS", "JointSamples", "SmoothedJoint", "smooth"]


ORDERS = (4, 3, 5)
"""Orders of the derivative that may be white noise, of which the marginal likelihood chooses one: 3 gives the quintic
spline, the roughest with a continuous acceleration, 5 leaves a fiftieth of its error on smooth motion, and 6 would need
square-root algebra."""

# information on a jump over that on it if the process were observed, below which it is lost in rounding
RELIABLE = 1e-6
# steps within which a process leaves a polynomial that is rough enough for the information on a jump, which grows with
# the fifth power of their number, not to be lost in rounding
HORIZON = 3.0
# sample intervals by which the smoothed motion is extended at most beyond its samples
EXTENDED = 3.0
# fraction of the median step below which two sample times share a node, because the algebra needs separate nodes
SNAP = 0.02
# Decrease of the negative log posterior below which the states are as exact as the samples ask, and most steps till
# then. Positions of 1 rad carry noise of 1e-6, and a step half as long as the others costs four digits with order 5.
REFINED = 1e-6
MOST_REFINEMENTS = 20

MOST_EVALUATIONS = 100
"""Largest number of evaluations of the likelihood per unknown in a fit with undeclared noise; most take 20 to 50."""

FINEST = 2.0**-32
"""Smallest noise of readings relative to the largest of them, where it is estimated: no encoder has more bits."""


@dataclass(frozen=True)
class JointSamples:
    """Samples of one derivative of a joint's position.

    Parameters
    ----------
    derivative : int
        Order of the derivative: 0 for position, 1 for velocity, 2 for acceleration.
    time, value : (n,) array
        Times [s] and samples.
    sigma : float, optional
        Standard deviation of the white noise of the samples, estimated where it is None.
    means : BlockMeans, optional
        Samples of which these are the means over blocks, in which case ``sigma`` is that of those.
    """

    derivative: int
    time: Floats
    value: Floats
    sigma: float | None
    means: BlockMeans | None = None

    @property
    def every_sample(self) -> JointSamples:
        """The samples before they were averaged."""
        return self if self.means is None else self.means.samples

    @property
    def relative(self) -> Floats:
        """Standard deviation of each value over that of a sample, (n,)."""
        return np.ones(len(self.time)) if self.means is None else self.means.relative

    def of_course(self, course: Callable[[Floats], Floats]) -> JointSamples:
        """Return the samples of another course of the position, averaged over the same blocks.

        Parameters
        ----------
        course : callable
            Position, velocity and acceleration of the course, (3, n), at some times (n,).
        """
        if self.means is None:
            return replace(self, value=course(self.time)[self.derivative])
        return replace(self, value=self.means.blocks.mean(course(self.means.samples.time)[self.derivative]))

    def reduced(self, per_second: float) -> JointSamples:
        """Return means of the samples over blocks; the samples themselves where they are no faster than these.

        Parameters
        ----------
        per_second : float
            Least number of blocks a second; 0 keeps every sample.
        """
        blocks = Blocks.of(self.time, per_second)
        if not blocks.reduced:
            return self
        value, step = blocks.mean(self.value), lattice_step(self.value)
        sigma = (step or 1.0) / math.sqrt(12.0) if self.sigma is None else self.sigma
        apart = self.time - np.repeat(blocks.time, blocks.count)
        moments = np.stack([blocks.mean(apart**power) for power in range(5)], axis=1)
        means = BlockMeans(self, blocks, moments, mean_deviation(blocks, value, sigma, step))
        return JointSamples(self.derivative, blocks.time, value, self.sigma, means)


@dataclass(frozen=True)
class BlockMeans:
    """What is known of the samples of a joint that were averaged over blocks.

    Parameters
    ----------
    samples : JointSamples
    blocks : Blocks
    moments : (n, 5) array
        Mean powers 0 to 4 of the samples' times since the mean time of their block [s^power].
    relative : (n,) array
        Standard deviation of each mean over that of a sample.
    """

    samples: JointSamples
    blocks: Blocks
    moments: Floats
    relative: Floats


@dataclass(frozen=True)
class SmoothedJoint:
    """Posterior of one joint's motion."""

    nodes: Floats
    states: Floats  #: derivatives (n, order) in scaled time
    scale: float  #: unit of the scaled time [s]
    factor: Floats  #: banded Cholesky factor of the posterior precision in scaled time
    sigmas: tuple[float, ...]  #: standard deviation of the noise of each series of samples, declared or estimated
    declared: tuple[bool, ...]  #: whether the user declared the noise of each series
    order: int  #: order of the derivative of the position that is white noise
    intensity: float  #: square root of the spectral density of that derivative
    log_likelihood: float
    #: Chi-square of the samples and their number. A ratio well above one says that the spline does not follow them.
    chi2: float
    samples: int
    series: tuple[JointSamples, ...]  #: samples
    start: float | None  #: exact position at time 0, if known
    jumps: tuple[Jump, ...]  #: jumps of the acceleration or the jerk that the process has
    roughness: Floats | None  #: (n - 1,) factor on the variance of the process in each step between nodes; None for one

    def with_noise(self, factor: float) -> SmoothedJoint:
        """Smooth the samples anew with the declared noise times a factor; estimated noise is estimated again."""
        series = [replace(one, sigma=None if one.sigma is None else factor * one.sigma) for one in self.series]
        return smooth(series, self.start, self.jumps, self._orders(ORDERS), self.roughness)

    def with_jumps(self, jumps: Sequence[Jump], orders: Sequence[int]) -> SmoothedJoint:
        """Smooth the samples anew with other jumps of the process, of one of some orders.

        Where the roughness has been found, the order stays that for which it was found.

        Parameters
        ----------
        jumps : sequence of Jump
        orders : sequence of int
            Orders of the derivative that may be white noise.
        """
        return smooth(list(self.series), self.start, jumps, self._orders(orders), self.roughness)

    def with_roughness(self, roughness: Floats) -> SmoothedJoint:
        """Smooth the samples anew with factors (n - 1,) on the variance of the process in each step."""
        problem, sigmas = replace(self, roughness=roughness)._problem
        log_likelihood, states, factor, chi2 = problem.solve(self.scaled_intensity, sigmas)
        return replace(
            self, roughness=roughness, log_likelihood=log_likelihood, states=states, factor=factor, chi2=chi2
        )

    def of_course(self, course: Callable[[Floats], Floats]) -> SmoothedJoint:
        """Return what the smoothing, which is linear in the samples, makes of another course of the position.

        Parameters
        ----------
        course : callable
            Position, velocity and acceleration of the course, (3, n), at some times (n,).
        """
        series = tuple(one.of_course(course) for one in self.series)
        start = None if self.start is None else float(course(np.zeros(1))[0, 0])
        other = replace(self, series=series, start=start)
        problem, sigmas = other._problem
        return replace(other, states=problem.solve(self.scaled_intensity, sigmas)[1])

    def _orders(self, orders: Sequence[int]) -> Sequence[int]:
        return orders if self.roughness is None else (self.order,)

    def process(self, jumps: Sequence[Jump]) -> IntegratedProcess:
        """Return the process with some jumps, in scaled time."""
        return IntegratedProcess(np.diff(self.nodes / self.scale), self.order, jumps, self.roughness)

    @property
    def is_constant(self) -> bool:
        """Whether all samples say the same position and no speed."""
        return all(np.ptp(one.value) == 0.0 and (one.derivative == 0 or one.value[0] == 0.0) for one in self.series)

    @property
    def scaled_intensity(self) -> float:
        """Intensity of the process in scaled time."""
        return self.intensity * self.scale ** (self.order - 0.5)

    def jump_scores(self) -> tuple[Floats, Floats]:
        """Return score and information of a jump of each state at the end of each step, both (n - 1, order).

        They are in scaled time, at a jump of zero, and marginal over everything else: the auxiliary residual of the
        increment is the score over the root of the information (de Jong and Penzer 1998). Where a process that hardly
        moves leaves the information to rounding, a rougher one takes its place, whose residuals are smaller. What is
        lost even so has no information.
        """
        score, information = self._scores(self.scaled_intensity, self.states, self.factor)
        lost = information == 0.0
        if lost.any():
            problem, sigmas = self._problem
            rougher = problem.intensity_over(HORIZON, sigmas)
            if rougher > self.scaled_intensity:
                _, states, factor, chi2 = problem.solve(rougher, sigmas)
                if np.isfinite(chi2):
                    others = self._scores(rougher, states, factor)
                    score, information = np.where(lost, others[0], score), np.where(lost, others[1], information)
        return score, information

    def _scores(self, intensity: float, states: Floats, factor: Floats) -> tuple[Floats, Floats]:
        process = self.process(self.jumps)
        precision, _ = process.precision(intensity)
        covariance = self._increment_covariance(process, factor)
        score = np.einsum("kij,kj->ki", precision, process.increments(states))
        whole = np.diagonal(precision, axis1=1, axis2=2)
        information = whole - np.diagonal(precision @ covariance @ precision, axis1=1, axis2=2)
        return score, np.where(information > RELIABLE * whole, information, 0.0)

    def increment_energies(self) -> tuple[Floats, Floats]:
        """Return the energy of the increment of each step and its degrees of freedom in the samples, both (n - 1,).

        The energy is the squared increment in units of its prior covariance. The degrees of freedom are what the
        samples take off the trace of that covariance, and the mean of the energy where the process is right. Both are
        zero where rounding leaves nothing of them.
        """
        process = self.process(self.jumps)
        precision, _ = process.precision(self.scaled_intensity)
        increments = process.increments(self.states)
        energy = np.einsum("ki,kij,kj->k", increments, precision, increments)
        covariance = self._increment_covariance(process, self.factor)
        freedom = self.order - np.einsum("kij,kji->k", precision, covariance)
        known = freedom > RELIABLE * self.order
        return np.where(known, energy, 0.0), np.where(known, freedom, 0.0)

    def _increment_covariance(self, process: IntegratedProcess, factor: Floats) -> Floats:
        """Return the posterior covariance of the increment of each step, (n - 1, order, order)."""
        blocks = covariances_by_distance(factor, self.order)
        of_node, to_next = next(blocks), next(blocks)
        lifted = process.transition @ to_next
        covariance = of_node[1:] - lifted - lifted.transpose(0, 2, 1)
        return np.asarray(covariance + process.transition @ of_node[:-1] @ process.transition.transpose(0, 2, 1))

    @property
    def _problem(self) -> tuple[_Problem, list[float]]:
        """Normal equations, and the standard deviation of each series in scaled time."""
        series = [_Observed.of(one, self.nodes, self.scale, self.order) for one in self.series]
        problem = _Problem(self.nodes / self.scale, series, self.start, self.order, self.jumps, self.roughness)
        return problem, [
            sigma * self.scale**one.derivative for sigma, one in zip(self.sigmas, self.series, strict=True)
        ]

    @property
    def jump_intervals(self) -> Floats:
        """Begin and end of the steps in which each jump may lie, (n, 2) [s]."""
        ends = [(jump.steps.start, jump.steps.stop) for jump in self.jumps]
        return self.nodes[np.array(ends, dtype=np.intp).reshape(-1, 2)]

    @property
    def _units(self) -> Floats:
        return self.scale ** -np.arange(self.order, dtype=float)

    def evaluate(self, time: Floats) -> Floats:
        """Return position, velocity and acceleration at the times (T,), shape (3, T)."""
        return np.stack([spline(time) for spline in self._splines])

    def derivatives(self, time: Floats, count: int) -> Floats:
        """Return the position and its first derivatives, (count, T), held beyond a few steps outside of the samples.

        Parameters
        ----------
        time : (T,) array
            Times [s].
        count : int
            Number of derivatives, the position counted.
        """
        inside = np.clip(time, self.nodes[0] - EXTENDED * self.scale, self.nodes[-1] + EXTENDED * self.scale)
        return np.stack([self._splines[0](inside, nu=order) for order in range(count)])

    @cached_property
    def _splines(self) -> tuple[PPoly, PPoly, PPoly]:
        length, power = np.diff(self.nodes)[:, None], np.arange(2 * self.order)
        ends = self.states * self._units
        states = np.concatenate([ends[:-1], ends[1:]], axis=1) * length ** np.tile(np.arange(self.order), 2)
        powers = states @ np.linalg.inv(_derivatives_at_ends(self.order)).T / length**power
        spline = PPoly(powers.T[::-1], self.nodes, extrapolate=True)
        return spline, spline.derivative(1), spline.derivative(2)

    def lag_covariance(self, time: Floats, lags: int) -> Floats:
        """Return the covariance of the errors of position, velocity and acceleration with those at earlier times.

        Between nodes the curve is a polynomial of the states on both sides, and so is its error.

        Parameters
        ----------
        time : (T,) array
            Times [s], increasing.
        lags : int
            Largest number of places in ``time`` between an instant and an earlier one.

        Returns
        -------
        (lags + 1, T, 3, 3) array
            Covariance ``[l, i]`` of the three errors at ``time[i]`` with those at ``time[i - l]``, zero where there
            is no such time.
        """
        key = (time.tobytes(), lags)
        if key not in self._last_covariance:  # the same times are asked for whenever noise is linearised anew
            self._last_covariance.clear()
            self._last_covariance[key] = self._lag_covariance(time, lags)
        return self._last_covariance[key]

    @cached_property
    def _last_covariance(self) -> dict[tuple[bytes, int], Floats]:
        return {}

    def _lag_covariance(self, time: Floats, lags: int) -> Floats:
        # the curve at a time depends on the states of the nodes left and right of it
        left, weights = self._interpolation(time)
        count = len(time)
        result = np.zeros((lags + 1, count, 3, 3))
        apart = [left[lag:] - left[: count - lag] for lag in range(min(lags, count - 1) + 1)]
        farthest = max(int(places.max()) for places in apart)
        blocks = covariances_by_distance(self.factor, self.order)
        here = next(blocks)
        before, after = next(blocks).transpose(0, 2, 1), None
        for distance in range(farthest + 1):
            after = before.transpose(0, 2, 1) if distance == 0 else next(blocks, np.zeros_like(here[:0]))
            for lag, places in enumerate(apart):
                rows = lag + np.flatnonzero(places == distance)
                if len(rows):
                    node = left[rows - lag]
                    upper = np.concatenate([here[node], after[node]], axis=2)
                    # of neighbours, the node right of the earlier time is that left of the later one
                    lower = np.concatenate([before[node + (distance > 0)], here[node + 1]], axis=2)
                    covariance = np.concatenate([upper, lower], axis=1)
                    earlier = weights[rows - lag] @ covariance
                    result[lag, rows] = weights[rows] @ earlier.transpose(0, 2, 1)
            before, here = here, after
        return result

    def _interpolation(self, time: Floats) -> tuple[Integers, Floats]:
        """Return the node left of each time, and the weights (T, 3, 2 order) of both nodes' states."""
        left = np.clip(np.searchsorted(self.nodes, time, side="right") - 1, 0, len(self.nodes) - 2)
        length = np.diff(self.nodes)[left]
        s = (time - self.nodes[left]) / length
        order = np.arange(self.order)
        curve = _derivatives(s, 3, 2 * self.order) @ np.linalg.inv(_derivatives_at_ends(self.order))
        scaled = length / self.scale
        curve *= (scaled[:, None] ** np.tile(order, 2))[:, None, :] / (length[:, None] ** np.arange(3))[:, :, None]
        return left, curve

    def standard_deviation(self, time: Floats) -> Floats:
        """Return the standard deviations of position, velocity and acceleration at the times (T,), shape (3, T)."""
        return np.sqrt(np.diagonal(self.lag_covariance(time, 0)[0], axis1=1, axis2=2)).T


def _derivatives(at: Floats, count: int, powers: int) -> Floats:
    """Return the derivatives of the monomials at points (T,), shape (T, count, powers)."""
    which, power = np.arange(count), np.arange(powers)
    factor = np.array([[math.perm(int(j), int(r)) for j in power] for r in which], dtype=float)
    return factor * at[:, None, None] ** np.maximum(power[None, :] - which[:, None], 0)


def _derivatives_at_ends(order: int) -> Floats:
    """Return the derivatives of 2 ``order`` monomials at 0 and at 1, shape (2 order, 2 order)."""
    return _derivatives(np.array([0.0, 1.0]), order, 2 * order).reshape(2 * order, 2 * order)


def smooth(
    samples: list[JointSamples],
    start: float | None = None,
    jumps: Sequence[Jump] = (),
    orders: Sequence[int] = ORDERS,
    roughness: Floats | None = None,
) -> SmoothedJoint:
    """Fit the smoothing spline of one joint.

    Parameters
    ----------
    samples : list of JointSamples
        Series of samples, at least one of them of positions or velocities.
    start : float, optional
        Exact position at time 0 of a joint that is recorded by its speed only.
    jumps : sequence of Jump, optional
        Jumps of the acceleration or the jerk, as `bayesid.recording.jumps` finds them.
    orders : sequence of int, optional
        Orders of the derivative that may be white noise, of which the marginal likelihood chooses one.
    roughness : (n - 1,) array, optional
        Factor on the variance of the process in each step, as `bayesid.recording.jumps` finds it.
    """
    nodes, scale = _nodes(np.concatenate([series.time for series in samples]))
    best = None
    for order in orders:
        applicable = tuple(jump for jump in jumps if jump.derivative < order)
        fit = _fit(samples, nodes, scale, start, order, applicable, roughness)
        if best is not None and order > best.order and fit.log_likelihood < best.log_likelihood:
            break
        if best is None or fit.log_likelihood > best.log_likelihood:
            best = fit
    assert best is not None
    if not best.is_constant:
        return best
    still = np.zeros_like(best.states)  # of equal readings rounding would make a motion
    still[:, 0] = next((one.value[0] for one in samples if one.derivative == 0), start)
    return replace(best, states=still)


def _fit(
    samples: list[JointSamples],
    nodes: Floats,
    scale: float,
    start: float | None,
    order: int,
    jumps: tuple[Jump, ...],
    roughness: Floats | None,
) -> SmoothedJoint:
    scaled = [_Observed.of(series, nodes, scale, order) for series in samples]
    problem = _Problem(nodes / scale, scaled, start, order, jumps, roughness)
    units = [scale**series.derivative for series in samples]
    guess = [math.log(problem.roughness() * 10.0)]
    undeclared = [index for index, series in enumerate(samples) if series.sigma is None]
    guess += [math.log(max(problem.noise_guess(index), 1e-14)) for index in undeclared]
    # readings without noise would have the better likelihood, the less noise they are thought to have
    least = [-46.0, *(math.log(max(FINEST * float(np.abs(scaled[index].value).max()), 1e-20)) for index in undeclared)]

    def unpack(logs: Floats) -> tuple[float, list[float]]:
        free = iter(np.exp(np.clip(logs, least, 23.0)))
        intensity = float(next(free))
        return intensity, [
            float(next(free)) if series.sigma is None else series.sigma * unit
            for series, unit in zip(samples, units, strict=True)
        ]

    def loss(logs: Floats) -> float:
        return -problem.solve(*unpack(logs))[0]

    if len(guess) == 1:
        line = minimize_scalar(
            lambda log: loss(np.array([log])),
            bounds=(guess[0] - 25.0, guess[0] + 5.0),
            method="bounded",
            options={"xatol": 0.05},
        )
        optimum = np.array([line.x])
    else:
        simplex = np.array(guess) + np.vstack([np.zeros(len(guess)), 1.5 * np.eye(len(guess))])
        optimum = minimize(
            loss,
            simplex[0],
            method="Nelder-Mead",
            # exact readings leave a likelihood that rounding makes rough: shrinking would go on for ever
            options={"xatol": 0.05, "fatol": 1e-2, "maxfev": MOST_EVALUATIONS * len(guess), "initial_simplex": simplex},
        ).x
    intensity, sigmas = unpack(optimum)
    log_likelihood, states, factor, chi2 = problem.solve(intensity, sigmas)
    return SmoothedJoint(
        nodes=nodes,
        states=states,
        scale=scale,
        factor=factor,
        sigmas=tuple(sigma / unit for sigma, unit in zip(sigmas, units, strict=True)),
        declared=tuple(series.sigma is not None for series in samples),
        order=order,
        intensity=intensity / scale ** (order - 0.5),
        log_likelihood=log_likelihood,
        chi2=chi2,
        samples=sum(len(series.time) for series in samples),
        series=tuple(samples),
        start=start,
        jumps=jumps,
        roughness=roughness,
    )


def _nodes(times: Floats) -> tuple[Floats, float]:
    times = np.unique(times)
    scale = float(np.median(np.diff(times)))
    return times[np.concatenate([[True], np.diff(times) > SNAP * scale])], scale


def _nearest(nodes: Floats, time: Floats) -> Integers:
    right = np.clip(np.searchsorted(nodes, time), 1, len(nodes) - 1)
    return np.where(time - nodes[right - 1] < nodes[right] - time, right - 1, right)


class _Observed(NamedTuple):
    """One series of samples in scaled time."""

    derivative: int
    node: Integers  #: node to whose state each sample belongs, (n,)
    value: Floats  #: samples, (n,)
    row: Floats  #: derivatives of each sample in that state, (n, order)
    relative: Floats  #: standard deviation of each sample over that of the series, (n,)
    matrix: csr_array  #: the same derivatives in the states of all nodes, (n, nodes x order)

    @classmethod
    def of(cls, series: JointSamples, nodes: Floats, scale: float, order: int) -> _Observed:
        """Return a series; of a mean over a block the state gives the Taylor polynomial."""
        node = _nearest(nodes, series.time)
        row = np.zeros((len(node), order))
        row[:, series.derivative] = 1.0
        if series.means is not None:
            lag, moments = (series.time - nodes[node])[:, None], series.means.moments
            for power in range(1, order - series.derivative):
                terms = [math.comb(power, k) * moments[:, k : k + 1] * lag ** (power - k) for k in range(power + 1)]
                row[:, series.derivative + power] = np.sum(terms, axis=0)[:, 0] / (math.factorial(power) * scale**power)
        columns, starts = order * node[:, None] + np.arange(order), order * np.arange(len(node) + 1)
        matrix = csr_array((row.ravel(), columns.ravel(), starts), shape=(len(node), order * len(nodes)))
        return cls(series.derivative, node, series.value * scale**series.derivative, row, series.relative, matrix)

    def miss(self, states: Floats) -> Floats:
        """Return samples less what the states (n, order) say of them."""
        return np.asarray(self.value - self.matrix @ states.ravel())

    def information(self, count: int) -> Floats:
        """Return the information on the states of all nodes for a noise of one, (count, order, order)."""
        total = np.zeros((count, self.row.shape[1], self.row.shape[1]))
        np.add.at(total, self.node, self.row[:, :, None] * self.row[:, None, :] / self.relative[:, None, None] ** 2)
        return total


class _Problem:
    """Normal equations of the smoothing problem in scaled time, which are banded."""

    def __init__(
        self,
        nodes: Floats,
        series: list[_Observed],
        start: float | None,
        order: int,
        jumps: Sequence[Jump],
        roughness: Floats | None = None,
    ) -> None:
        self.series, self.count, self.order = series, len(nodes), order
        self.process = IntegratedProcess(np.diff(nodes), order, jumps, roughness)
        self.information = [one.information(len(nodes)) for one in series]
        spread = max(float(np.abs(one.value).max()) for one in series)
        self.initial = np.full(order, 1.0 / (100.0 * (spread + 1e-6)) ** 2)
        self.initial_mean = np.zeros(order)
        if start is not None:
            self.initial[0], self.initial_mean[0] = 1e20 if not start else (1e10 / max(abs(start), 1.0)) ** 2, start

    def intensity_over(self, horizon: float, sigmas: Sequence[float]) -> float:
        """Return the intensity with which the process leaves a polynomial by the noise within a number of steps."""
        intensities = []
        for one, sigma in zip(self.series, sigmas, strict=True):
            power = self.order - one.derivative
            growth = horizon ** (power - 0.5) / (math.sqrt(2 * power - 1) * math.factorial(power - 1))
            intensities.append(sigma * float(np.median(one.relative)) / growth)
        return min(intensities)

    def roughness(self) -> float:
        """Return a first guess of the intensity from finite differences of the longest series."""
        longest = max(self.series, key=lambda one: len(one.value))
        rough = np.diff(longest.value, n=self.order - longest.derivative)
        return float(np.sqrt(np.mean(rough**2))) / 10.0 + 1e-12

    def noise_guess(self, index: int) -> float:
        """Return a first guess of the noise of one series from its fourth differences."""
        one = self.series[index]
        return float(np.sqrt(np.mean(np.diff(one.value, n=4) ** 2) / 70.0)) / (3.0 * float(np.median(one.relative)))

    def solve(self, intensity: float, sigmas: list[float]) -> tuple[float, Floats, Floats, float]:
        """Return the log marginal likelihood, the states (n, order), the banded factor and chi-square."""
        order = self.order
        precision, prior_logdet = self.process.precision(intensity)
        lower = np.einsum("kji,kjl->kil", self.process.transition, precision)
        diagonal = np.zeros((self.count, order, order))
        diagonal[:-1] += lower @ self.process.transition
        diagonal[1:] += precision
        diagonal[0] += np.diag(self.initial)
        for information, sigma in zip(self.information, sigmas, strict=True):
            diagonal += information * sigma**-2
        band = np.zeros((2 * order, self.count, order))
        for row in range(order):
            for column in range(order):
                if row >= column:
                    band[row - column, :, column] = diagonal[:, row, column]
                band[order + row - column, :-1, column] = -lower[:, column, row]
        try:
            factor = sla.cholesky_banded(band.reshape(2 * order, -1), lower=True, check_finite=False)
        except np.linalg.LinAlgError:
            return -1e300, np.zeros((self.count, order)), band.reshape(2 * order, -1), np.inf
        states = self._mode(factor, precision, sigmas)
        increments = self.process.increments(states)
        chi2 = sum(
            float(np.sum((one.miss(states) / (s * one.relative)) ** 2))
            for one, s in zip(self.series, sigmas, strict=True)
        )
        energy = chi2 + float(np.einsum("ki,kij,kj->", increments, precision, increments))
        energy += float(np.sum(self.initial * (states[0] - self.initial_mean) ** 2))
        prior_logdet += float(np.log(self.initial).sum())
        noise_logdet = sum(
            2.0 * (len(one.value) * math.log(s) + float(np.log(one.relative).sum()))
            for one, s in zip(self.series, sigmas, strict=True)
        )
        log_likelihood = 0.5 * (prior_logdet - noise_logdet - energy) - float(np.log(factor[0]).sum())
        return log_likelihood, states, factor, chi2

    def _mode(self, factor: Floats, precision: Floats, sigmas: list[float]) -> Floats:
        """Return the most probable states (n, order), by conjugate gradients that the factor preconditions.

        The factor loses digits where steps differ much in length or roughness. Repeated solutions with it then diverge;
        conjugate gradients lower the energy with every step, until rounding is all that is left.
        """
        states = np.zeros((self.count, self.order))
        nothing = self._gradient(states, precision, sigmas)
        gradient, direction = nothing, states
        before: tuple[Floats, float] = (states, 1.0)
        least, rises = np.inf, 0
        for _ in range(MOST_REFINEMENTS):
            missing = sla.cho_solve_banded((factor, True), gradient.ravel(), check_finite=False).reshape(states.shape)
            decrement = float(np.vdot(gradient, missing))
            least, rises = min(decrement, least), rises + (decrement > least)
            if decrement < REFINED or rises > 1:
                break
            direction = missing + float(np.vdot(missing, gradient - before[0])) / before[1] * direction
            curvature = float(np.vdot(direction, nothing - self._gradient(direction, precision, sigmas)))
            if not curvature > 0.0:
                break
            states = states + float(np.vdot(gradient, direction)) / curvature * direction
            before = gradient, decrement
            gradient = self._gradient(states, precision, sigmas)
        return states

    def _gradient(self, states: Floats, precision: Floats, sigmas: list[float]) -> Floats:
        force = np.einsum("kij,kj->ki", precision, self.process.increments(states))
        gradient = np.zeros_like(states)
        gradient[1:] -= force
        gradient[:-1] += np.einsum("kji,kj->ki", self.process.transition, force)
        gradient[0] -= self.initial * (states[0] - self.initial_mean)
        for one, sigma in zip(self.series, sigmas, strict=True):
            pull = one.matrix.T @ (one.miss(states) / (sigma * one.relative) ** 2)
            gradient += pull.reshape(gradient.shape)
        return gradient
