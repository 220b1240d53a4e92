"""The study: all bodies identified by the linear regressor method and by sampling, and coverage over drawn systems.

The linear regressor method (19), with the joint torques (23), needs differentiated rates. Rates, accelerations and
joint motion are measured, so that every entry of the regressor is noisy. Least squares takes the entries for exact:
errors in variables pull the estimate towards zero. The method is given everything it can use: the same prior, made
normal in the linear parameters; smoothing of the rates by local cubics; and weights from its residuals.

Where the right side is zero, without torques, the residuals of n equations go with the scale s of all masses, and their
weights make them n times s²; the prior holds s to its own precision P about one. The least of P (s - 1)² + n s² is at
P / (P + n), whatever the noise is: the estimate knows the prior and the number of samples, and falls with every sample.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from scipy import stats
from scipy.signal import savgol_filter

from bayesid import Identification, Manoeuvre, Posterior, Robot, identify
from bayesid._math.arrays import Floats
from bayesid.inference.mode import fit
from bayesid.inference.noise_changes import relinearised, with_manoeuvres
from bayesid.inference.parameterisation import LinearParameterisation
from bayesid.inference.unknowns import Unknowns
from bayesid.robot.body_prior import BodyPrior, draw_inertial
from bayesid.robot.inertial_parameters import mass_com_inertia
from bayesid.robot.kinematics import kinematics
from bayesid.robot.regressors import torque_regressor
from studies.common.ets7 import ACCELEROMETER
from studies.common.monte_carlo import run_trials
from studies.common.quantities import squared_distances
from studies.truth.mujoco import Truth
from studies.whole_system.system import (
    COULOMB,
    LOAD,
    START_RATE,
    VISCOUS,
    Information,
    bodies,
    drawn,
    flights,
    fly,
    groups,
    hand_speed,
    informed,
    model_of,
    record,
    spreads,
    true_robot,
)

WINDOW, ORDER = 9, 3  # number of samples, and order, of the local polynomials through the rates
ROUNDS = 4  # number of iterations that weight the equations by their residuals; more change the masses by less than 1 %

# speed of a joint above which its torque is used [rad/s]; below it the sign of the friction is not certain
MOVING = 5e-4

FRICTION_PRIOR = (5.0, 50.0)  # standard deviations of the priors of dry and viscous friction [N m, N m s]

# factor on the precision of the load's prior, which made normal in the linear parameters at a width of 100 % would
# exclude a load twice as heavy
VAGUE = 1e-4


def linear_prior(drawings: Robot) -> tuple[Floats, Floats]:
    """Return centre (10 B,) and covariance (10 B, 10 B) of the linear parameters of all bodies under the prior."""
    priors = tuple(BodyPrior(name, drawings.link(name).inertial, width) for name, width in spreads(drawings).items())
    unknowns = Unknowns(priors, (), 1, 0.0, (0.0,))
    centre = jnp.zeros(unknowns.size)
    slope = np.asarray(jax.jacfwd(lambda z: unknowns.values(z).inertial)(centre))
    return np.asarray(unknowns.values(centre).inertial), slope @ slope.T


def regress(manoeuvre: Manoeuvre, drawings: Robot, *, torques: bool) -> tuple[Floats, Floats]:
    """Estimate the linear parameters of all bodies from a manoeuvre, with or without its joint torques.

    Returns
    -------
    estimate, covariance : (10 B,), (10 B, 10 B) arrays
        Estimate, and the covariance that the method itself states.
    """
    recording, joints = manoeuvre.recording, drawings.joints
    time, measured = recording.vector("rate")
    interval = float(np.median(np.diff(time)))
    rate = savgol_filter(measured, WINDOW, ORDER, axis=0)
    change = savgol_filter(measured, WINDOW, ORDER, deriv=1, delta=interval, axis=0)
    felt, point = recording.vector("accel")[1], np.array(ACCELEROMETER)
    origin = felt - np.cross(change, point) - np.cross(rate, np.cross(rate, point))
    state = manoeuvre.motion.evaluate(time)
    moved = kinematics(drawings, state)
    names = bodies(drawings)
    regressor = np.asarray(torque_regressor(drawings, names, moved, rate, change, origin))
    blocks: list[tuple[Floats, Floats]] = [(regressor[:, row], np.zeros(len(time))) for row in range(6)]
    frictions = 0
    if torques:
        speed = state.velocity
        frictions = 2 * len(joints)
        for index, joint in enumerate(joints):
            rubbing = np.zeros((len(time), frictions))
            rubbing[:, 2 * index], rubbing[:, 2 * index + 1] = np.sign(speed[:, index]), speed[:, index]
            _, torque = recording.series(f"torque.{joint.name}")
            moving = np.abs(speed[:, index]) > MOVING
            blocks.append((np.concatenate([regressor[:, 6 + index], rubbing], axis=1)[moving], torque[moving]))
    centre, covariance = linear_prior(drawings)
    count = len(centre)
    precision = np.zeros((count + frictions, count + frictions))
    precision[:count, :count] = np.linalg.inv(covariance)
    load = slice(10 * names.index(LOAD), 10 * names.index(LOAD) + 10)
    precision[load, load] *= VAGUE
    precision[count:, count:] = np.diag(np.tile(np.array(FRICTION_PRIOR) ** -2.0, frictions // 2))
    blocks = [(np.pad(a, ((0, 0), (0, count + frictions - a.shape[1]))), b) for a, b in blocks]
    x = np.concatenate([centre, np.zeros(frictions)])
    start = x.copy()
    for _ in range(ROUNDS):
        normal, right = precision.copy(), precision @ start
        # residuals as bodies of the drawings' total mass would leave them: being lighter must not gain weight
        heavier = start[:count:10].sum() / x[:count:10].sum()
        for a, b in blocks:
            weight = 1.0 / np.var(b - a @ x if b.any() else heavier * (a @ x))
            normal += weight * a.T @ a
            right += weight * a.T @ b
        x = np.linalg.solve(normal, right)
    return x[:count], np.linalg.inv(normal)[:count, :count]


@dataclass(frozen=True)
class Sampled:
    """One identification."""

    title: str  # sensors in use
    result: Identification  # posterior of all bodies
    # squared Mahalanobis distance of the true bodies from the mean, in coordinates linear in the parameters
    distance: float
    # twice the probability of a larger distance under a normal posterior, or of a smaller one if that is less
    p_value: float
    truth: dict[str, Floats]  # true mass, centre of mass and inertia about it of every body


def sampled(
    truth: Robot,
    drawings: Robot,
    manoeuvre: Manoeuvre,
    *,
    torques: bool,
    seed: int,
    effective_samples: float,
    progress: Callable[[str], None],
) -> Sampled:
    """Identify all bodies from a manoeuvre, with or without its joint torques."""
    title = "motion and joint torques" if torques else "motion alone"
    posterior = Posterior.of(model_of(drawings, torques=torques), [manoeuvre])
    result = identify(
        posterior,
        seed,
        effective_samples=effective_samples,
        progress=lambda fraction, text: progress(f"{title}: {text}"),
    )
    count = 10 * len(posterior.model.priors)
    linear = posterior.unknowns.to_linear(result.chains.flat)[:, :count]
    true = posterior.unknowns.to_linear(true_point(posterior, truth)[None])[0, :count]
    distance = float(squared_distances(true - linear.mean(axis=0), np.cov(linear.T)))
    described = {name: mass_com_inertia(truth.link(name).inertial.vector) for name in bodies(truth)}
    p_value = 2.0 * min(stats.chi2.sf(distance, count), stats.chi2.cdf(distance, count))
    return Sampled(title, result, distance, float(p_value), described)


def true_point(posterior: Posterior, truth: Robot) -> Floats:
    """Return the coordinates of the truth."""
    priors, effects = posterior.model.priors, posterior.model.effects
    z = posterior.unknowns.coordinates([truth.link(prior.name).inertial for prior in priors], START_RATE[None])
    frictions = 2 * sum(effect.uses("friction") for effect in effects)
    if frictions:
        widths = [parameter.sigma for effect in effects for parameter in effect.parameters]
        z[-frictions:] = np.tile([COULOMB, VISCOUS], frictions // 2) / widths
    return z


TAIL = 0.95  # quantile of the distances beyond which their number is tested, as it is below one minus this
SCORED = ("base", "load", "whole system")  # groups of bodies whose masses are scored


@dataclass(frozen=True)
class Coverage:
    """Errors over K drawn systems, whose bodies have n unknowns."""

    # (K,): squared distances of the true bodies from the mode; chi-square with n degrees of freedom if all is right
    distances: Floats
    scores: Floats  # (K, 3): errors of the masses of the groups `SCORED` in their standard deviations
    unknowns: int  # number n of unknowns

    @property
    def p_value(self) -> float:
        """P-value of the distances being chi-square (Kolmogorov-Smirnov)."""
        return float(stats.kstest(self.distances, stats.chi2(self.unknowns).cdf).pvalue)

    @property
    def far(self) -> int:
        """Number of distances beyond the `TAIL` quantile, where too narrow a posterior shows first."""
        return int((self.distances > stats.chi2(self.unknowns).ppf(TAIL)).sum())

    @property
    def near(self) -> int:
        """Number of distances below the quantile of one minus `TAIL`, where too wide a posterior shows first."""
        return int((self.distances < stats.chi2(self.unknowns).ppf(1.0 - TAIL)).sum())

    @property
    def tail_p_value(self) -> float:
        """P-value of so many distances or more in either tail: twice the smaller of both, at most one."""
        chances = stats.binom.sf(np.array([self.far, self.near]) - 1, len(self.distances), 1.0 - TAIL)
        return min(1.0, 2.0 * float(chances.min()))


def covered(
    drawings: Robot, count: int, seed: int, *, torques: bool, duration: float, progress: Callable[[str], None]
) -> Coverage:
    """Draw systems from the prior about the drawings, fly, record and identify each.

    The posterior is the normal approximation in coordinates linear in the parameters. The fit starts at the truth, to
    save time: another start leads to the same mode.
    """
    unknowns = 10 * len(bodies(drawings))
    first: list[Posterior] = []  # its compiled functions serve all systems

    def system(number: int, rng: np.random.Generator) -> dict[str, Any]:
        """Return the distance and the scores of one system."""
        truth = drawings
        for name, spread in spreads(drawings).items():
            truth = truth.with_inertial(name, draw_inertial(drawings.link(name).inertial, spread, rng))
        run = fly(truth, int(rng.integers(1000)), duration=duration, joints=tuple(range(len(drawings.joints))))
        manoeuvre = record(run, truth, "drawn", rng)
        if not first:
            first.append(Posterior.of(model_of(drawings, torques=torques), [manoeuvre]))
        posterior = with_manoeuvres(first[0], [manoeuvre])
        z = true_point(posterior, truth)
        refined = relinearised(posterior, z)
        proposal = LinearParameterisation(refined).proposal(fit(refined, z))
        covariance = proposal.factor @ proposal.factor.T
        # the bodies alone: errors of the joints' speed at the start enter the initial rate
        errors = (posterior.unknowns.to_linear(z[None])[0] - proposal.mean)[:unknowns]
        return {
            "distance": squared_distances(errors, covariance[:unknowns, :unknowns]),
            "scores": _mass_scores(posterior, proposal.mean, covariance, truth),
        }

    trials = run_trials(system, range(count), seed=seed, progress=lambda text: progress(f"coverage: {text}"))
    outcomes = trials.complete()
    distances, scores = (np.array([outcome[key] for outcome in outcomes]) for key in ("distance", "scores"))
    return Coverage(distances, scores, unknowns)


def _mass_scores(posterior: Posterior, mean: Floats, covariance: Floats, truth: Robot) -> Floats:
    """Return the errors of the masses of `SCORED` over their standard deviations, shape (3,).

    Differences give the derivatives of the masses exactly, since a mass is linear in the linear coordinates.
    """
    names, members = bodies(truth), groups(truth)
    gather = np.array([[float(name in members[group]) for name in names] for group in SCORED])

    def masses(y: Floats) -> Floats:
        inertial = np.asarray(posterior.unknowns.values_of(posterior.unknowns.from_linear(y)).inertial)
        return inertial.reshape(len(y), -1, 10)[:, :, 0] @ gather.T

    count = 10 * len(names)
    step = 1e-4 * np.sqrt(np.diag(covariance)[:count])
    (here,), ahead = masses(mean[None]), masses(mean + np.eye(count, len(mean)) * step[:, None])
    slope = (ahead - here) / step[:, None]
    true = gather @ np.array([truth.link(name).inertial.mass for name in names])
    return np.asarray((here - true) / np.sqrt(np.diag(slope.T @ covariance[:count, :count] @ slope)))


@dataclass(frozen=True)
class Method:
    """One method over K recordings of one flight that differ by their noise."""

    title: str  # title of the method
    # (K, 4): relative errors of the masses of `groups`, and the standard deviations that the method itself states
    errors: Floats
    believed: Floats


def contest(
    run: Truth, truth: Robot, drawings: Robot, *, count: int, seed: int, progress: Callable[[str], None]
) -> tuple[Method, ...]:
    """Estimate all bodies by both methods, from motion alone and with joint torques."""
    names = bodies(truth)
    gather = np.array([[float(name in members) for name in names] for members in groups(truth).values()])
    true = gather @ np.array([truth.link(name).inertial.mass for name in names])
    first: dict[bool, Posterior] = {}  # their compiled functions serve all recordings

    def recording(number: int, rng: np.random.Generator) -> dict[str, tuple[Floats, Floats]]:
        """Return the errors and stated deviations on one recording, by the title of the method."""
        manoeuvre, outcome = record(run, truth, "six joints", rng), {}
        for torques, suffix in ((False, "motion alone"), (True, "with joint torques")):
            estimate, covariance = regress(manoeuvre, drawings, torques=torques)
            deviations = np.sqrt(np.diag(gather @ covariance[::10, ::10] @ gather.T))
            outcome[f"regressors, {suffix}"] = gather @ estimate[::10] / true - 1.0, deviations / true
            if torques not in first:
                first[torques] = Posterior.of(model_of(drawings, torques=torques), [manoeuvre])
            posterior = with_manoeuvres(first[torques], [manoeuvre])
            z = true_point(posterior, truth)
            optimum = fit(relinearised(posterior, z), z)
            masses = np.array([body.mass for body in posterior.unknowns.inertials(optimum.z)])
            spread = np.array([prior.spread for prior in posterior.model.priors])
            slope = np.zeros((len(gather), posterior.size))
            slope[:, : 10 * len(names) : 10] = gather * (2.0 * spread * masses)
            deviations = np.sqrt(np.diag(slope @ optimum.covariance @ slope.T))
            outcome[f"integral of the motion, {suffix}"] = gather @ masses / true - 1.0, deviations / true
        return outcome

    trials = run_trials(recording, range(count), seed=seed, progress=lambda text: progress(f"methods: {text}"))
    outcomes = trials.complete()
    return tuple(
        Method(title, *(np.array([outcome[title][part] for outcome in outcomes]) for part in (0, 1)))
        for title in outcomes[0]
    )


@dataclass(frozen=True)
class Result:
    """Outcome of the study; samples and coverage are evaluated in a full run only."""

    # the robot as it truly is, and as the drawings state it
    truth: Robot
    drawings: Robot
    known: Mapping[str, Information]  # information of every manoeuvre by name
    cases: tuple[Sampled, ...]  # identifications with emcee
    coverage: Coverage | None  # errors over systems drawn from the prior
    methods: tuple[Method, ...]  # errors of the linear and of the integral method
    duration: float  # duration of each manoeuvre [s]
    hand_speed: float  # largest speed of the end-effector relative to the base with six joints moving [m/s]


def run(
    *,
    full: bool = False,
    seed: int = 1,
    duration: float = 240.0,
    effective_samples: float = 1500.0,
    repeats: int = 40,
    progress: Callable[[str], None] = lambda text: None,
) -> Result:
    """Run the study; arguments that are not described are options of the command.

    Parameters
    ----------
    duration : float; duration of each manoeuvre [s]
    effective_samples : float; effective sample size of each identification
    """
    truth, drawings = true_robot(), drawn(true_robot(), seed)
    progress("manoeuvres")
    runs = {name: fly(truth, seed, duration=duration, **flight) for name, flight in flights(duration).items()}
    known = informed(truth, {name: record(flown, truth, name, None) for name, flown in runs.items()})
    best = runs["six joints"]
    progress("the linear method")
    methods = contest(best, truth, drawings, count=repeats if full else 3, seed=seed, progress=progress)
    cases: list[Sampled] = []
    coverage = None
    if full:
        manoeuvre = record(best, truth, "six joints", np.random.default_rng(seed))
        cases = [
            sampled(
                truth,
                drawings,
                manoeuvre,
                torques=torques,
                seed=seed,
                effective_samples=effective_samples,
                progress=progress,
            )
            for torques in (False, True)
        ]
        coverage = covered(drawings, repeats, seed, torques=False, duration=0.5 * duration, progress=progress)
    return Result(truth, drawings, known, tuple(cases), coverage, methods, duration, hand_speed(best, truth))
