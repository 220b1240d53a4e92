"""Posterior density of the unknowns of a model, given recordings (`bayesid.inference.data.Data`)."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from scipy.special import ndtri

from bayesid._io.errors import InputError
from bayesid._io.short_form import ShortForm, Summary
from bayesid._io.words import counted
from bayesid._math.arrays import Floats
from bayesid._math.device import device
from bayesid._math.on_device import on_device
from bayesid.inference import compiled, whitening
from bayesid.inference.compiled import Numbers, Structure
from bayesid.inference.data import Data, RecordedSamples, grids_of, stacked
from bayesid.inference.encoder_noise import SampledMotion
from bayesid.inference.integration_step import choose_step, simulate_padded
from bayesid.inference.memory_estimate import refuse_large_recordings
from bayesid.inference.unknowns import Unknowns
from bayesid.inference.whitening import Whitening, Window
from bayesid.recording.joint_motion import MeasuredMotion
from bayesid.simulation.dynamics import Grid
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.own_effects import check_own_effect
from bayesid.simulation.sensors import SensorKind
from bayesid.simulation.simulator import ModelConstants, Simulator

__all__ = ["Posterior", "whiten"]

COPIES = 4.0
"""Number of arrays of the size of the composite body's tables that XLA keeps at a time; on a processor it plans 3.6."""


@dataclass(frozen=True, repr=False)
class Posterior(ShortForm):
    """Posterior of the unknowns of a model given recorded manoeuvres; immutable.

    The coordinates ``z`` have a standard-normal prior (`Unknowns`). `log_density`, `log_prior`, `log_likelihood`,
    `prior_transform`, `jacobian` and `gradient` take and return NumPy arrays, so that any sampler takes it as it is;
    `names` are those of the coordinates. `Posterior.of` builds the posterior; functions of
    `bayesid.inference.noise_changes` and `bayesid.inference.predicted_readings` give it other noise or other samples,
    and predict readings.

    Attributes
    ----------
    data : Data
        Samples with their noise.
    unknowns : Unknowns
        Unknowns with their prior.
    flat_prior : bool
        Whether the prior is omitted, as in the noise-free comparisons of the paper.
    """

    data: Data
    unknowns: Unknowns
    flat_prior: bool = False

    def summary(self) -> Summary:
        """Return a description of the model and the size of the problem."""
        counts = (len(self.manoeuvres), "recording"), (self.samples, "sample"), (self.size, "unknown")
        sizes = ", ".join(counted(number, name) for number, name in counts)
        return Summary([*self.model.summary().sentences, f"{sizes}."])

    @classmethod
    def of(
        cls,
        model: Model,
        manoeuvres: Sequence[Manoeuvre],
        *,
        step: float | None = None,
        flat_prior: bool = False,
        window: int | None = None,
    ) -> Posterior:
        """Return the posterior of a model given manoeuvres.

        Parameters
        ----------
        model : Model
        manoeuvres : sequence of Manoeuvre
        step : float, optional
            Longest integration step [s], by default chosen from the sensors' noise (`choose_step`).
        flat_prior : bool
            Whether the prior is left out.
        window : int, optional
            Number of earlier blocks on which the whitening conditions each sample, by default the smallest that is
            accurate. With 0 the correlation of the encoder noise is omitted, which suits a first look at the data.

        Raises
        ------
        InputError
            If there is no recording, one lacks a sensor that the model declares, a hook of a user-defined effect
            breaks its contract, or memory is lacking.
        """
        for effect in model.effects:
            check_own_effect(effect, model.robot, model.sensors)
        if not manoeuvres:
            raise InputError("there is no recording", remedy="Give at least one")
        recorded = tuple(RecordedSamples.of(model, manoeuvre, index) for index, manoeuvre in enumerate(manoeuvres))
        refuse_large_recordings(model, recorded)
        unknowns = _unknowns(model, manoeuvres, recorded)
        numbers, structure = _numbers(model, unknowns), _structure(model, unknowns)
        start = starting_point(unknowns, recorded)
        chosen = choose_step(model, manoeuvres, recorded, structure, numbers, start) if step is None else step
        grids = grids_of(model, manoeuvres, recorded, chosen)
        windows = None if window is None else [Window(window)] * len(recorded)
        whitenings = whiten(model, recorded, grids, manoeuvres, unknowns, structure, numbers, start, windows)
        arrays = stacked(model, manoeuvres, recorded, grids, whitenings)
        left_out = tuple(np.zeros_like(whitening.outputs) for whitening in whitenings)
        data = Data(model, tuple(manoeuvres), recorded, tuple(whitenings), left_out, chosen, arrays)
        return cls(data, unknowns, flat_prior)

    @property
    def model(self) -> Model:
        """Model of the robot, its sensors and effects."""
        return self.data.model

    @property
    def manoeuvres(self) -> tuple[Manoeuvre, ...]:
        """Recorded manoeuvres."""
        return self.data.manoeuvres

    @property
    def whitenings(self) -> tuple[Whitening, ...]:
        """Whitening of every recording."""
        return self.data.whitenings

    @property
    def step(self) -> float:
        """Longest integration step [s]."""
        return self.data.step

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.unknowns.size

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the coordinates."""
        return self.unknowns.names

    @property
    def samples(self) -> int:
        """Number of scalar samples that the likelihood uses."""
        return self.data.samples

    @property
    def residual_shape(self) -> tuple[int, int, int]:
        """Shape (R, O, C) of the whitened residual."""
        return self.data.residual_shape

    @cached_property
    def structure(self) -> Structure:
        """Static part of the problem, which is the key of the compiled code."""
        return _structure(self.model, self.unknowns)

    @cached_property
    def numbers(self) -> Numbers:
        """Numbers of the model and the prior, which are arguments of the compiled code."""
        return _numbers(self.model, self.unknowns)

    @property
    def bytes_per_point(self) -> float:
        """Estimate of the memory that a point takes while its likelihood is computed [bytes].

        Most of it are the tables of the composite body, which depend on the point, at all nodes and samples.
        """
        grid = self.data.arrays.grid
        return COPIES * 8.0 * (grid.node.known.size + grid.sample.known.size)

    @cached_property
    def log_normalisation(self) -> Floats:
        """Normalisation constant of the log likelihood of each recording, shape (R,)."""
        return np.array(
            [-0.5 * whitening.samples * np.log(2.0 * np.pi) - whitening.log_sigma for whitening in self.whitenings]
        )

    def starting_point(self) -> Floats:
        """Return the prior's centre with the initial rates of the first rate samples, shape (size,)."""
        return starting_point(self.unknowns, self.data.recorded)

    def residuals(self, z: Floats) -> Floats:
        """Return the whitened residuals of all recordings, shape (R, O, C); zero where there is no sample."""
        return np.asarray(compiled.residuals(self.structure, self.numbers, on_device(z), self.data.arrays))

    def least_squares(self, z: Floats) -> Floats:
        """Return residuals; half their sum of squares is minus the log posterior density, up to a constant."""
        r = self.residuals(z).ravel()
        return r if self.flat_prior else np.concatenate([r, z])

    def jacobian(self, z: Floats) -> Floats:
        """Return the Jacobian of `least_squares` at one point, shape (size,) -> (residuals, size)."""
        slopes = compiled.jacobian(self.structure, self.numbers, on_device(z), self.data.arrays)
        j = np.asarray(slopes).reshape(self.size, -1).T
        return j if self.flat_prior else np.concatenate([j, np.eye(self.size)])

    def gradient(self, z: Floats) -> Floats:
        """Return the gradient of `log_density` at one point, shape (size,) -> (size,)."""
        return -self.jacobian(z).T @ self.least_squares(z)

    def log_prior(self, z: Floats) -> Floats:
        """Return the normalised log prior density, shape (..., size) -> (...); zero where the prior is flat."""
        squares = np.sum(np.square(z), axis=-1)
        return 0.0 * squares if self.flat_prior else -0.5 * squares - 0.5 * self.size * np.log(2.0 * np.pi)

    def log_likelihood(self, z: Floats) -> Floats:
        """Return the log likelihood of all recordings, shape (..., size) -> (...), minus infinity as `log_density`."""
        z = np.asarray(z, dtype=float)
        total = self.log_likelihoods(z.reshape(-1, self.size)).sum(axis=1)
        return np.where(np.isfinite(total), total, -np.inf).reshape(z.shape[:-1])[()]

    def log_density(self, z: Floats) -> Floats:
        """Return the normalised log prior plus the log likelihood, shape (..., size) -> (...).

        It is minus infinity where the simulation has no finite readings.
        """
        z = np.asarray(z, dtype=float)
        return self.log_densities(z.reshape(-1, self.size))[:, 0].reshape(z.shape[:-1])[()]

    def prior_transform(self, unit: Floats) -> Floats:
        """Return the coordinates whose prior probabilities are given, for nested sampling.

        Parameters
        ----------
        unit : (..., size) array
            Points of the unit cube, whose uniform distribution becomes the prior.

        Returns
        -------
        (..., size) array
        """
        return ndtri(np.asarray(unit, dtype=float))

    def traced_log_density(self, z: Array) -> Array:
        """Return `log_density` at one point (size,), in a function that JAX traces and differentiates in 64 bits."""
        if z.dtype != np.float64:
            remedy = 'Call jax.config.update("jax_enable_x64", True) before JAX computes'
            raise InputError(f"the coordinates are numbers of type {z.dtype}", remedy=remedy)
        r = compiled.residuals(self.structure, self.numbers, z, self.data.arrays)
        prior = 0.0 if self.flat_prior else z @ z + self.size * np.log(2.0 * np.pi)
        value = self.log_normalisation.sum() - 0.5 * (jnp.sum(r**2) + prior)
        return jnp.where(jnp.isfinite(value), value, -jnp.inf)

    def log_likelihoods(self, z: Floats) -> Floats:
        """Return the log likelihoods of all recordings at many points, shape (n, size) -> (n, R)."""
        z = np.atleast_2d(z)
        batch = device().batch(len(z), self.bytes_per_point)
        padded = np.concatenate([z, np.repeat(z[-1:], -len(z) % batch, axis=0)])
        with ThreadPoolExecutor(device().calls) as threads:
            parts = list(threads.map(self._chi2, np.split(padded, len(padded) // batch)))
        return -0.5 * np.concatenate(parts)[: len(z)] + self.log_normalisation

    def _chi2(self, z: Floats) -> Floats:
        return np.asarray(compiled.chi2(self.structure, self.numbers, z, self.data.arrays))

    def log_densities(self, z: Floats) -> Floats:
        """Return `log_density` together with the log likelihoods of the R recordings, (n, size) -> (n, 1 + R)."""
        z = np.atleast_2d(z)
        likelihoods = self.log_likelihoods(z)
        total = likelihoods.sum(axis=1) + self.log_prior(z)
        return np.column_stack([np.where(np.isfinite(total), total, -np.inf), likelihoods])


def starting_point(unknowns: Unknowns, recorded: Sequence[RecordedSamples]) -> Floats:
    """Return the prior's centre with the initial rates of the first rate samples, shape (size,).

    Parameters
    ----------
    unknowns : Unknowns
    recorded : (R,) sequence of RecordedSamples
    """
    # bodies are exactly zero: the solver scales its first step by the start, which must not be a rounding error
    z = np.zeros(unknowns.size)
    if unknowns.layout.rates:
        rates = np.stack([samples.first_rate for samples in recorded])
        z[unknowns.layout.all_rates] = (rates / unknowns.rate_sigma).ravel()
    return z


def _unknowns(model: Model, manoeuvres: Sequence[Manoeuvre], recorded: Sequence[RecordedSamples]) -> Unknowns:
    fastest = max(float(np.abs(samples.first_rate).max()) for samples in recorded)
    speeds, joints = _speed_errors(model, manoeuvres)
    return Unknowns(
        bodies=model.priors,
        effects=model.effects,
        recordings=len(manoeuvres),
        rate_sigma=0.0 if model.rate_sigma == 0.0 else max(model.rate_sigma, 3.0 * fastest),
        tilt_sigma=tuple(manoeuvre.attitude_sigma for manoeuvre in manoeuvres),
        mixing=model.mixing,
        speed_sigma=speeds,
        joints=joints,
        rigid=not model.robot.joints,
    )


def _speed_errors(
    model: Model, manoeuvres: Sequence[Manoeuvre]
) -> tuple[tuple[tuple[float, ...], ...], tuple[str, ...]]:
    """Return the standard deviations of the smoothed joint speeds at time 0, by recording, and the joints' names."""
    joints = tuple(joint.name for joint in model.robot.joints)
    if not model.has_speed_errors or not any(isinstance(manoeuvre.motion, MeasuredMotion) for manoeuvre in manoeuvres):
        return (), ()
    return tuple(
        tuple(float(joint.standard_deviation(np.zeros(1))[1, 0]) for joint in manoeuvre.motion.joints)
        if isinstance(manoeuvre.motion, MeasuredMotion)
        else (0.0,) * len(joints)
        for manoeuvre in manoeuvres
    ), joints


def _structure(model: Model, unknowns: Unknowns) -> Structure:
    return Structure(Simulator.of(model), unknowns.layout)


def _numbers(model: Model, unknowns: Unknowns) -> Numbers:
    return jax.tree.map(on_device, Numbers(ModelConstants.of(model), unknowns.numbers))


def whiten(
    model: Model,
    recorded: Sequence[RecordedSamples],
    grids: Sequence[Grid],
    manoeuvres: Sequence[Manoeuvre],
    unknowns: Unknowns,
    structure: Structure,
    numbers: Numbers,
    z: Floats,
    windows: Sequence[Window | None] | None = None,
) -> list[Whitening]:
    """Return the whitening of every recording.

    Parameters
    ----------
    z : (size,) array
        Linearisation point of the robot and its motion.
    windows : (R,) sequence of Window or None, optional
        Earlier blocks to condition on; None takes the shortest window that is accurate.

    Returns
    -------
    list of Whitening
    """
    robot = model.robot
    for prior, inertial in zip(model.priors, unknowns.inertials(z), strict=True):
        robot = robot.with_inertial(prior.name, inertial)
    simulated = simulate_padded(manoeuvres, structure, numbers, z, grids)
    rates, attitudes = np.asarray(simulated.rate), np.asarray(simulated.quaternion)
    result = []
    for index, (samples, grid) in enumerate(zip(recorded, grids, strict=True)):
        count = len(samples.nodes)
        attitude = samples.averaged(attitudes[index, :count], kind=SensorKind.ATTITUDE)
        environment = jax.tree.map(lambda x, s=samples: s.averaged(np.asarray(x)), grid.sample.environment)
        seen = SampledMotion(attitude, samples.averaged(rates[index, :count]), environment)
        window = None if windows is None else windows[index]
        result.append(whitening.build(samples.noise_model(robot, seen, window), window))
    return result
