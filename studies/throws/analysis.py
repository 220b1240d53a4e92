"""The analysis of all throws under one model: calibration, bodies, and how the throws scatter about them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from bayesid import Manoeuvre, MeasuredMotion, Posterior
from bayesid.inference.noise_changes import with_manoeuvres
from studies.throws.bodies import object_moments, tensors, truth_sd, wheel_inertia
from studies.throws.data import BODIES, Timing, Truth, read_throws
from studies.throws.effects import SmoothTorque
from studies.throws.joint import Joint, Throw, maximise_jointly
from studies.throws.model import (
    STEP,
    Settings,
    common_model,
    is_calibration,
    is_own,
    noise_factors,
    rough,
    widths,
)
from studies.throws.start import guess

__all__ = ["Analysis", "BodyResult", "analyse", "configure", "prepare"]

Floats = NDArray[np.floating]

DRAWS = 1000
OBJECTS = ("Empty", "A")


@dataclass(frozen=True)
class BodyResult:
    """Principal moments of one body without the device, ascending [kg m2].

    Attributes
    ----------
    throws : tuple of str
    moments, formal : (throws, 3) array
        Of single throws, with the posterior's standard deviation of each.
    joint, joint_formal, joint_jackknife : (3,) array
        Of all throws together; the jackknife takes whole throws out, calibration throws included.
    truth, truth_sd : (3,) array
    """

    name: str
    throws: tuple[str, ...]
    moments: Floats
    formal: Floats
    joint: Floats
    joint_formal: Floats
    joint_jackknife: Floats
    truth: Floats
    truth_sd: Floats

    @property
    def errors(self) -> Floats:
        """Of single throws against the truth [%], shape (throws, 3)."""
        return 100.0 * (self.moments / self.truth - 1.0)

    @property
    def joint_errors(self) -> Floats:
        """Of the joint fit against the truth [%], shape (3,)."""
        return 100.0 * (self.joint / self.truth - 1.0)

    @property
    def mean_error(self) -> float:
        """Mean size of the errors of single throws over throws and moments [%]."""
        return float(np.abs(self.errors).mean())

    @property
    def largest_error(self) -> float:
        """Largest error of any moment in any throw [%]."""
        return float(np.abs(self.errors).max())

    @property
    def scatter(self) -> Floats:
        """Standard deviation of the throws about their mean [%], shape (3,)."""
        return np.asarray(self.errors.std(axis=0, ddof=1))

    @property
    def standardised(self) -> Floats:
        """Deviation of each throw from the mean of the throws in units of its formal standard deviation."""
        freedom = np.sqrt(len(self.throws) / (len(self.throws) - 1.0))
        return freedom * (self.moments - self.moments.mean(axis=0)) / self.formal

    @property
    def inflation(self) -> float:
        """Factor by which the formal standard deviations of single throws are too small, from the scatter alone."""
        return float(np.sqrt((self.standardised**2).mean()))

    def coverage(self, level: float, *, with_truth: bool = False) -> float:
        """Share of single-throw moments whose credible interval of the level holds the truth.

        With ``with_truth`` the interval includes the truth's own uncertainty.
        """
        sd = np.hypot(self.formal, self.truth_sd) if with_truth else self.formal
        return float((np.abs(self.moments - self.truth) < norm.ppf(0.5 + 0.5 * level) * sd).mean())

    @property
    def joint_distance(self) -> Floats:
        """Joint value less truth in units of jackknife and truth's uncertainty together, shape (3,)."""
        return (self.joint - self.truth) / np.hypot(self.joint_jackknife, self.truth_sd)


@dataclass(frozen=True)
class Analysis:
    """All throws under one model.

    Attributes
    ----------
    wheel, wheel_formal, wheel_jackknife : float
        Inertia of the wheel [kg m2].
    bodies : mapping of str to BodyResult
    blocks, blocks_truth, blocks_sd : (3,) array
        What the four blocks add to each principal moment (A less Empty), which needs no CAD [kg m2].
    calibration : mapping of str to (mean, sd)
        Unknowns of the device.
    drag : mapping of str to (3,) array
        [N m s]
    chi2 : mapping of str to (2,) array
        Per sample of gyro and accelerometer.
    torque : mapping of str to (T,) array
        Root mean square over throws and axes of the unexplained torque [N m], at ``torque_time``.
    com : mapping of str to (3,) array
        Centre of mass from the sensor, device included [m].
    """

    label: str
    wheel: float
    wheel_formal: float
    wheel_jackknife: float
    bodies: Mapping[str, BodyResult]
    blocks: Floats
    blocks_truth: Floats
    blocks_sd: Floats
    calibration: Mapping[str, tuple[float, float]]
    drag: Mapping[str, Floats]
    chi2: Mapping[str, Floats]
    torque: Mapping[str, Floats]
    torque_time: Floats
    com: Mapping[str, Floats]
    converged: bool


def prepare(folder: Path, timing: Timing, count: int | None, like: Posterior | None = None) -> list[Throw]:
    """Read the throws of all bodies, each started at its body's regression.

    ``like`` is a posterior of the same model whose compiled functions are used again.
    """
    model = common_model(Settings(), Timing().duration) if like is None else like.model
    throws: list[Throw] = []
    for body in BODIES:
        recordings = read_throws(folder, body, timing, count)
        start = guess(recordings, rough(body))
        for recording in recordings:
            manoeuvre = [Manoeuvre(recording, MeasuredMotion.from_recording(recording, model.robot))]
            posterior = Posterior.of(model, manoeuvre, step=STEP) if like is None else with_manoeuvres(like, manoeuvre)
            like = posterior
            z = posterior.unknowns.coordinates([start], recording.vector("rate")[1][:1])
            throws.append(Throw(body, posterior, z, np.ones(len(z)), np.ones(6)))
    return throws


def configure(throws: Sequence[Throw], settings: Settings) -> list[Throw]:
    """Give throws the prior widths and noise of their bodies under some settings."""
    names = throws[0].posterior.unknowns.names
    return [replace(t, width=widths(names, t.body, settings), noise=noise_factors(t.body, settings)) for t in throws]


def analyse(
    label: str, throws: Sequence[Throw], free: Callable[[str], bool], truth: Truth, rng: np.random.Generator
) -> Analysis:
    """Fit all throws jointly, then each throw of the bodies with the device's calibration held."""
    # each body alone first: from there the fit of all needs a few steps
    started = [fit for body in BODIES for fit in maximise_jointly([t for t in throws if t.body == body], free).throws]
    joint = maximise_jointly(started, free)
    posteriors = {throw.body: throw.posterior for throw in throws}
    wheel, moments = _bodies(posteriors, joint, joint.value[None], truth)
    wheel_draws, draws = _bodies(posteriors, joint, joint.draw(DRAWS, rng), truth)
    wheel_left, left = _bodies(posteriors, joint, np.stack([joint.without(i) for i in range(len(throws))]), truth)
    groups = [throw.body for throw in throws]
    results = {}
    for body in OBJECTS:
        single = _single_throws(joint, body, free, posteriors, float(wheel[0]), truth, rng)
        results[body] = BodyResult(
            name=body,
            throws=tuple(throw.name for throw in throws if throw.body == body),
            moments=single[0],
            formal=single[1],
            joint=moments[body][0],
            joint_formal=draws[body].std(axis=0),
            joint_jackknife=_jackknife(left[body], groups),
            truth=truth.moments[body],
            truth_sd=truth_sd(truth, body),
        )
    gain = left["A"] - left["Empty"]
    return Analysis(
        label=label,
        wheel=float(wheel[0]),
        wheel_formal=float(wheel_draws.std()),
        wheel_jackknife=float(_jackknife(wheel_left[:, None], groups)[0]),
        bodies=results,
        blocks=moments["A"][0] - moments["Empty"][0],
        blocks_truth=truth.moments["A"] - truth.moments["Empty"],
        blocks_sd=_jackknife(gain, groups),
        calibration=_calibration(joint, posteriors["A"]),
        drag={body: _shared_effect(joint, body, "air-drag") for body in BODIES},
        chi2={body: _chi2(joint, body) for body in BODIES},
        torque={body: _torque(joint, body) for body in BODIES},
        torque_time=_TIMES * (throws[0].posterior.data.times(0)[-1]),
        com={b: tensors(posteriors[b], joint.body_coordinates(b, joint.value[None])).com[0] for b in BODIES},
        converged=joint.converged,
    )


_TIMES = np.linspace(0.0, 1.0, 200)


def _first_rate(posterior: Posterior) -> Floats:
    return posterior.manoeuvres[0].recording.vector("rate")[1][:1]


def _bodies(
    posteriors: Mapping[str, Posterior], joint: Joint, values: Floats, truth: Truth
) -> tuple[Floats, dict[str, Floats]]:
    """Wheel's inertia (n,) and principal moments (n, 3) of the bodies at many points of the shared unknowns."""
    found = {body: tensors(posteriors[body], joint.body_coordinates(body, values)) for body in BODIES}
    wheel = wheel_inertia(found["cal_device"], found["cal_proof"], truth)
    moments = {
        body: object_moments(found["cal_device"], found[body], wheel, truth.device_mass, truth.mass[body])
        for body in OBJECTS
    }
    return wheel, moments


def _single_throws(
    joint: Joint,
    body: str,
    free: Callable[[str], bool],
    posteriors: Mapping[str, Posterior],
    wheel: float,
    truth: Truth,
    rng: np.random.Generator,
) -> tuple[Floats, Floats]:
    """Principal moments of each throw and their formal standard deviations; device, wheel and drag as found jointly."""
    device = tensors(posteriors["cal_device"], joint.body_coordinates("cal_device", joint.value[None]))
    moments, formal = [], []
    for throw in joint.throws:
        if throw.body == body:
            alone = maximise_jointly([throw], lambda name: free(name) and (is_own(name) or "base_link" in name))
            points = alone.body_coordinates(body, np.concatenate([alone.value[None], alone.draw(DRAWS, rng)]))
            found = tensors(throw.posterior, points)
            values = object_moments(device, found, wheel, truth.device_mass, truth.mass[body])
            moments.append(values[0])
            formal.append(values[1:].std(axis=0))
    return np.array(moments), np.array(formal)


def _jackknife(left: Floats, groups: Sequence[str]) -> Floats:
    """Return the standard error of values (n, k), each with one throw left out; throws vary within their body."""
    total = np.zeros(left.shape[1])
    for body in dict.fromkeys(groups):
        own = left[np.array(groups) == body]
        if len(own) > 1:
            total += (len(own) - 1.0) / len(own) * ((own - own.mean(axis=0)) ** 2).sum(axis=0)
    return np.sqrt(total)


def _calibration(joint: Joint, posterior: Posterior) -> dict[str, tuple[float, float]]:
    scale = {f"{effect.label}.{p.name}": p.sigma for effect in posterior.model.effects for p in effect.parameters}
    sd = np.sqrt(np.diag(joint.covariance))
    return {
        name: (float(scale[name] * value), float(scale[name] * width))
        for name, value, width in zip(joint.names, joint.value, sd, strict=True)
        if is_calibration(name)
    }


def _shared_effect(joint: Joint, body: str, label: str) -> Floats:
    throw = next(throw for throw in joint.throws if throw.body == body)
    for effect, values in zip(
        throw.posterior.model.effects, throw.posterior.unknowns.values_at(throw.z).effects, strict=True
    ):
        if effect.label == label:
            return np.asarray(values)
    return np.zeros(3)


def _chi2(joint: Joint, body: str) -> Floats:
    total, samples = np.zeros(2), np.zeros(2)
    for throw in joint.throws:
        if throw.body == body:
            residual = throw.residuals(throw.z).reshape(-1, 2, 3)
            present = throw.posterior.whitenings[0].outputs.reshape(-1, 2, 3)
            total += (residual**2).sum(axis=(0, 2))
            samples += present.sum(axis=(0, 2))
    return total / samples


def _torque(joint: Joint, body: str) -> Floats:
    square, count = np.zeros(len(_TIMES)), 0
    for throw in joint.throws:
        if throw.body != body:
            continue
        for effect, values in zip(
            throw.posterior.model.effects, throw.posterior.unknowns.values_at(throw.z).effects, strict=True
        ):
            if isinstance(effect, SmoothTorque):
                time = _TIMES * effect.spacing * (effect.knots - 1)
                square += (np.asarray(effect.torque(np.asarray(values)[0], time)) ** 2).mean(axis=1)
                count += 1
    return np.sqrt(square / max(count, 1))
