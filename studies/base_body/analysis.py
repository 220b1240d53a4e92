"""All numbers of the study: fits without noise, information for any sensor, sampled posteriors with realistic sensors.

With white noise, a sensor's rows of the whitened Jacobian are inversely proportional to its noise. The Jacobian is
computed once with everything unknown. Rescaled rows then answer for any grade of sensor, and left-out columns for any
unknown that is taken as known.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.design.design_result import sample_times
from bayesid.identifiability.local_knowledge import Knowledge, triangular
from bayesid.inference import Identification
from bayesid.inference.body_quantities import linearise
from bayesid.inference.identification import identify
from bayesid.inference.mode import fit
from bayesid.inference.noise_changes import with_manoeuvres
from bayesid.inference.posterior import Posterior
from bayesid.inference.predicted_readings import (
    PredictedReadings,
    blank_channels,
    predicted_readings,
    simulate_recordings,
)
from bayesid.recording.joint_motion import Excitation, sample_joints
from bayesid.recording.recording import Recording
from bayesid.robot.inertial_parameters import InertialParameters
from bayesid.robot.robot import Robot
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.sensors import ARCSEC, SensorKind, StarTracker
from studies.base_body import paper
from studies.common.ets7 import ACCEL, BASE, ENCODER, INTERVAL, TIP_RATE, TIP_SPEED, ets7, excitation, tip_speed
from studies.common.flight import smoothed
from studies.common.models import ARM_SPREAD, base_model
from studies.common.quantities import MASS, MOMENTS, body_of

# excitation that hardly turns the base about z, since joint 1, which turns about z, almost rests [rad]. Nelder-Mead
# sought the smallest rate about z relative to the smaller of the other two, within the paper's joint limits, from the
# best of 150 random manoeuvres.
POOR = np.array([0.68, -0.03, 1.04, -0.53, 1.17, -0.37])


def heavy_arm(robot: Robot, ratio: float = 1.0 / 7.0) -> Robot:
    """Return the robot with all masses and inertias of the arm scaled until links 2 to 6 have this share of the base.

    Links 2 to 6 are what the paper counts as 1/25 of the base.
    """
    arm = {name: link.inertial for name, link in robot.links.items() if name != BASE and link.inertial.mass > 0.0}
    factor = ratio * robot.link(BASE).inertial.mass / sum(body.mass for name, body in arm.items() if name != "link1")
    for name, body in arm.items():
        robot = robot.with_inertial(name, InertialParameters(factor * body.mass, body.com, factor * body.inertia))
    return robot


def slowest(q: Floats) -> float:
    """Return how many times slower the excitation ``q`` must be to stay within the flight rules of ETS-VII."""
    motion = excitation(q)
    speed, rate = tip_speed(motion, motion.duration)
    return max(speed / TIP_SPEED, rate / TIP_RATE)


def planned(model: Model, motion: Excitation) -> Manoeuvre:
    """Return a manoeuvre with exact joints, whose recording holds placeholder samples of the model's sensors."""
    time = sample_times(motion.duration, INTERVAL)
    return Manoeuvre(Recording("manoeuvre", None, time, blank_channels(model.sensors, len(time))), motion)


def limits_broken(q: Floats = paper.EXCITATION) -> list[tuple[int, float, float]]:
    """Return joints (from 1) that leave the paper's limits, each with its lowest and highest position [rad]."""
    ends = [(index + 1, q1 - abs(q2), q1 + abs(q2)) for index, (q1, q2) in enumerate(q.reshape(-1, 2))]
    return [end for end in ends if max(-end[1], end[2]) > paper.LIMIT]


# standard deviation that weights a rate [rad/s] and an acceleration [m/s2]; the paper weights its SI units alike
WEIGHT = 1e-5

# integration steps of the fit and of its data [s], which differ so that no error of the integration cancels
STEP, TRUTH_STEP = 1.0, 0.25


@dataclass(frozen=True)
class NoiseFree:
    """One noise-free identification."""

    estimate: Floats  # (10,): estimated quantities in the order of `paper.TRUTH`
    misfit: float  # root mean square residual, in units of `WEIGHT`
    # (10,): standard deviations that white noise of `WEIGHT` per sample would leave, relative to the true quantities
    uncertainty: Floats
    recording: Recording  # data that were fitted

    @property
    def error(self) -> Floats:
        """Errors of the estimate relative to the truth, shape (10,)."""
        return self.estimate / paper.TRUTH - 1.0

    @property
    def worst(self) -> float:
        """Largest relative error of the ten quantities."""
        return float(np.abs(self.error).max())

    @property
    def peak(self) -> Floats:
        """Largest rate about each axis of the base [rad/s], shape (3,)."""
        return np.abs(self.recording.vector("rate")[1]).max(axis=0)


def guess_model(robot: Robot | None = None, *, gradient: bool = True, rate_sigma: float = 0.0) -> Model:
    """Return the model whose prior is centred on the paper's initial guess, where fits start."""
    return base_model(
        {SensorKind.RATE: WEIGHT, SensorKind.ACCEL: WEIGHT},
        robot=robot,
        centre=body_of(paper.GUESS),
        gradient=gradient,
        bias=0.0,
        rate_sigma=rate_sigma,
    )


def simulated(model: Model, motions: Sequence[Excitation]) -> list[Manoeuvre]:
    """Return manoeuvres with noise-free recordings of the true base, simulated with `TRUTH_STEP`."""
    simulator = Posterior.of(model, [planned(model, motion) for motion in motions], step=TRUTH_STEP)
    truth = simulator.unknowns.coordinates([body_of(paper.TRUTH)])
    recordings = simulate_recordings(simulator, z=truth)
    return [replace(plan, recording=made) for plan, made in zip(simulator.manoeuvres, recordings, strict=True)]


def identify_exact(posterior: Posterior) -> NoiseFree:
    """Identify the base by least squares alone, from the paper's initial guess."""
    optimum = fit(posterior, posterior.starting_point())
    knowledge = Knowledge.at(posterior, optimum.z)
    return NoiseFree(
        estimate=knowledge.values,
        misfit=float(np.sqrt(optimum.chi2 / posterior.samples)),
        uncertainty=knowledge.sd / np.abs(paper.TRUTH),
        recording=posterior.manoeuvres[0].recording,
    )


def run_noise_free(*, full: bool) -> dict[str, NoiseFree]:
    """Run the paper's cases; ``full`` adds the heavier arm, an unknown initial rate and more."""
    motions = [excitation(q) for q in (paper.EXCITATION, POOR)]
    well, poor = simulated(guess_model(), motions)
    posterior = _flat(guess_model(), well)
    no_gradient = _flat(guess_model(gradient=False), well)
    cases = {
        "well": identify_exact(posterior),
        "poor": identify_exact(with_manoeuvres(posterior, [poor])),
        "well, no gradient": identify_exact(no_gradient),
    }
    if full:
        cases["poor, no gradient"] = identify_exact(with_manoeuvres(no_gradient, [poor]))
        cases["well, rate unknown"] = identify_exact(_flat(guess_model(rate_sigma=0.1), well))
        heavy = guess_model(heavy_arm(ets7()))
        cases["well, arm 1/7"] = identify_exact(_flat(heavy, simulated(heavy, motions[:1])[0]))
    return cases


def _flat(model: Model, manoeuvre: Manoeuvre) -> Posterior:
    return Posterior.of(model, [manoeuvre], step=STEP, flat_prior=True)


KINDS = (SensorKind.RATE, SensorKind.ACCEL, SensorKind.ATTITUDE)  # sensors whose information is computed
UNIT = 1e-5  # standard deviation for which the information of each sensor is computed [rad/s, m/s2, rad]
STAR = 2.0 * ARCSEC  # standard deviation of the star sensor's error per axis and sample [rad]

# groups of unknowns that a question may take as known
ARM, INITIAL_RATE, TILT, ACCEL_BIAS = "arm", "initial rate", "initial attitude", "accelerometer bias"

# first part of an unknown's name -> its group
GROUPS = {"link": ARM, "initial-rate": INITIAL_RATE, "initial-attitude": TILT, "accel-bias": ACCEL_BIAS}


@dataclass(frozen=True)
class Information:
    """Information that one manoeuvre gives about the base, linearised at the truth."""

    # rows equivalent to the whitened Jacobian of each sensor with a noise of `UNIT` per sample
    by_sensor: Mapping[SensorKind, Floats]
    prior: Knowledge  # knowledge of the base's quantities before the manoeuvre
    names: tuple[str, ...]  # names of the n unknowns
    truth: PredictedReadings  # readings of the sensors without noise

    @classmethod
    def of(cls, motion: Excitation, step: float = STEP) -> Information:
        """Compute the information of a manoeuvre with an integration step [s]."""
        model = base_model(dict.fromkeys(KINDS, UNIT), centre=body_of(paper.TRUTH), arm_spread=ARM_SPREAD)
        manoeuvre = replace(planned(model, motion), attitude_sigma=STAR)
        simulator = Posterior.of(model, [manoeuvre], step=step, flat_prior=True)
        z = np.zeros(simulator.size)
        recording = simulate_recordings(simulator, z=z)[0]
        posterior = with_manoeuvres(simulator, [replace(manoeuvre, recording=recording)])
        jacobian = posterior.jacobian(z).reshape(-1, len(KINDS), 3, posterior.size)
        rows = {kind: triangular(jacobian[:, index].reshape(-1, posterior.size)) for index, kind in enumerate(KINDS)}
        prior = Knowledge(*linearise(posterior, z), np.eye(posterior.size))
        return cls(rows, prior, posterior.unknowns.names, predicted_readings(simulator, z)[0])

    def relative_sd(self, sigma: Mapping[SensorKind, float], known: Collection[str] = ()) -> Floats:
        """Return the posterior standard deviations of the base's quantities relative to the truth, shape (10,).

        Parameters
        ----------
        sigma : mapping of SensorKind to float; standard deviation per sample of the sensors used
        known : collection of str
            Groups of unknowns that are known exactly: `ARM`, `INITIAL_RATE`, `TILT`, `ACCEL_BIAS`.
        """
        rows = [self.by_sensor[kind] * (UNIT / value) for kind, value in sigma.items()]
        exact = [
            index
            for index, name in enumerate(self.names)
            if any(name.startswith(start) and group in known for start, group in GROUPS.items())
        ]
        return self.prior.having(np.concatenate(rows)).fixing(exact).sd / np.abs(paper.TRUTH)

    @property
    def peak(self) -> dict[SensorKind, float]:
        """Largest rate [rad/s], acceleration [m/s2] and rotation since the start [rad] about any axis."""
        turned = 2.0 * self.truth.attitude[:, :3]
        values = {SensorKind.RATE: self.truth.rate, SensorKind.ACCEL: self.truth.accel, SensorKind.ATTITUDE: turned}
        return {kind: float(np.abs(reading).max()) for kind, reading in values.items()}


CLAIM = 0.02  # error of the solution that the paper reports for sigma 0.04

# units that a sigma may have: name, sensor, and size in the SI unit; the first is the one that studies take
UNITS = (
    ("deg/s", SensorKind.RATE, np.pi / 180.0),
    ("rad/s", SensorKind.RATE, 1.0),
    ("m/s2", SensorKind.ACCEL, 1.0),
    ("rad, of attitude", SensorKind.ATTITUDE, 1.0),
    ("deg, of attitude", SensorKind.ATTITUDE, np.pi / 180.0),
)


@dataclass(frozen=True)
class Reading:
    """Consequences of one unit that a sigma may have."""

    sigma: float  # sigma as printed
    unit: str  # unit that is assumed
    fraction: float  # noise of one sample as a fraction of the signal's peak
    # relative standard deviation of the mass and of the worst moment of inertia, without prior, from one manoeuvre
    mass: float
    moment: float

    @property
    def manoeuvres(self) -> float:
        """Number of manoeuvres to average for an error of 2 % in the mass and all moments."""
        return float(max(1.0, (max(self.mass, self.moment) / CLAIM) ** 2))


def read_sigmas(information: Information) -> list[Reading]:
    """Evaluate every unit; all sensors used get noise of the same fraction of their signals' peaks."""
    readings = []
    for sigma in paper.SIGMAS:
        for unit, kind, scale in UNITS:
            readings.append(_reading(information, sigma, unit, sigma * scale / information.peak[kind], kind))
        readings.append(_reading(information, sigma, "of the peak", sigma, SensorKind.RATE))
    return readings


def _reading(information: Information, sigma: float, unit: str, fraction: float, kind: SensorKind) -> Reading:
    motion = SensorKind.ATTITUDE if kind is SensorKind.ATTITUDE else SensorKind.RATE
    peak = information.peak
    # computed where the prior does not matter, then scaled: standard deviations are proportional to the noise
    small = UNIT / peak[motion]
    noise = {motion: small * peak[motion], SensorKind.ACCEL: small * peak[SensorKind.ACCEL]}
    width = information.relative_sd(noise, (ARM, TILT, ACCEL_BIAS)) * fraction / small
    return Reading(sigma, unit, fraction, float(width[MASS]), float(width[MOMENTS].max()))


LONGEST = 500  # largest number of steps of the ensembles


def _model(accel: float, centre: InertialParameters, arm_spread: float) -> Model:
    """Return the model of a star sensor, an accelerometer with an unknown bias and an unknown initial rate."""
    return base_model({SensorKind.ACCEL: accel, SensorKind.ATTITUDE: STAR}, centre=centre, arm_spread=arm_spread)


def _planned(seed: int) -> Manoeuvre:
    """Return the paper's manoeuvre with joints that were recorded with noise and smoothed."""
    rng, motion, robot = np.random.default_rng(seed), excitation(paper.EXCITATION), ets7()
    blank = planned(_model(ACCEL, body_of(paper.TRUTH), 0.0), motion).recording
    joints = sample_joints(motion, robot, blank.time)
    noisy = {key: values + ENCODER * rng.normal(size=len(values)) for key, values in joints.items()}
    return replace(smoothed("manoeuvre", blank.time, {**noisy, **blank.channels}, robot, ENCODER), attitude_sigma=STAR)


def _simulated(seed: int) -> Manoeuvre:
    """Return the same manoeuvre with the readings of the true robot's sensors while its joints moved exactly."""
    manoeuvre = _planned(seed)
    exact = replace(manoeuvre, motion=excitation(paper.EXCITATION))
    simulator = Posterior.of(_model(ACCEL, body_of(paper.TRUTH), 0.0), [exact], step=0.5)
    recording = simulate_recordings(simulator, np.random.default_rng(seed + 1), np.zeros(simulator.size))[0]
    return replace(manoeuvre, recording=recording)


def sample_posterior(arm_spread: float, seed: int) -> Identification:
    """Identify the base from the paper's initial guess by emcee.

    The mode is first sought with the arm at its nominal values. From so far a guess, a fit that may change the arm at
    once follows a curved ridge to bodies that no prior of the arm would allow.

    Parameters
    ----------
    arm_spread : float; relative width of the links' priors; 0 for an exactly known arm
    seed : int; seed of all random numbers
    """
    manoeuvre, guess = _simulated(seed), body_of(paper.GUESS)
    posterior = Posterior.of(_model(ACCEL, guess, 0.0), [manoeuvre])
    start = fit(posterior, np.zeros(posterior.size)).z
    if arm_spread > 0.0:
        posterior = Posterior.of(_model(ACCEL, guess, arm_spread), [manoeuvre])
        start = np.concatenate([start[:10], np.zeros(posterior.size - len(start)), start[10:]])
    return identify(posterior, seed, start=start, effective_samples=1000.0, max_steps=LONGEST)


def encoder_grades(grades: Sequence[float], seed: int) -> list[Floats]:
    """Return relative standard deviations (10,) by grade of the accelerometer where the joints are measured too."""
    manoeuvre, rows = _planned(seed), []
    for grade in grades:
        posterior = Posterior.of(_model(grade, body_of(paper.TRUTH), 0.0), [manoeuvre], step=1.0)
        rows.append(Knowledge.at(posterior, np.zeros(posterior.size)).sd / np.abs(paper.TRUTH))
    return rows


# noise per sample of the accelerometers of section 4.3 [m/s2]; its "10e-5" is read as 1e-5
GRADES = (1e-5, 1e-6, 1e-7, 1e-8, 1e-9)

# noise of the rate that is differenced from the star sensor's attitude [rad/s]
DIFFERENCED = float(StarTracker(2.0).sigma(INTERVAL)[0])


@dataclass(frozen=True)
class BaseBody:
    """Numbers of the study."""

    # identifications without noise: ``well``, ``poor``, ``well, no gradient`` and, in the full study, more
    noise_free: Mapping[str, NoiseFree]
    # information from the paper's manoeuvre, and from the same within the flight rules of ETS-VII
    fast: Information
    slow: Information
    # relative standard deviations per accelerometer of `GRADES` and quantity. ``exact`` and ``5 %`` say how the arm is
    # known, with the star sensor's attitude; ``exact, differenced`` has the differenced rate instead, and ``exact,
    # encoders`` has measured joints.
    grades: Mapping[str, Floats]
    readings: list[Reading]  # units that the paper's noise sigmas may have
    slowness: float  # factor by which the paper's manoeuvre must be slowed down for ETS-VII
    sampled: Mapping[str, Identification]  # sampled posteriors ``exact`` and ``5 %``, in the full study only

    @property
    def precision(self) -> dict[str, Floats]:
        """Relative standard deviations (10,) by speed and knowledge of the arm, with the coarsest accelerometer."""
        sigma = {SensorKind.ATTITUDE: STAR, SensorKind.ACCEL: GRADES[0]}
        return {
            f"{speed}, arm {arm}": information.relative_sd(sigma, known)
            for speed, information in (("permitted", self.slow), ("faster", self.fast))
            for arm, known in (("exact", (ARM,)), ("5 %", ()))
        }


def run(*, full: bool = False, seed: int = 0, progress: Callable[[str], None] = lambda text: None) -> BaseBody:
    """Run the study; the arguments are options of the command."""
    progress("information of the manoeuvres")
    fast = Information.of(excitation(paper.EXCITATION))
    slowness = slowest(paper.EXCITATION)
    grades = {
        "exact": _grades(fast, SensorKind.ATTITUDE, STAR, (ARM,)),
        "exact, differenced": _grades(fast, SensorKind.RATE, DIFFERENCED, (ARM,)),
        "5 %": _grades(fast, SensorKind.ATTITUDE, STAR, ()),
    }
    sampled = {}
    if full:
        progress("sampled posteriors")
        grades["exact, encoders"] = np.array(encoder_grades(GRADES, seed))
        sampled = {"exact": sample_posterior(0.0, seed), "5 %": sample_posterior(ARM_SPREAD, seed)}
    progress("fits without noise")
    return BaseBody(
        noise_free=run_noise_free(full=full),
        fast=fast,
        slow=Information.of(excitation(paper.EXCITATION, slowness), step=4.0),
        grades=grades,
        readings=read_sigmas(fast),
        slowness=slowness,
        sampled=sampled,
    )


def _grades(information: Information, kind: SensorKind, sigma: float, known: tuple[str, ...]) -> Floats:
    return np.array([information.relative_sd({kind: sigma, SensorKind.ACCEL: grade}, known) for grade in GRADES])
