"""Model and manoeuvres to a posterior density: residuals whitened by their noise, with exact derivatives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.inference import whitening
from bayesid.inference.sample_grid import Samples
from bayesid.inference.unknowns import Unknowns
from bayesid.inference.whitening import Whitening
from bayesid.recording.actions import Actions
from bayesid.robot.inertial_parameters import InertialParameters
from bayesid.simulation.dynamics import Grid
from bayesid.simulation.effects.effect import Instant, Readings
from bayesid.simulation.joint_torques import TorqueSensor
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.sensors import Kind, Sensor
from bayesid.simulation.simulator import Simulator, Values
from bayesid.simulation.time_grid import build_grid, pad_grids, rounded

__all__ = ["Posterior", "Predictions"]


LONGEST_STEP = 2.0
"""Integration step tried first [s]."""

STEP_TOLERANCE = 0.01
"""Largest integration error allowed, in standard deviations of a sample."""

FEWEST_STEPS = 512
"""Steps that simulations which choose the step are padded to at least, and to a power of two."""

BATCH = 8
"""Points evaluated together: what fits the processor cache is three times faster than 64 at once."""


MAPPED = 256
"""Points whose coordinates are converted together."""


class Data(NamedTuple):
    """Arrays of all recordings, stacked and padded, leading axis R."""

    grid: Grid
    attitude: Array  # (R, 4) at time 0
    measured: Array  # (R, T, C); attitude as quaternion columns kept apart
    quaternion: Array  # (R, T, 4)
    weights: Array  # (R, O, C, width, C)
    start: Array  # (R, O)


class Perturbation(NamedTuple):
    """A change of the unknowns and of what acts on the robot, from outside the model; leading axis R but for ``z``.

    z (size,); rows of the kinematic tables (R, S, 28) and (R, T, 28); wrench on the base (R, S, 6) and (R, T, 6); what
    the sensors read (R, T, C), sensor axes; S instants of the integration, T samples.
    """

    z: Array | Floats
    node_rows: Array | Floats
    sample_rows: Array | Floats
    node_wrench: Array | Floats
    sample_wrench: Array | Floats
    reading: Array | Floats


def perturbed(data: Data, perturbation: Perturbation) -> Data:
    """Return the data with a push added to what is known."""
    node, sample = data.grid.node, data.grid.sample
    grid = data.grid._replace(
        node=node._replace(
            known=node.known + perturbation.node_rows,
            environment=node.environment._replace(wrench=node.environment.wrench + perturbation.node_wrench),
        ),
        sample=sample._replace(
            known=sample.known + perturbation.sample_rows,
            environment=sample.environment._replace(wrench=sample.environment.wrench + perturbation.sample_wrench),
        ),
    )
    return data._replace(grid=grid, measured=data.measured - perturbation.reading)


class Traced(NamedTuple):
    """A simulation: motion at stages (R, S) and samples (R, T), readings (R, T), whitened residual (R, O, C)."""

    node: Instant
    sample: Instant
    readings: Readings
    residual: Array


class Predictions(NamedTuple):
    """What one recording's sensors should read: time (T,) and per sensor (T, 3) or, for an attitude, (T, 4).

    ``torque`` is (T, n), of the n joints of the model's torque sensor.
    """

    time: Floats
    rate: Floats
    accel: Floats
    attitude: Floats
    torque: Floats


class Posterior:
    """Posterior of the unknowns of a model given manoeuvres.

    Coordinates ``z`` have a standard-normal prior (`Unknowns`).

    Parameters
    ----------
    model : Model
    manoeuvres : sequence of Manoeuvre
    step : float, optional
        Integration step [s]; chosen from the sensors' noise where left out.
    flat_prior : bool
        Leave the prior out, for the noise-free comparisons of the paper.
    like : Posterior, optional
        Of the same model; its compiled functions are shared if the unknowns agree.
    """

    def __init__(
        self,
        model: Model,
        manoeuvres: Sequence[Manoeuvre],
        *,
        step: float | None = None,
        flat_prior: bool = False,
        like: Posterior | None = None,
    ) -> None:
        if not manoeuvres:
            raise InputError("there is no recording", remedy="Give at least one")
        self.model, self.manoeuvres, self.flat_prior = model, tuple(manoeuvres), flat_prior
        self._samples = [Samples(model, manoeuvre) for manoeuvre in manoeuvres]
        self._built: dict[float, list[Grid]] = {}
        self._left_out: list[NDArray[np.bool_]] = []
        self.unknowns = Unknowns(
            bodies=model.priors,
            effects=model.effects,
            recordings=len(manoeuvres),
            rate_sigma=self._rate_sigma(),
            tilt_sigma=tuple(manoeuvre.attitude_sigma for manoeuvre in manoeuvres),
            mixing=model.mixing,
        )
        shared = None if like is None or like.model is not model or like.unknowns != self.unknowns else like._compiled
        self._compiled: _Compiled = shared or _Compiled(model, self.unknowns)
        self.step = self._choose_step() if step is None else step
        self.whitenings = self._whiten(self.initial_point(), [None] * len(manoeuvres))
        self.data = self._stack(self._grids(self.step))

    def at(self, z: Floats) -> Posterior:
        """Return the posterior with the encoder noise carried through the robot at ``z`` in place of the prior's."""
        new = object.__new__(Posterior)
        new.__dict__.update({key: value for key, value in self.__dict__.items() if key != "data"})
        new.whitenings = self._whiten(z, [old.window for old in self.whitenings])
        new.data = new._stack_noise(self.data)
        return new

    def with_sensors(
        self, sensors: Sequence[Sensor], z: Floats, like: Posterior | None = None, torque: TorqueSensor | None = None
    ) -> Posterior:
        """Return the posterior with other noise of the same sensors, the encoder noise carried through at ``z``.

        Whitening windows are searched for where noise is coloured, or are those of ``like``. Joint torques keep their
        noise unless ``torque`` is given.
        """
        torque = self.model.torque if torque is None else torque
        new = object.__new__(Posterior)
        new.__dict__.update({key: value for key, value in self.__dict__.items() if key != "data"})
        new.model = replace(self.model, sensors=tuple(sensors), torque=torque)
        new._samples = [samples.with_sensors(sensors, torque) for samples in self._samples]
        coloured = any(sensor.coloured is not None for sensor in sensors)
        known = self.whitenings if like is None else like.whitenings
        search = coloured and like is None
        new.whitenings = new._whiten(z, [None if search else old.window for old in known])
        new.data = new._stack_noise(self.data)
        return new

    def without(self, left_out: Sequence[NDArray[np.bool_]]) -> Posterior:
        """Return the posterior with some whitened scalars left out: per recording a mask (O, C)."""
        new = object.__new__(Posterior)
        new.__dict__.update({key: value for key, value in self.__dict__.items() if key != "data"})
        new.whitenings = [item.without(mask) for item, mask in zip(self.whitenings, left_out, strict=True)]
        new.data = new._stack_noise(self.data)
        before = self._left_out or [np.zeros_like(mask) for mask in left_out]
        new._left_out = [np.logical_or(mask, old) for mask, old in zip(left_out, before, strict=True)]
        return new

    def gone(self, index: int) -> NDArray[np.bool_]:
        """Return which whitened scalars of one recording were left out (`without`), shape (O, C)."""
        return self._left_out[index] if self._left_out else np.zeros_like(self.whitenings[index].outputs)

    def left_out(self, index: int) -> dict[Kind, Floats]:
        """Return the times of one recording's samples that were left out (`without`), by sensor."""
        if not self._left_out:
            return {}
        mask, rows = self._left_out[index], self.whitenings[index].rows
        found = {}
        for slot, sensor in enumerate(self.model.sensors):
            gone = mask[:, 3 * slot : 3 * slot + 3].any(axis=1)
            if gone.any():
                found[sensor.kind] = self._samples[index].time[rows[gone]]
        return found

    def with_manoeuvres(self, manoeuvres: Sequence[Manoeuvre]) -> Posterior:
        """Return the posterior of the same model given other manoeuvres, sharing compiled functions where they fit."""
        return Posterior(self.model, manoeuvres, step=self.step, flat_prior=self.flat_prior, like=self)

    # ---- sizes ----

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.unknowns.size

    @property
    def samples(self) -> int:
        """Number of scalar samples."""
        return sum(item.samples for item in self.whitenings)

    @property
    def log_normalisation(self) -> Floats:
        """Constant of each recording's log likelihood, shape (R,)."""
        return np.array([-0.5 * item.samples * np.log(2.0 * np.pi) - item.log_sigma for item in self.whitenings])

    # ---- densities ----

    def residuals(self, z: Floats) -> Floats:
        """Whitened residuals of all recordings, shape (R, O, C); zero where there is no sample."""
        return np.asarray(self._compiled.residuals(jnp.asarray(z), self.data))

    def least_squares(self, z: Floats) -> Floats:
        """Residuals whose half square sum is minus the log posterior, up to a constant."""
        r = self.residuals(z).ravel()
        return r if self.flat_prior else np.concatenate([r, z])

    def jacobian(self, z: Floats) -> Floats:
        """Jacobian of `least_squares`, exact by forward-mode differentiation."""
        j = np.asarray(self._compiled.jacobian(jnp.asarray(z), self.data)).reshape(-1, self.size)
        return j if self.flat_prior else np.concatenate([j, np.eye(self.size)])

    def log_likelihoods(self, z: Floats) -> Floats:
        """Log likelihood of each recording for many points, shape (n, size) -> (n, R)."""
        return -0.5 * self._batched(self._compiled.chi2, np.atleast_2d(z)) + self.log_normalisation

    def log_density(self, z: Floats) -> Floats:
        """Normalised log prior plus log likelihood for many points, shape (n, size) -> (n,)."""
        z = np.atleast_2d(z)
        log_prior = 0.0 if self.flat_prior else -0.5 * (z**2).sum(axis=1) - 0.5 * self.size * np.log(2.0 * np.pi)
        total = self.log_likelihoods(z).sum(axis=1) + log_prior
        return np.where(np.isfinite(total), total, -np.inf)

    # ---- coordinates ----

    def to_linear(self, z: Floats) -> Floats:
        """`Unknowns.to_linear` of many points, shape (n, size)."""
        return self._mapped(self._compiled.to_linear, z)

    def from_linear(self, y: Floats) -> Floats:
        """`Unknowns.from_linear` of many points, shape (n, size)."""
        return self._mapped(self._compiled.from_linear, y)

    def log_volume(self, z: Floats) -> Floats:
        """`Unknowns.log_volume` of many points, shape (n, size) -> (n,)."""
        return self._mapped(self._compiled.log_volume, z)

    def linear_slope(self, z: Floats) -> Floats:
        """Jacobian of `Unknowns.to_linear` at one point."""
        return np.asarray(self._compiled.linear_slope(jnp.asarray(z)))

    # ---- physical quantities ----

    def values(self, z: Floats) -> Values:
        """Physical values of one point."""
        return jax.tree.map(np.asarray, self._compiled.values(jnp.asarray(z)))

    def values_of(self, z: Floats) -> Values:
        """Physical values of many points; every array gets a leading axis."""
        return jax.tree.map(np.asarray, self._compiled.many_values(jnp.asarray(z)))

    def inertials(self, z: Floats) -> list[InertialParameters]:
        """Inertial parameters of the bodies of `Model.priors`."""
        return [InertialParameters.from_vector(row) for row in self.values(z).inertial.reshape(-1, 10)]

    def predict(self, z: Floats) -> list[Predictions]:
        """Return what the sensors of each recording should read at ``z``, in sensor axes."""
        readings = jax.tree.map(np.asarray, self._compiled.readings(jnp.asarray(z), self.data))
        if self.model.torque is not None:
            readings = readings._replace(torque=readings.torque[..., self.model.torque.columns(self.model.robot)])
        return [
            Predictions(*(np.asarray(field)[index, : len(samples.time)] for field in readings))
            for index, samples in enumerate(self._samples)
        ]

    def sample_times(self, index: int) -> Floats:
        """Return the times at which some sensor of a recording was sampled: the grid of `predict`, shape (T,)."""
        return self._samples[index].time

    def measured(self, index: int, kind: Kind) -> tuple[Floats, Floats]:
        """Return times and values of one sensor of a recording, as recorded."""
        return self._samples[index].series[kind]

    def torques(self, index: int) -> tuple[Floats, Floats]:
        """Return times (n,) and torques (n, joints) of a recording, as recorded by the model's torque sensor."""
        return self._samples[index].torque

    def sigma(self, index: int, kind: Kind) -> Floats:
        """White noise per axis of one sensor of a recording, shape (3,)."""
        sensor = next(sensor for sensor in self.model.sensors if sensor.kind is kind)
        return self._samples[index].sigma(sensor)

    # ---- responses to what the model does not have ----

    def trace(self, z: Floats, data: Data) -> Traced:
        """Simulate with `perturbed` data."""
        return self._compiled.traced(jnp.asarray(z), data)

    def responses(self, z: Floats, data: Data, perturbations: Perturbation) -> Floats:
        """Return derivatives of the whitened residual along many pushes (leading axis n), shape (n, R, O, C)."""
        count = len(perturbations.z)
        padded = jax.tree.map(lambda x: np.concatenate([x, np.zeros((-count % BATCH, *x.shape[1:]))]), perturbations)
        parts = [
            np.asarray(
                self._compiled.responses(jnp.asarray(z), data, jax.tree.map(lambda x, i=i: x[i : i + BATCH], padded))
            )
            for i in range(0, count, BATCH)
        ]
        return np.concatenate(parts)[:count] if parts else np.zeros((0, *self.residual_shape))

    @property
    def residual_shape(self) -> tuple[int, int, int]:
        """Shape (R, O, C) of the whitened residual."""
        return (len(self.manoeuvres), self.data.start.shape[1], self.data.weights.shape[2])

    def initial_point(self) -> Floats:
        """Return the prior's centre, with initial rates from the first rate samples."""
        if self.unknowns.rate_sigma == 0.0:
            return np.zeros(self.size)
        rates = np.stack([samples.first_rate for samples in self._samples])
        z = self.unknowns.coordinates([body.centre for body in self.model.priors], rates)
        z[: 10 * len(self.model.priors)] = 0.0  # exactly: steps are scaled to the start, and rounding is no scale
        return z

    def integration_error(self, z: Floats) -> float:
        """Largest error of any sample from the integration step, in its standard deviations (Richardson)."""
        return self._step_error(self.step, z)

    # ---- construction ----

    def _rate_sigma(self) -> float:
        if self.model.rate_sigma == 0.0:
            return 0.0
        return max(self.model.rate_sigma, 3.0 * max(float(np.abs(item.first_rate).max()) for item in self._samples))

    def _grids(self, step: float) -> list[Grid]:
        if step not in self._built:
            self._built[step] = self._build_grids(step)
        return self._built[step]

    def _build_grids(self, step: float) -> list[Grid]:
        names = tuple(prior.name for prior in self.model.priors)
        return [
            build_grid(
                self.model.robot,
                names,
                manoeuvre.motion,
                samples.time,
                step,
                orbit=self.model.orbit,
                argument_of_latitude=manoeuvre.argument_of_latitude,
                actions=Actions.from_recording(manoeuvre.recording),
                effects=self.model.effects,
                torques=self.model.torque is not None,
            )
            for manoeuvre, samples in zip(self.manoeuvres, self._samples, strict=True)
        ]

    def _choose_step(self) -> float:
        shortest = min(float(samples.time[-1]) for samples in self._samples)
        step = min([LONGEST_STEP, 0.25 * shortest, *(effect.longest_step for effect in self.model.effects)])
        z = self.initial_point()
        while self._step_error(step, z) > STEP_TOLERANCE:
            step *= 0.5
            if step < 1e-4 * LONGEST_STEP:
                raise InputError(
                    "no integration step reaches 1 % of the sensors' noise",
                    remedy="Check the units of joint motion and of the sensors' sigma",
                )
        return step

    def _step_error(self, step: float, z: Floats) -> float:
        coarse, fine = self._simulated(step, z), self._simulated(0.5 * step, z, like=step)
        worst = 0.0
        for sensor in self.model.sensors:
            sigma = np.stack([item.sigma(sensor) for item in self._samples])
            first, second = (np.asarray(getattr(item, sensor.kind.value)) for item in (coarse, fine))
            worst = max(worst, float((np.abs(first - second)[..., :3] / sigma[:, None]).max()))
        if (torque := self.model.torque) is not None:
            change = np.abs(np.asarray(coarse.torque - fine.torque))[..., torque.columns(self.model.robot)]
            worst = max(worst, float((change / np.array(torque.sigma)).max()))
        return worst * 16.0 / 15.0  # the error of a fourth-order step, from its difference to half the step

    def _simulated(self, step: float, z: Floats, like: float | None = None) -> Readings:
        """Simulate with a step; padded so that it shares one compilation with shorter steps."""
        steps = 2 * max(len(grid.step) for grid in self._grids(like or step))
        steps = max(FEWEST_STEPS, 1 << (steps - 1).bit_length())
        return self._compiled.simulated(jnp.asarray(z), pad_grids(self._grids(step), steps), self._attitudes())

    def _base_rates(self, z: Floats) -> list[Floats]:
        """Angular velocity at the sample times of each recording, base axes, shape (T, 3)."""
        turn = {sensor.kind: sensor.rotation for sensor in self.model.sensors}.get(Kind.RATE, np.eye(3))
        rates = np.asarray(self._simulated(self.step, z).rate) @ turn.T
        return [rate[: len(samples.time)] for rate, samples in zip(rates, self._samples, strict=True)]

    def _attitudes(self) -> Array:
        return jnp.asarray(np.stack([manoeuvre.attitude for manoeuvre in self.manoeuvres]))

    def _whiten(self, z: Floats, windows: Sequence[int | None]) -> list[Whitening]:
        """Build the whitening of every recording with the encoder noise seen through the robot at ``z``."""
        robot = self.model.robot
        for prior, inertial in zip(self.model.priors, self.inertials(z), strict=True):
            robot = robot.with_inertial(prior.name, inertial)
        return [
            whitening.build(samples.noise_model(self.model, robot, rate), window)
            for samples, rate, window in zip(self._samples, self._base_rates(z), windows, strict=True)
        ]

    def _stack(self, grids: list[Grid]) -> Data:
        lengths = (max(len(grid.step) for grid in grids), max(len(grid.step_of) for grid in grids))
        grid = pad_grids(grids, *(rounded(length) for length in lengths))
        count = grid.step_of.shape[1]
        measured = np.stack([_lengthen(item.measured, count) for item in self._samples])
        quaternion = np.stack([_lengthen(item.quaternion, count) for item in self._samples])
        bare = Data(grid, self._attitudes(), jnp.asarray(measured), jnp.asarray(quaternion), jnp.zeros(0), jnp.zeros(0))
        return self._stack_noise(bare)

    def _stack_noise(self, data: Data) -> Data:
        outputs = rounded(max(len(item.start) for item in self.whitenings))
        width = max(item.weights.shape[2] for item in self.whitenings)
        channels = self.whitenings[0].weights.shape[1]
        weights = np.zeros((len(self.whitenings), outputs, channels, width, channels))
        start = np.zeros((len(self.whitenings), outputs), dtype=np.int32)
        for row, item in enumerate(self.whitenings):
            weights[row, : len(item.start), :, : item.weights.shape[2]] = item.weights
            start[row, : len(item.start)] = item.start
        return data._replace(weights=jnp.asarray(weights), start=jnp.asarray(start))

    def _mapped(self, function: Callable[..., Array], z: Floats) -> Floats:
        padded = np.concatenate([z, np.repeat(z[-1:], -len(z) % MAPPED, axis=0)])
        parts = [np.asarray(function(jnp.asarray(padded[i : i + MAPPED]))) for i in range(0, len(padded), MAPPED)]
        return np.concatenate(parts)[: len(z)]

    def _batched(self, function: Callable[..., Array], z: Floats) -> Floats:
        padding = -len(z) % BATCH
        padded = np.concatenate([z, np.repeat(z[-1:], padding, axis=0)]) if padding else z
        parts = [
            np.asarray(function(jnp.asarray(padded[i : i + BATCH]), self.data)) for i in range(0, len(padded), BATCH)
        ]
        return np.concatenate(parts)[: len(z)]


class _Compiled:
    """Compiled functions of a model; data are arguments, so that a change of the noise compiles nothing anew."""

    def __init__(self, model: Model, unknowns: Unknowns) -> None:
        simulator = Simulator(model)

        def whitened(readings: Readings, data: Data) -> Array:
            residual = simulator.misfit(readings, data.measured, data.quaternion)
            padded = jnp.pad(residual, ((0, 0), (0, data.weights.shape[3]), (0, 0)))
            return jax.vmap(whitening.apply)(data.weights, data.start, padded)

        def simulated(z: Array, grid: Grid, attitude: Array) -> Readings:
            return simulator.readings(unknowns.values(z), grid, attitude)

        def residuals(z: Array, data: Data) -> Array:
            return whitened(simulated(z, data.grid, data.attitude), data)

        def traced(z: Array, data: Data) -> Traced:
            node, sample, readings = simulator.trace(unknowns.values(z), data.grid, data.attitude)
            return Traced(node, sample, readings, whitened(readings, data))

        def chi2(z: Array, data: Data) -> Array:
            return jnp.sum(residuals(z, data) ** 2, axis=(1, 2))

        def responses(z: Array, data: Data, along: Perturbation) -> Array:
            def shifted(z: Array, perturbation: Perturbation) -> Array:
                return residuals(z, perturbed(data, perturbation))

            at = jax.tree.map(lambda x: jnp.zeros(x.shape[1:]), along)
            return jax.vmap(lambda perturbation: jax.jvp(shifted, (z, at), (perturbation.z, perturbation))[1])(along)

        self.traced = jax.jit(traced)
        self.responses = jax.jit(responses)
        self.simulated = jax.jit(simulated)
        self.readings = jax.jit(lambda z, data: simulated(z, data.grid, data.attitude))
        self.residuals = jax.jit(residuals)
        self.jacobian = jax.jit(jax.jacfwd(residuals))
        self.chi2 = jax.jit(jax.vmap(chi2, (0, None)))
        self.to_linear = jax.jit(jax.vmap(unknowns.to_linear))
        self.from_linear = jax.jit(jax.vmap(unknowns.from_linear))
        self.log_volume = jax.jit(jax.vmap(unknowns.log_volume))
        self.linear_slope = jax.jit(jax.jacfwd(unknowns.to_linear))
        self.values = jax.jit(unknowns.values)
        self.many_values = jax.jit(jax.vmap(unknowns.values))


def _lengthen(array: Floats, length: int) -> Floats:
    return np.concatenate([array, np.repeat(array[-1:], length - len(array), axis=0)])
