"""The analysis of all throws under one model: calibration, bodies, and how the throws scatter about them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bayesid import Posterior
from studies.throws.bodies import Tensor, object_moments, tensors, truth_sd, wheel_inertia
from studies.throws.body_result import BodyResult
from studies.throws.data import Timing, Truth, read_throws
from studies.throws.effects import STEP
from studies.throws.joint import Joint, Throw, maximise_jointly
from studies.throws.left_over import LeftOver, left_over
from studies.throws.model import extended, is_calibration, is_own, manoeuvres
from studies.throws.regression import regress
from studies.throws.smooth_widths import SMOOTH, SmoothWidth, fit_widths, width_of

__all__ = ["Analysis", "analyse", "prepare"]

Floats = NDArray[np.floating]

DRAWS = 1000


@dataclass(frozen=True)
class Analysis:
    """All throws under one model.

    Attributes
    ----------
    wheel, wheel_formal, wheel_jackknife : float
        Inertia of the wheel [kg m2].
    bodies : mapping of str to BodyResult
    widths : mapping of str to mapping of str to SmoothWidth
        Of the unexplained torque and force, by body; empty for a rigid model.
    noise : mapping of str to (6,) array
        Noise of gyro and accelerometer relative to that of quiet stretches.
    calibration : mapping of str to (mean, sd)
        Unknowns of the device, in standard deviations of their priors times those: physical units.
    left : mapping of str to LeftOver
        What the model leaves, by body; empty for a rigid model.
    """

    label: str
    wheel: float
    wheel_formal: float
    wheel_jackknife: float
    bodies: Mapping[str, BodyResult]
    widths: Mapping[str, Mapping[str, SmoothWidth]]
    noise: Mapping[str, Floats]
    calibration: Mapping[str, tuple[float, float]]
    left: Mapping[str, LeftOver]
    converged: bool


def prepare(folder: Path, truth: Truth, count: int | None) -> list[Throw]:
    """Read the throws of all bodies, each started at its body's regression."""
    throws: list[Throw] = []
    for body in truth.bodies:
        recordings = read_throws(folder, body, Timing(), count)
        model = extended(regress(recordings, truth.thrown_mass(body)), recordings, Timing().duration)
        for recording in recordings:
            posterior = Posterior.of(model, manoeuvres(model, [recording]), step=STEP)
            throws.append(Throw(body, posterior, posterior.starting_point(), np.ones(posterior.size), np.ones(6)))
    return throws


def analyse(
    label: str,
    throws: Sequence[Throw],
    free: Callable[[str], bool],
    truth: Truth,
    rng: np.random.Generator,
    folder: Path,
    *,
    smooth: bool = True,
) -> Analysis:
    """Fit all throws jointly, then each throw of the bodies with the device's calibration held.

    Parameters
    ----------
    free : callable
        Which unknowns are fitted.
    folder : path
        Of the measurements.
    smooth : bool
        Whether these hold the unexplained torque and force, whose widths are then estimated.
    """
    started: list[Throw] = []
    for body in truth.bodies:  # each body alone first: from there the fit of all needs a few steps
        own = [throw for throw in throws if throw.body == body]
        started += fit_widths(own, free) if smooth else maximise_jointly(own, free).throws
    joint = maximise_jointly(started, free)
    posteriors = {throw.body: throw.posterior for throw in throws}
    wheel, moments = _bodies(posteriors, joint, joint.value[None], truth)
    wheel_draws, draws = _bodies(posteriors, joint, joint.draw(DRAWS, rng), truth)
    wheel_left, left = _bodies(posteriors, joint, np.stack([joint.without(i) for i in range(len(throws))]), truth)
    groups = [throw.body for throw in throws]
    device = tensors(posteriors["cal_device"], joint.body_coordinates("cal_device", joint.value[None]))
    scale = float(_jackknife(wheel_left[:, None], groups)[0])
    results = {}
    for body in truth.objects:
        single = [throw for throw in joint.throws if throw.body == body]
        found = [_single(throw, free, device, float(wheel[0]), truth, rng) for throw in single]
        results[body] = BodyResult(
            name=body,
            throws=tuple(throw.name for throw in single),
            moments=np.array([value for value, _ in found]),
            formal=np.array([sd for _, sd in found]),
            joint=moments[body][0],
            joint_formal=draws[body].std(axis=0),
            joint_jackknife=_jackknife(left[body], groups),
            truth=truth.moments[body],
            truth_sd=truth_sd(truth, body),
        )
    return Analysis(
        label=label,
        wheel=float(wheel[0]),
        wheel_formal=float(wheel_draws.std()),
        wheel_jackknife=scale,
        bodies=results,
        widths={b: {e: width_of(joint, b, e) for e in SMOOTH} for b in truth.bodies} if smooth else {},
        noise={throw.body: throw.noise for throw in joint.throws},
        calibration=_calibration(joint, throws[0].posterior),
        left={b: left_over([t for t in joint.throws if t.body == b], folder) for b in truth.bodies} if smooth else {},
        converged=joint.converged,
    )


def _bodies(
    posteriors: Mapping[str, Posterior], joint: Joint, values: Floats, truth: Truth
) -> tuple[Floats, dict[str, Floats]]:
    """Wheel's inertia (n,) and principal moments (n, 3) of the bodies at many points of the shared unknowns."""
    found = {body: tensors(posteriors[body], joint.body_coordinates(body, values)) for body in truth.bodies}
    wheel = wheel_inertia(found["cal_device"], found["cal_proof"], truth)
    moments = {
        body: object_moments(found["cal_device"], found[body], wheel, truth.device_mass, truth.mass[body])
        for body in truth.objects
    }
    return wheel, moments


def _single(
    throw: Throw,
    free: Callable[[str], bool],
    device: Tensor,
    wheel: float,
    truth: Truth,
    rng: np.random.Generator,
) -> tuple[Floats, Floats]:
    """Principal moments of one throw and their formal standard deviations; device, wheel and drag as found jointly."""
    alone = maximise_jointly([throw], lambda name: free(name) and (is_own(name) or "base_link" in name))
    points = alone.body_coordinates(throw.body, np.concatenate([alone.value[None], alone.draw(DRAWS, rng)]))
    found = tensors(throw.posterior, points)
    values = object_moments(device, found, wheel, truth.device_mass, truth.mass[throw.body])
    return values[0], values[1:].std(axis=0)


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
