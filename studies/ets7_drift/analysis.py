"""The diagnosis, its causes one by one, and the attitude simulated before and predicted after, with its band."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from bayesid import Model, Posterior, Sensor, SensorKind, White
from bayesid._io.progress import Progress, silent
from bayesid._math.arrays import Floats
from bayesid.diagnosis import CauseSet, Diagnosis, Hypothesis, diagnose
from bayesid.diagnosis.outcome.candidate_table import amplitudes_of
from bayesid.identifiability.local_knowledge import Knowledge
from bayesid.inference.predicted_readings import predicted_readings
from bayesid.simulation.effects import create
from studies.ets7_drift.world import ATTITUDE_SIGMA, World, model_of

__all__ = ["CAUSES", "Amplitude", "Attitude", "Case", "Step", "analyse"]

# causes that act in the truth and that the simulation lacks
CAUSES = ("initial-rate", "gravity-gradient", "wheel-momentum")

DRAWS = 200  # number of draws for the band about the predicted attitude
MOST = 3  # largest number of causes of a set that is shown


@dataclass(frozen=True)
class Step:
    """The most probable set of one number of causes, and its fit."""

    found: CauseSet
    fitted: Hypothesis


@dataclass(frozen=True)
class Amplitude:
    """A true amplitude, or another quantity, beside its estimate."""

    # name and unit of the quantity
    name: str
    unit: str
    # true value, posterior mean and standard deviation, in the unit
    truth: float
    mean: float
    sd: float

    @property
    def distance(self) -> float:
        """Estimate less the truth, in standard deviations."""
        return (self.mean - self.truth) / self.sd


@dataclass(frozen=True)
class Attitude:
    """Attitude of the base in one recording, Euler angles x, y, z since its start."""

    time: Floats  # (T,): sample times [s]
    measured: Floats  # (T, 3): measured angles [degrees]
    plain: Floats  # (T, 3): angles simulated by the present model as it stands [degrees]
    fitted: Floats  # (T, 3): angles simulated by the present model after its base was fitted to the rates [degrees]
    # (T, 3): angles simulated by the extended model [degrees]; the fitted present model where nothing is named
    extended: Floats
    missed: Floats  # (T, 3): rotation from the measured attitude to the extended model's, about base axes [degrees]
    # (T, 3): predicted standard deviation of ``missed``: from what is not known of the model and the attitude's noise
    sd: Floats
    # root mean square angle between measured and simulated attitude [degrees], by the name of the simulation
    errors: Mapping[str, float]


@dataclass(frozen=True)
class Case:
    """The world and its diagnosis."""

    world: World  # what truly happens
    diagnosis: Diagnosis  # diagnosis of the rates
    # the present model, then the most probable sets of one, two and three causes, without anything unknown; where
    # causes are named, the most probable sets of these
    steps: tuple[Step, ...]
    amplitudes: tuple[Amplitude, ...]  # amplitudes of the named causes that have any
    attitudes: tuple[Attitude, ...]  # attitude in every recording

    @property
    def right(self) -> bool:
        """True if the three true causes are named, and no other."""
        return set(self.diagnosis.verdict.causes) == set(CAUSES)

    @property
    def distances(self) -> Floats:
        """Errors of the predicted attitude at the end of each recording, in predicted deviations, (recordings, 3)."""
        return np.array([attitude.missed[-1] / attitude.sd[-1] for attitude in self.attitudes])


def analyse(
    world: World, spread: float, seed: int, progress: Progress = silent, *, names: Sequence[str] | None = None
) -> Case:
    """Diagnose the rates of a world; the attitude is not used, but compared with.

    Parameters
    ----------
    world : World
        What truly happens.
    spread : float
        Relative width of the base's prior.
    seed : int
        Seed of the diagnosis, and of the draws for the band.
    progress : callable, optional
        Receives a fraction and a sentence.
    names : sequence of str, optional
        Names of the candidates, by default the whole catalogue.
    """
    model = model_of(spread)
    effects = None if names is None else [create(name).attach(model.robot) for name in names]
    result = diagnose(model, world.manoeuvres, seed, effects=effects, progress=progress)
    attitudes = tuple(_attitudes(model, result, np.random.default_rng(seed)))
    return Case(world, result, _steps(result), tuple(_amplitudes(world, result)), attitudes)


def _steps(result: Diagnosis) -> tuple[Step, ...]:
    """Return the present model and the most probable set of each number of causes."""
    best: dict[int, CauseSet] = {}
    named = set(result.verdict.causes)
    for item in result.probabilities.sets:
        if item.generic is None and (not named or set(item.causes) <= named):
            best.setdefault(len(item.causes), item)
    return tuple(Step(best[count], _fitted(result, best[count])) for count in sorted(best) if count <= MOST)


def _fitted(result: Diagnosis, item: CauseSet) -> Hypothesis:
    return result.after if set(item.causes) == set(result.verdict.causes) else result.fitted(item.causes)


def _amplitudes(world: World, result: Diagnosis) -> Iterator[Amplitude]:
    for label, title, truths in (
        ("wheel-momentum", "wheel momentum ", world.momentum),
        ("initial-rate", "initial rate, ", world.rates.ravel()),
    ):
        if label in result.after.labels:
            for truth, ((key, unit), mean, sd) in zip(truths, amplitudes_of(result.after, label), strict=True):
                yield Amplitude(f"{title}{key}", unit, float(truth), mean, sd)


def _attitudes(model: Model, result: Diagnosis, rng: np.random.Generator) -> Iterator[Attitude]:
    before, present = result.before.fit.z[result.before.perturbed.free], _watched(model, result)
    extended = _watched(result.posterior.model, result)
    simulated = {
        "plain": _simulated(present, np.zeros_like(before)),
        "fitted": _simulated(present, before),
        "extended": _simulated(extended, result.start),
    }
    # draws from the posterior of the extended model, linearised at its fit
    root = np.linalg.cholesky(Knowledge.at(result.posterior, result.start).coordinates)
    draws = [_simulated(extended, result.start + root @ rng.standard_normal(len(root))) for _ in range(DRAWS)]
    for index, manoeuvre in enumerate(result.before.fit.posterior.manoeuvres):
        time, recorded = manoeuvre.recording.vector("attitude", ("x", "y", "z", "w"))
        measured, start = Rotation.from_quat(recorded), Rotation.from_quat(manoeuvre.attitude).inv()
        curves = {name: Rotation.from_quat(attitudes[index]) for name, attitudes in simulated.items()}
        squares = {name: (measured.inv() * curve).magnitude() ** 2 for name, curve in curves.items()}
        errors = {name: float(np.degrees(np.sqrt(square.mean()))) for name, square in squares.items()}
        angles = {name: _angles(start * curve) for name, curve in curves.items()}
        best = curves["extended"]
        turned = np.array([(best.inv() * Rotation.from_quat(draw[index])).as_rotvec() for draw in draws])
        yield Attitude(
            time,
            _angles(start * measured),
            **angles,
            missed=np.degrees((measured.inv() * best).as_rotvec()),
            sd=np.degrees(np.sqrt((turned**2).mean(axis=0) + ATTITUDE_SIGMA**2)),
            errors=errors,
        )


def _angles(turned: Rotation) -> Floats:
    return np.unwrap(turned.as_euler("xyz", degrees=True), axis=0, period=360.0)


def _watched(model: Model, result: Diagnosis) -> Posterior:
    """Return the posterior of a model that has the attitude as a sensor too."""
    sensors = (*model.sensors, Sensor(SensorKind.ATTITUDE, White(ATTITUDE_SIGMA)))
    return Posterior.of(replace(model, sensors=sensors), result.posterior.manoeuvres)


def _simulated(posterior: Posterior, z: Floats) -> list[Floats]:
    """Return the simulated attitudes of all recordings."""
    return [np.asarray(predicted.attitude) for predicted in predicted_readings(posterior, z)]
