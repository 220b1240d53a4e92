"""What a rigid body with its recorded wheel lacks, named from the data of a few throws, and what that gains."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesid import Manoeuvre, Model, Posterior, Recording
from bayesid._io.progress import Progress, silent
from bayesid._math.arrays import Floats
from bayesid.diagnosis import Diagnosis, Hypothesis, candidates, diagnose
from bayesid.diagnosis.search.fitted_set import extended_posterior, extended_start
from bayesid.inference.mode import fit
from bayesid.inference.noise_changes import with_manoeuvres
from bayesid.simulation.effects import Effect
from studies.throws.analysis import Tensor, object_moments, tensors, wheel_inertia
from studies.throws.data import Truth, regress
from studies.throws.model import (
    KNOTS,
    TORQUE,
    GSensitivity,
    GyroCross,
    SmoothTorque,
    WheelDelay,
    WheelImbalance,
    WheelTilt,
    manoeuvres,
    rigid,
)
from studies.throws.raw import Timing

SPREAD = 0.1  # relative width of the body's prior about a linear regression on the throws
TESTING = 2  # throws at most that are predicted
ITERATIONS = 20

# effects of the catalogue that a stiff body with gyro, accelerometer and one wheel can show in half a second
CATALOGUE = (
    "rotational-drag",
    "rate-scale",
    "rate-misalignment",
    "rate-latency",
    "accel-position",
    "accel-scale",
    "accel-misalignment",
    "wheel-history:x",
    "wheel-history:y",
    "wheel-history:z",
)


def device_candidates(model: Model, *, records_wheels: bool) -> list[Effect]:
    """Return what such a device may lack: effects of the catalogue, and those that its user wrote.

    Effects of the recorded wheel are candidates where it is recorded.
    """
    known = candidates(model, records_wheels=records_wheels, longest=Timing().duration)
    of_user = [GyroCross(), GSensitivity(), SmoothTorque(Timing().duration, KNOTS, TORQUE)]
    wheel = [WheelTilt(), WheelDelay(), WheelImbalance()] if records_wheels else []
    return [effect for effect in known if effect.label in CATALOGUE] + [
        e.attach(model.robot) for e in (*of_user, *wheel)
    ]


@dataclass(frozen=True)
class HeldOut:
    """Log density of throws that took no part, given those that did, by the two models with the same noise."""

    names: tuple[str, ...]
    # (T,)
    rigid: Floats
    extended: Floats

    @property
    def gain(self) -> Floats:
        """By which the extended model predicts better [nats]."""
        return self.extended - self.rigid


@dataclass(frozen=True)
class Lacking:
    """The diagnosis of some throws of one body."""

    body: str
    training: tuple[str, ...]
    diagnosis: Diagnosis
    # the extended model; where nothing is named, the most probable set of known effects beside what is unknown
    taken: Hypothesis
    held_out: HeldOut
    body_found: Mapping[str, Tensor]  # rigid and extended, the device included


def lacking(
    body: str,
    recordings: Sequence[Recording],
    mass: float,
    training: int,
    seed: int,
    progress: Progress = silent,
) -> Lacking:
    """Diagnose the first throws of a body, and predict further ones with the rigid and with the extended model.

    All throws tell the noise.
    """
    used, left = recordings[:training], recordings[training : training + TESTING]
    model = rigid(regress(used, mass), SPREAD, recordings)
    throws = manoeuvres(model, used)
    effects = device_candidates(model, records_wheels=True)
    diagnosis = diagnose(model, throws, seed, effects=effects, progress=progress)
    taken = _taken(diagnosis)
    plain, longer = Posterior.of(model, throws), extended_posterior(taken)
    modes = fit(plain, plain.starting_point()).z, fit(longer, extended_start(taken, longer)).z
    testing = manoeuvres(model, left)
    predicted = (_predict(plain, modes[0], testing), _predict(longer, modes[1], testing))
    left_out = HeldOut(tuple(recording.name for recording in left), *predicted)
    bodies = {"rigid": tensors(plain, modes[0][None, :10]), "extended": tensors(longer, modes[1][None, :10])}
    return Lacking(body, tuple(recording.name for recording in used), diagnosis, taken, left_out, bodies)


def without_wheel(
    recordings: Sequence[Recording], mass: float, training: int, seed: int, progress: Progress = silent
) -> Diagnosis:
    """Take the wheel from the first throws of a body, and diagnose a body that is known to the prior's width.

    Without a wheel the motion does not tell the scale of the inertia, so that the prior stays where the regression with
    the wheel has it.
    """
    used = recordings[:training]
    model = rigid(regress(used, mass), SPREAD, recordings)
    bare = [
        replace(recording, channels={k: v for k, v in recording.channels.items() if not k.startswith("wheel_momentum")})
        for recording in used
    ]
    effects = device_candidates(model, records_wheels=False)
    return diagnose(model, manoeuvres(model, bare), seed, effects=effects, progress=progress)


def geometry_errors(studies: Sequence[Lacking], truth: Truth) -> dict[str, dict[str, Floats]]:
    """Errors of the principal moments against the geometry [%], by model and body, from the training throws alone."""
    fitted = {study.body: study.body_found for study in studies}
    errors: dict[str, dict[str, Floats]] = {}
    for name in ("rigid", "extended"):
        device = fitted["cal_device"][name]
        inertia = wheel_inertia(device, fitted["cal_proof"][name], truth)
        errors[name] = {}
        for body in truth.objects:
            moments = object_moments(device, fitted[body][name], inertia, truth.device_mass, truth.mass[body])[0]
            errors[name][body] = 100.0 * (moments / truth.moments[body] - 1.0)
    return errors


def _taken(diagnosis: Diagnosis) -> Hypothesis:
    """Return the extended model, or where nothing is named the most probable set of known effects.

    Faults of the noise belong to recordings and not to bodies; without them the noise stays as it is declared.
    """
    if diagnosis.alarm.silent:
        return diagnosis.before
    effects = {effect.label for effect in diagnosis.effects}
    sets = ([cause for cause in cause_set.causes if cause in effects] for cause_set in diagnosis.probabilities.sets)
    named = [cause for cause in diagnosis.verdict.causes if cause in effects]
    return diagnosis.fitted(named or next(sets))


def _predict(posterior: Posterior, z: Floats, testing: Sequence[Manoeuvre]) -> Floats:
    """Log density of each further throw given those of a posterior, by Laplace's approximation of both evidences."""
    base, scores = fit(posterior, z), []
    whole: Posterior | None = None
    for throw in testing:
        throws = [*posterior.manoeuvres, throw]
        whole = Posterior.of(posterior.model, throws) if whole is None else with_manoeuvres(whole, throws)
        known = dict(zip(posterior.unknowns.names, base.z, strict=True))
        pairs = zip(whole.unknowns.names, whole.starting_point(), strict=True)
        both = fit(whole, _alone(whole, np.array([known.get(name, value) for name, value in pairs])))
        scores.append(both.log_evidence(whole) - base.log_evidence(posterior))
    return np.array(scores)


def _alone(whole: Posterior, z: Floats) -> Floats:
    """Fit what belongs to the last throw alone, so that the fit of all starts near its mode."""
    last = f"[{len(whole.manoeuvres) - 1}]"
    last_unknowns = [index for index, name in enumerate(whole.unknowns.names) if last in name]
    for _ in range(ITERATIONS):
        jacobian = whole.jacobian(z)[:, last_unknowns]
        step = np.linalg.solve(jacobian.T @ jacobian, jacobian.T @ whole.least_squares(z))
        z = z.copy()
        z[last_unknowns] -= step
        if np.abs(step).max() < 1e-6:
            break
    return z
