"""One case: the diagnosis, its causes one by one, and the attitude simulated before and after."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from bayesid import Kind, Model, Posterior, Sensor, White
from bayesid._io.progress import Progress, silent
from bayesid.diagnosis import Diagnosis, Hypothesis, diagnose
from bayesid.diagnosis.cause_amplitudes import amplitudes_of
from bayesid.inference.predicted_readings import predicted_readings
from bayesid.simulation.effects import create
from studies.ets7_drift.world import ATTITUDE_SIGMA, World, model_of

__all__ = ["CAUSES", "Amplitude", "Attitude", "Case", "Result", "analyse"]

Floats = NDArray[np.floating]

CAUSES = ("initial-rate", "gravity-gradient", "wheel-momentum")
"""What the truth has and the simulation lacks."""


@dataclass(frozen=True)
class Amplitude:
    """A true amplitude beside the one found."""

    name: str
    unit: str
    truth: float
    mean: float
    sd: float

    @property
    def distance(self) -> float:
        """Found less true, in standard deviations."""
        return (self.mean - self.truth) / self.sd


@dataclass(frozen=True)
class Attitude:
    """Attitude of the base in one recording, Euler angles x, y, z since its start, (T, 3) [degrees].

    Attributes
    ----------
    measured : (T, 3) array
    plain : (T, 3) array
        Simulated by the present model as it stands.
    fitted : (T, 3) array
        By the present model after its base was fitted to the rates.
    extended : (T, 3) array
        By the extended model; the fitted present model where nothing is named.
    errors : dict of str to float
        Root mean square of the angle between measured and simulated attitude [degrees].
    """

    time: Floats
    measured: Floats
    plain: Floats
    fitted: Floats
    extended: Floats
    errors: Mapping[str, float]


@dataclass(frozen=True)
class Case:
    """One world and what the diagnosis made of it.

    Attributes
    ----------
    spread : float
        Relative width of the base's prior.
    steps : tuple of Hypothesis
        The present model, then the most probable sets of one, two and three causes that were tried; where causes are
        named, of these.
    """

    world: World
    spread: float
    diagnosis: Diagnosis
    steps: tuple[Hypothesis, ...]
    amplitudes: tuple[Amplitude, ...]
    attitudes: tuple[Attitude, ...]

    @property
    def found(self) -> bool:
        """Whether the three true causes are named, and no other."""
        return set(self.diagnosis.verdict.causes) == set(CAUSES)


@dataclass(frozen=True)
class Result:
    """The cases by name: main, and in a full run loose."""

    cases: Mapping[str, Case]

    @property
    def main(self) -> Case:
        """The case of the paper's figure."""
        return self.cases["main"]


def analyse(
    world: World,
    spread: float,
    seed: int,
    progress: Progress = silent,
    *,
    names: Sequence[str] | None = None,
    compared: bool = True,
) -> Case:
    """Diagnose the rates of a world; the attitude is only compared with.

    Parameters
    ----------
    names : sequence of str, optional
        Candidates; the whole catalogue where left out.
    compared : bool
        Whether to simulate the attitude.
    """
    model = model_of(spread)
    effects = None if names is None else [create(name).attach(model.robot) for name in names]
    found = diagnose(model, world.manoeuvres, seed, effects=effects, progress=progress)
    attitudes = _attitudes(model, found) if compared else ()
    return Case(world, spread, found, _steps(found), tuple(_amplitudes(world, found)), tuple(attitudes))


def _steps(found: Diagnosis) -> tuple[Hypothesis, ...]:
    """Return the present model and the most probable hypothesis of each number of causes."""
    best, named = {0: found.search.base}, set(found.verdict.causes)
    for hypothesis in found.search.tried[1:]:
        if not named or set(hypothesis.labels) <= named:
            best.setdefault(len(hypothesis.labels), hypothesis)
    return tuple(best[count] for count in sorted(best))


def _amplitudes(world: World, found: Diagnosis) -> Sequence[Amplitude]:
    rows = []
    if "wheel-momentum" in found.after.labels:
        for truth, ((key, unit), mean, sd) in zip(
            world.momentum, amplitudes_of(found.after, "wheel-momentum"), strict=True
        ):
            rows.append(Amplitude(f"wheel momentum {key}", unit, float(truth), mean, sd))
    if "initial-rate" in found.after.labels:
        for truth, ((key, unit), mean, sd) in zip(
            world.rates.ravel(), amplitudes_of(found.after, "initial-rate"), strict=True
        ):
            rows.append(Amplitude(f"initial rate, {key}", unit, float(truth), mean, sd))
    return rows


def _attitudes(model: Model, found: Diagnosis) -> Sequence[Attitude]:
    before = found.before.fit.z[found.before.engine.free]
    simulated = {
        "plain": _simulated(model, found, np.zeros_like(before)),
        "fitted": _simulated(model, found, before),
        "extended": _simulated(found.posterior.model, found, found.start),
    }
    rows = []
    for index, manoeuvre in enumerate(found.before.fit.posterior.manoeuvres):
        time, recorded = manoeuvre.recording.vector("attitude", ("x", "y", "z", "w"))
        measured, start = Rotation.from_quat(recorded), Rotation.from_quat(manoeuvre.attitude).inv()
        curves = {name: Rotation.from_quat(attitudes[index]) for name, attitudes in simulated.items()}
        errors = {
            name: float(np.degrees(np.sqrt(((measured.inv() * curve).magnitude() ** 2).mean())))
            for name, curve in curves.items()
        }
        angles = [_angles(start * curve) for curve in (measured, *curves.values())]
        rows.append(Attitude(time, angles[0], angles[1], angles[2], angles[3], errors))
    return rows


def _angles(turned: Rotation) -> Floats:
    return np.unwrap(turned.as_euler("xyz", degrees=True), axis=0, period=360.0)


def _simulated(model: Model, found: Diagnosis, z: Floats) -> list[Floats]:
    """Simulate the attitude of all recordings."""
    sensors = (*model.sensors, Sensor(Kind.ATTITUDE, White(ATTITUDE_SIGMA)))
    posterior = Posterior.of(replace(model, sensors=sensors), found.posterior.manoeuvres)
    return [np.asarray(predicted.attitude) for predicted in predicted_readings(posterior, z)]
