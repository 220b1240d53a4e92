"""What a rigid body with its wheel gets wrong about real throws, and what naming it gains."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bayesid import BodyPrior, Manoeuvre, MeasuredMotion, Model, Posterior, Recording
from bayesid._io.progress import Progress, silent
from bayesid.diagnosis import Diagnosis, Frame, Hypothesis, candidates, diagnose
from bayesid.diagnosis.diagnosis_run import extended_posterior, extended_start
from bayesid.inference.mode import fit
from bayesid.inference.noise_changes import with_manoeuvres
from bayesid.simulation.effects import Effect
from studies.throws.bodies import Tensor, object_moments, tensors, wheel_inertia
from studies.throws.data import BODIES, Timing, Truth, read_throws
from studies.throws.effects import GyroCross, ThrowBias, WheelTilt
from studies.throws.model import STEP, Settings, build_model, rough
from studies.throws.start import guess

__all__ = ["Comparison", "HeldOut", "Study", "Wheel", "compare", "find_wheel", "predict", "study_body"]

Floats = NDArray[np.floating]

SPREAD = 0.1
"""Relative width of the prior about the regression on the training throws."""

ITERATIONS = 20


class FineBias(ThrowBias):
    """The accelerometer's bias of each throw, which also asks for an integration step that suits half a second."""

    @property
    def longest_step(self) -> float:
        """Of the study of the throws [s]."""
        return STEP


@dataclass(frozen=True)
class HeldOut:
    """Throws that took no part in the fit, predicted by two models.

    Attributes
    ----------
    names : tuple of str
    score : dict of str to (T,) array
        Log density of each throw given the training throws, by model.
    chi2 : dict of str to (T,) array
        Per sample, body and effects as the training throws say; the throw's own initial rate and accelerometer bias are
        fitted to it.
    """

    names: tuple[str, ...]
    score: Mapping[str, Floats]
    chi2: Mapping[str, Floats]


@dataclass(frozen=True)
class Study:
    """The diagnosis of some throws of one body.

    Attributes
    ----------
    training : tuple of str
    taken : Hypothesis
        The extended model; where something is there and nothing is named, the most probable set of known causes.
    held_out : HeldOut
    """

    body: str
    training: tuple[str, ...]
    diagnosis: Diagnosis
    taken: Hypothesis
    held_out: HeldOut


@dataclass(frozen=True)
class Wheel:
    """The wheel's momentum taken from the model.

    Attributes
    ----------
    time : list of (S,) arrays
        Per throw [s].
    needed : list of (S, 3) arrays
        Torque that the motion needs beyond the model, base axes [N m].
    recorded : list of (S, 3) arrays
        Torque of the recorded wheel, -(dh/dt + w x h) [N m].
    correlation : (3,) array
        Between the two over all throws, per axis.
    size : (3,) array
        Slope of the needed against the recorded torque.
    """

    diagnosis: Diagnosis
    time: list[Floats]
    needed: list[Floats]
    recorded: list[Floats]
    correlation: Floats
    size: Floats


@dataclass(frozen=True)
class Comparison:
    """Principal moments of the bodies without the device against the authors' geometry [%], by model."""

    labels: Mapping[str, tuple[str, ...]]
    wheel: Mapping[str, float]
    errors: Mapping[str, Mapping[str, Floats]]


def study_body(
    folder: Path,
    body: str,
    training: int,
    testing: int,
    seed: int,
    names: Sequence[str] | None = None,
    progress: Progress = silent,
) -> Study:
    """Diagnose the first throws of a body and predict the next ones."""
    recordings = read_throws(folder, body, Timing(), training + testing)
    model = plain_model(body, recordings[:training])
    throws = _manoeuvres(model, recordings)
    own = [effect.attach(model.robot) for effect in (GyroCross(), WheelTilt())]
    effects = [*_rigid(model, names, records_wheels=True), *own]
    found = diagnose(model, throws[:training], seed, effects=effects, progress=progress)
    taken = _taken(found)
    names = tuple(recording.name for recording in recordings)
    return Study(body, names[:training], found, taken, predict(model, taken, throws[:training], throws[training:]))


def _taken(found: Diagnosis) -> Hypothesis:
    """Return the extended model, or where nothing is named the most probable one with effects alone.

    Faults of the noise belong to the recordings and not to the bodies, which are compared across recordings.
    """
    effects = {effect.label for effect in found.effects}
    known = (item for item in found.probabilities.sets if item.causes and item.generic is None)
    best = next((item for item in known if effects.issuperset(item.causes)), None)
    return found.after if found.verdict.causes or found.alarm.silent or best is None else found.fitted(best.causes)


def plain_model(body: str, recordings: Sequence[Recording]) -> Model:
    """Return the rigid body with its wheel; every throw has an initial rate and an accelerometer bias of its own."""
    settings = Settings()
    prior = BodyPrior("base_link", guess(recordings, rough(body)), SPREAD)
    model = build_model(body, settings, Timing().duration)
    return replace(model, priors=(prior,), effects=(FineBias(settings.bias_sigma),))


def _rigid(model: Model, names: Sequence[str] | None, *, records_wheels: bool) -> list[Effect]:
    """Candidates without hidden vibrations: these bodies are stiff, the catalogue's sizes a spacecraft's."""
    found = [effect for effect in candidates(model, records_wheels=records_wheels) if not effect.modes_count]
    return [effect for effect in found if names is None or effect.label in names]


def _manoeuvres(model: Model, recordings: Sequence[Recording]) -> list[Manoeuvre]:
    return [Manoeuvre(recording, MeasuredMotion.from_recording(recording, model.robot)) for recording in recordings]


def predict(model: Model, taken: Hypothesis, training: Sequence[Manoeuvre], testing: Sequence[Manoeuvre]) -> HeldOut:
    """Predict throws by the plain model and by a hypothesis."""
    extended = extended_posterior(taken)
    starts = {
        "rigid": (Posterior.of(model, training), None),
        "extended": (Posterior.of(extended.model, training), extended_start(taken, extended)),
    }
    score: dict[str, list[float]] = {}
    chi2: dict[str, list[float]] = {}
    for name, (posterior, start) in starts.items():
        mode = fit(posterior, posterior.starting_point() if start is None else start)
        whole: Posterior | None = None
        for throw in testing:
            manoeuvres = [*training, throw]
            whole = Posterior.of(posterior.model, manoeuvres) if whole is None else with_manoeuvres(whole, manoeuvres)
            z = _carried(posterior, mode.z, whole)
            z, residual = _alone(whole, z)
            chi2.setdefault(name, []).append(float((residual**2).sum()) / whole.whitenings[-1].samples)
            both = fit(whole, z)
            score.setdefault(name, []).append(both.log_evidence(whole) - mode.log_evidence(posterior))
    return HeldOut(
        tuple(throw.recording.name for throw in testing),
        {name: np.array(values) for name, values in score.items()},
        {name: np.array(values) for name, values in chi2.items()},
    )


def _carried(posterior: Posterior, z: Floats, whole: Posterior) -> Floats:
    """Carry a mode over to a posterior with more throws."""
    known = dict(zip(posterior.unknowns.names, z, strict=True))
    start = whole.starting_point()
    return np.array([known.get(name, value) for name, value in zip(whole.unknowns.names, start, strict=True)])


def _alone(whole: Posterior, z: Floats) -> tuple[Floats, Floats]:
    """Fit what belongs to the last throw alone; return the point and that throw's residuals."""
    last = len(whole.manoeuvres) - 1
    own = [index for index, name in enumerate(whole.unknowns.names) if f"[{last}]" in name]
    for _ in range(ITERATIONS):
        jacobian = whole.jacobian(z)[:, own]
        step = np.linalg.solve(jacobian.T @ jacobian, jacobian.T @ whole.least_squares(z))
        z = z.copy()
        z[own] -= step
        if np.abs(step).max() < 1e-9:
            break
    return z, whole.residuals(z)[last]


def find_wheel(
    folder: Path,
    body: str,
    count: int,
    seed: int,
    names: Sequence[str] | None = None,
    progress: Progress = silent,
) -> Wheel:
    """Take the wheel from model and recordings, and have it found."""
    recordings = read_throws(folder, body, Timing(), count)
    model = plain_model(body, recordings)
    bare = [
        replace(
            recording,
            channels={
                key: values for key, values in recording.channels.items() if not key.startswith("wheel_momentum")
            },
        )
        for recording in recordings
    ]
    found = diagnose(
        model, _manoeuvres(model, bare), seed, effects=_rigid(model, names, records_wheels=False), progress=progress
    )
    needed = [np.asarray(torque) for torque in found.unexplained.torque[Frame.BASE]]
    recorded = [
        _wheel_torque(recording, time) for recording, time in zip(recordings, found.unexplained.time, strict=True)
    ]
    left, right = np.concatenate(needed), np.concatenate(recorded)
    correlation = np.array([np.corrcoef(left[:, k], right[:, k])[0, 1] for k in range(3)])
    size = (left * right).sum(axis=0) / (right**2).sum(axis=0)
    return Wheel(found, list(found.unexplained.time), needed, recorded, correlation, size)


def _wheel_torque(recording: Recording, time: Floats) -> Floats:
    """Torque of the recorded wheel on the body at some times, (S, 3)."""
    at, momentum = recording.vector("wheel_momentum")
    slope = np.gradient(momentum, at, axis=0)
    seen, rate = recording.vector("rate")

    def on(grid: Floats, values: Floats) -> Floats:
        return np.stack([np.interp(time, grid, values[:, k]) for k in range(3)], axis=1)

    return -(on(at, slope) + np.cross(on(seen, rate), on(at, momentum)))


def compare(folder: Path, studies: Sequence[Study], count: int, truth: Truth) -> Comparison:
    """Identify all bodies rigidly and with the effects taken for each body, and compare with the stated geometry.

    The calibration bodies, which fix the wheel's inertia, are extended by the effects of the first study.
    """
    chosen = {study.body: study.taken for study in studies}
    taken = {body: chosen.get(body, studies[0].taken) for body in BODIES}
    found: dict[str, dict[str, Tensor]] = {"rigid": {}, "extended": {}}
    for body in BODIES:
        recordings = read_throws(folder, body, Timing(), count)
        model = plain_model(body, recordings)
        throws = _manoeuvres(model, recordings)
        rigid = Posterior.of(model, throws)
        mode = fit(rigid, rigid.starting_point())
        found["rigid"][body] = tensors(rigid, mode.z[None, :10])
        longer = model
        for effect in taken[body].fit.effects:
            longer = longer.extend(effect)
        extended = Posterior.of(longer, throws)
        mode = fit(extended, _carried(rigid, mode.z, extended))
        found["extended"][body] = tensors(extended, mode.z[None, :10])
    wheel, errors = {}, {}
    for name, parts in found.items():
        inertia = wheel_inertia(parts["cal_device"], parts["cal_proof"], truth)
        wheel[name] = float(inertia[0])
        errors[name] = {
            body: 100.0
            * (
                object_moments(parts["cal_device"], parts[body], inertia, truth.device_mass, truth.mass[body])[0]
                / truth.moments[body]
                - 1.0
            )
            for body in ("Empty", "A")
        }
    labels = {body: tuple(effect.label for effect in hypothesis.fit.effects) for body, hypothesis in taken.items()}
    return Comparison(labels, wheel, errors)
