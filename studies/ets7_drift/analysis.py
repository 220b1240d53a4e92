"""Recordings of the flight's manoeuvre with causes that a model lacks, their diagnosis, and the predicted attitude."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from bayesid import BodyPrior, InertialParameters, Manoeuvre, Model, Orbit, Posterior, Sensor, SensorKind, White
from bayesid._io.progress import Progress, silent
from bayesid._math.arrays import Floats
from bayesid.diagnosis import CauseSet, Diagnosis, Hypothesis, diagnose
from bayesid.diagnosis.outcome.candidate_table import amplitudes_of
from bayesid.identifiability.local_knowledge import Knowledge
from bayesid.inference.predicted_readings import predicted_readings
from bayesid.simulation.effects import create
from studies.common.ets7 import BASE, RADIUS, FlightManoeuvre, ets7
from studies.common.flight import ORBIT, fly, light_wheel, record
from studies.truth.mujoco import Body, nearby

DURATION = 300.0  # duration of a recording [s]; the attitude control is off throughout
INTERVAL = 1.0  # time between samples of all sensors [s]

# manoeuvre of the flight from joints at zero, each of its linear ramps replaced by a smooth quintic
MOTION = FlightManoeuvre(np.zeros(6), corner=None)

STEP = 0.25  # integration step of MuJoCo [s]

# noise per sample of rates (two seconds of arc per second), attitude (twenty seconds of arc) and joints [rad/s, rad,
# rad]
RATE_SIGMA, ATTITUDE_SIGMA, ENCODER_SIGMA = 1e-5, 1e-4, 1e-5

MOMENTUM = (0.6, -0.4, 0.8)  # momentum left in the reaction wheels [N m s]
RATE = 3e-4  # standard deviation of the initial rates about each axis [rad/s]: a degree in a minute

# to what the base's mass is known -> relative width of the base's prior, of which the true base is a draw
KNOWN = {"5 %": 0.025, "1 %": 0.005}


@dataclass(frozen=True)
class World:
    """What truly happens in a set of recordings."""

    momentum: Floats  # (3,): momentum of the wheels [N m s]
    rates: Floats  # (R, 3): initial rates [rad/s]
    base: Floats  # (10,): reported quantities of the true base body
    manoeuvres: tuple[Manoeuvre, ...]  # manoeuvres as recorded, with noise


def draw_world(recordings: int, seed: int, spread: float, duration: float = DURATION) -> World:
    """Draw a true base, attitudes, places on the orbit and initial rates; simulate and measure.

    Parameters
    ----------
    recordings, seed : int; number of recordings, and seed of all random numbers
    spread : float; relative width of the draw of the true base about the published one
    duration : float; duration of a recording [s]
    """
    rng, robot = np.random.default_rng(seed), ets7()
    published = robot.link(BASE).inertial
    base = nearby(Body(published.mass, published.com, published.inertia), rng, spread)
    wheels = np.array(MOMENTUM)
    manoeuvres, rates = [], RATE * rng.standard_normal((recordings, 3))
    time = np.arange(0.0, duration + 0.5 * INTERVAL, INTERVAL)
    true = robot.with_inertial(BASE, InertialParameters(base.mass, base.com, base.inertia))
    noise = {"position": ENCODER_SIGMA, "attitude": ATTITUDE_SIGMA, "rate": RATE_SIGMA}
    for index, rate in enumerate(rates):
        latitude = float(rng.uniform(0.0, 2.0 * np.pi))
        attitude = Rotation.random(rng=rng).as_quat()
        orbit, rotor = replace(ORBIT, argument_of_latitude=latitude), light_wheel(wheels)
        truth = fly(true, MOTION, time, step=STEP, rate=rate, attitude=attitude, orbit=orbit, rotor=rotor)
        manoeuvre = record(truth, f"flight {index + 1}", robot, noise, rng)
        manoeuvres.append(replace(manoeuvre, attitude=attitude, argument_of_latitude=latitude))
    return World(wheels, rates, base.quantities, tuple(manoeuvres))


def model_of(spread: float) -> Model:
    """Return the model that starts at rest and has no disturbance, with the published base as prior.

    It uses the rates alone; the measured attitude is kept for comparison.
    """
    robot = ets7()
    return Model(
        robot,
        (Sensor(SensorKind.RATE, White(RATE_SIGMA)),),
        (BodyPrior(BASE, robot.link(BASE).inertial, spread),),
        orbit=Orbit(RADIUS),
        rate_sigma=0.0,
    )


# causes that act in the truth and that the simulation lacks
CAUSES = ("initial-rate", "gravity-gradient", "wheel-momentum")

DRAWS = 200  # number of draws for the band about the predicted attitude
MOST = 3  # largest number of causes of a set that is shown


@dataclass(frozen=True)
class Step:
    """The most probable set of one number of causes, and its fit."""

    cause_set: CauseSet
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
    world : World; what truly happens
    spread : float; relative width of the base's prior
    seed : int; seed of the diagnosis, and of the draws for the band
    progress : callable, optional; receives a fraction and a sentence
    names : sequence of str, optional; names of the candidates, by default the whole catalogue
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
    for cause_set in result.probabilities.sets:
        if cause_set.generic is None and (not named or set(cause_set.causes) <= named):
            best.setdefault(len(cause_set.causes), cause_set)
    return tuple(Step(best[count], _fitted(result, best[count])) for count in sorted(best) if count <= MOST)


def _fitted(result: Diagnosis, cause_set: CauseSet) -> Hypothesis:
    return result.after if set(cause_set.causes) == set(result.verdict.causes) else result.fitted(cause_set.causes)


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
    return [np.asarray(predicted.attitude) for predicted in predicted_readings(posterior, z)]


def run(
    *,
    full: bool = False,
    seed: int = 1,
    duration: float = DURATION,
    names: Sequence[str] | None = None,
    progress: Progress = silent,
) -> dict[str, Case]:
    """Run the study and return its cases by what is known of the base, as in `KNOWN`.

    Parameters
    ----------
    duration : float; duration of each recording [s]
    names : sequence of str, optional; names of the candidates, by default the whole catalogue
    """
    cases = KNOWN if full else {"1 %": KNOWN["1 %"]}
    return {
        known: analyse(
            draw_world(3 if full else 2, seed, spread, duration=duration), spread, seed, progress, names=names
        )
        for known, spread in cases.items()
    }
