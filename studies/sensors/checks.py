"""What the first order does not say: closed forms of integration, the linear method (19), complete nonlinear fits.

Integration. The velocity of the samples' white noise is a random walk. Let S be the integral of s and W the walk. Least
squares that take the walk for white noise estimate the size A of an acceleration A s(t) from v = A S + W. With
E[W(t) W(u)] = sigma^2 min(t, u) their variance is sigma^2 times the integral over t of (integral of S from t to the
end)^2, over (integral of S^2)^2. The full covariance of the walk gives sigma^2 over the integral of s^2, so nothing is
lost. The ratio of both variances is 3 for s = cos over whole periods, and 6/5 for a constant s. A bias b becomes a ramp
and changes the cosine's A by -2 b, while least squares on the acceleration itself are not affected.

Linear method. With the arm known, (19) is Phi_base p_base = -Phi_arm p_arm, which is not badly posed. But Phi holds
measured rates, their derivatives and accelerations, which have errors e, and least squares take Phi as exact. With
Psi_e = d Phi / d e, the normal matrix gains the covariance sum_e var_e Psi_e' Psi_e, and the estimate is

    p = p_true - (Phi' Phi + sum_e var_e Psi_e' Psi_e)^-1 sum_e var_e Psi_e' (Psi_e p_true + d (Phi_arm p_arm) / d e)

for large samples. This is attenuation: the more noise, the smaller the estimated mass.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from bayesid import Manoeuvre, Posterior
from bayesid._math.arrays import Floats
from bayesid.identifiability.local_knowledge import Knowledge
from bayesid.inference import maximise
from bayesid.inference.body_quantities import linearise
from bayesid.recording.jumps import smooth_joints
from bayesid.recording.smoothing import JointSamples
from bayesid.robot.composite_tables import composite_rows, link_table
from bayesid.robot.inertial_parameters import mass_com_inertia
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import kinematics
from bayesid.robot.regressors import balance_regressor
from studies.base_body import paper
from studies.common.ets7 import ACCELEROMETER, BASE, BIAS, INTERVAL, ets7
from studies.common.monte_carlo import Workers, run_trials
from studies.common.quantities import JUDGED
from studies.sensors import estimators
from studies.sensors.signals import (
    Differences,
    Draws,
    Flight,
    LowPass,
    Noise,
    Treatment,
    Wiener,
    fly,
    levels,
    model_of,
    motion,
    recording_of,
)

PERIODS = 2  # number of periods of the cosine


@dataclass(frozen=True)
class Scalar:
    """Estimates of the unknown size of an acceleration of known shape."""

    name: str  # shape of the acceleration
    closed: float  # standard deviation with velocities taken as white over that with accelerations, in closed form
    matrices: float  # the same from the matrices of the samples
    # the same by simulation, and its Monte-Carlo error
    simulated: float
    error: float
    whole: float  # the same with the full covariance of the velocities, from the matrices
    # error of the size per unit bias, in closed form and from the matrices
    bias_closed: float
    bias: float


def scalars(draws: int, rng: np.random.Generator, samples: int = 2401) -> list[Scalar]:
    """Compare closed form, matrices and simulation for a cosine and a constant.

    Parameters
    ----------
    draws : int; number of simulated sets of noise
    rng : numpy.random.Generator; source of the noise
    samples : int; number of samples, so large that sums are integrals
    """
    phase = 2.0 * np.pi * PERIODS * np.linspace(0.0, 1.0, samples)
    rule = estimators.integral(phase)
    noise = rng.standard_normal((draws, samples))
    results = []
    for name, shape, closed, bias in (
        ("cosine over whole periods", np.cos(phase), np.sqrt(3.0), -2.0),
        ("constant", np.ones(samples), np.sqrt(1.2), 1.0),
    ):
        velocity = rule @ shape
        gain = velocity @ rule / (velocity @ velocity)
        best = 1.0 / np.linalg.norm(shape)
        simulated = (noise @ gain).std(ddof=1) / best
        factor = np.linalg.cholesky(rule @ rule.T)
        whole = 1.0 / np.linalg.norm(np.linalg.solve(factor, velocity))
        results.append(
            Scalar(
                name,
                float(closed),
                float(np.linalg.norm(gain) / best),
                float(simulated),
                float(simulated / np.sqrt(2.0 * (draws - 1))),
                float(whole / best),
                bias,
                float(gain.sum()),
            )
        )
    return results


def falsified(flight: Flight, linear: estimators.Linear, noise: Noise) -> dict[str, Floats]:
    """Return the relative errors (10,) that a bias of `BIAS` on each axis causes in every use of the accelerometer."""
    still, exact = np.zeros_like(flight.rate), np.zeros((1, 3, *flight.position.shape))
    residual = linear.residual(still[None], still[None] + BIAS, exact)
    uses = estimators.velocity_estimators(linear, noise)
    return {name: estimator.solve(residual)[0][0] / np.abs(paper.TRUTH) for name, estimator in uses.items()}


# treatments of joints, rates and accelerations alike
TREATED: tuple[Treatment, ...] = (Differences(), LowPass(), estimators.PIECES, Wiener())


class Balance:
    """The balance of force and torque about the base's origin, linear in the base's parameters.

    Parameters
    ----------
    states : (3, T, joints) array; joint positions, velocities, accelerations
    """

    def __init__(self, states: Floats) -> None:
        robot = ets7()
        moved = kinematics(robot, JointState(*states))
        self.base = link_table(robot, BASE, moved)
        self.arm = composite_rows(robot, moved, leave_out=(BASE,))[:, :, None]

    def __call__(self, rate: Floats, change: Floats, accel: Floats) -> tuple[Floats, Floats]:
        """Return the regressor (T, 6, 10) of the base and the wrench (T, 6) that moves the arm.

        Parameters
        ----------
        rate, change : (T, 3) array; angular velocity and its derivative, base axes [rad/s, rad/s2]
        accel : (T, 3) array; acceleration as the accelerometer reads it [m/s2]
        """
        base, arm = _balance(self.base, self.arm, rate, change, accel)
        return np.asarray(base), np.asarray(arm)[..., 0]


@jax.jit
def _balance(
    base: jax.Array, arm: jax.Array, rate: jax.Array, change: jax.Array, accel: jax.Array
) -> tuple[jax.Array, jax.Array]:
    point = jnp.array(ACCELEROMETER)
    origin = accel - jnp.cross(change, point) - jnp.cross(rate, jnp.cross(rate, point))
    return balance_regressor(base, rate, change, origin), balance_regressor(arm, rate, change, origin)


def regress(draws: Draws, noise: Noise, treatments: Sequence[Treatment] = TREATED) -> dict[str, Floats]:
    """Solve (19) by least squares in SI units, every signal treated alike; first and last sample left out.

    Parameters
    ----------
    draws : Draws; sets of noise about a flight without gravity gradient, which (19) does not hold
    noise : Noise; level of noise
    treatments : sequence of Treatment; treatments to compare

    Returns
    -------
    dict of str to (N, 10) array
        Errors relative to the true quantities, by the title of the treatment.
    """
    flight = draws.flight
    truth = np.stack(motion().evaluate(flight.time))
    results = {}
    for treatment in treatments:
        joints = truth + draws.joints(treatment, noise)
        rate = draws.treated(treatment, "rate", noise)
        accel = flight.accel + draws.treated(treatment, "accel", noise)[:, 0]
        estimates = np.stack(
            [
                solve_balance(*Balance(states)(flight.rate + turning[0], turning[1], pulled))
                for states, turning, pulled in zip(joints, rate, accel, strict=True)
            ]
        )
        quantities = np.stack([mass_com_inertia(p) for p in estimates])
        results[treatment.title] = (quantities - paper.TRUTH) / np.abs(paper.TRUTH)
    return results


def attenuation(flight: Flight, noise: Noise) -> Floats:
    """Return the relative errors of the ten quantities that central differences give for large samples, shape (10,)."""
    step = flight.time[1] - flight.time[0]
    balance = Balance(np.stack(motion().evaluate(flight.time)))
    signals = [flight.rate, flight.rate_change, flight.accel]
    base, arm = (part[1:-1] for part in balance(*signals))
    normal, right = np.einsum("tci,tcj->ij", base, base), np.zeros(10)
    true = ets7().link(BASE).inertial.vector
    for index, sd in enumerate((noise.rate, noise.rate / (np.sqrt(2.0) * step), noise.accel)):
        for axis in range(3):
            shifted = [np.array(signal) for signal in signals]
            shifted[index][:, axis] += sd
            psi, arm_part = (after[1:-1] - before for after, before in zip(balance(*shifted), (base, arm), strict=True))
            normal += np.einsum("tci,tcj->ij", psi, psi)
            right += np.einsum("tci,tc->i", psi, psi @ true + arm_part)
    estimate = true - np.linalg.solve(normal, right)
    return (np.asarray(mass_com_inertia(estimate)) - paper.TRUTH) / np.abs(paper.TRUTH)


SMOOTHED = 12  # number of sets of noise of which the errors of smoothed joints are compared with the stated ones


@dataclass(frozen=True)
class SmoothingErrors:
    """Errors of smoothed joints over the stated ones, for position, velocity and acceleration."""

    measured: Floats  # (3,): root mean square over sets of noise, samples and joints
    # (3,): in closed form, for a motion far smoother than the process that the smoother takes it for
    expected: Floats

    @classmethod
    def of(cls, draws: Draws, noise: Noise) -> SmoothingErrors:
        """Measure the ratios at a level of noise.

        A smoother weighs each frequency by ``h = 1 / (1 + (w / w0)^(2 p))``, where ``p`` is the order of its process.
        The variance that it states for the derivative ``d`` is the integral of ``w^(2 d) h``, which holds both noise
        that passes and motion that is lost; the noise that passes is that of ``w^(2 d) h^2``. Their ratio is ``1 - (2 d
        + 1) / (2 p)``, and a motion without content near ``w0`` loses nothing.
        """
        time, truth = draws.flight.time, np.stack(motion().evaluate(draws.flight.time))
        squares, orders = [], []
        for errors in draws.raw("position", noise)[:SMOOTHED]:
            joints = smooth_joints(
                [[JointSamples(0, time, column, noise.position)] for column in (truth[0] + errors).T]
            )
            for index, joint in enumerate(joints):
                squares.append((joint.evaluate(time) - truth[..., index]) ** 2 / joint.standard_deviation(time) ** 2)
                orders.append(joint.order)
        passing = 1.0 - (2.0 * np.arange(3) + 1.0) / (2.0 * np.array(orders)[:, None])
        return cls(np.sqrt(np.mean(squares, axis=(0, 2))), np.sqrt(passing.mean(axis=0)))


def solve_balance(base: Floats, arm: Floats) -> Floats:
    """Return the ten linear parameters by least squares, first and last sample left out (`Balance`)."""
    design = base[1:-1].reshape(-1, 10)
    scale = np.linalg.norm(design, axis=0)
    return np.asarray(np.linalg.lstsq(design / scale, -arm[1:-1].ravel())[0] / scale)


@dataclass(frozen=True)
class SampledJoints:
    """Joint motion that is known at the samples alone."""

    states: Floats  # (3, T, joints): positions, velocities and accelerations of the joints

    def evaluate(self, time: Floats) -> JointState:
        """Return the joint state at the times, shape (T,), which must be samples."""
        rows = np.rint(np.asarray(time) / INTERVAL).astype(int)
        if not np.allclose(rows * INTERVAL, time, atol=1e-9):
            raise ValueError(
                f"times from {np.min(time):g} to {np.max(time):g} s are not all samples {INTERVAL:g} s apart"
            )
        return JointState(*self.states[:, rows])


@dataclass(frozen=True)
class Refits:
    """Nonlinear fits of N sets of noise, and the linear estimates from the same sets."""

    nonlinear: estimators.Spread
    linear: estimators.Spread

    @property
    def difference(self) -> Floats:
        """Median absolute difference over the linear standard deviation, shape (10,)."""
        gap = self.nonlinear.errors - self.linear.errors
        return np.asarray(np.median(np.abs(gap), axis=0)) / self.linear.sd

    @property
    def diverged(self) -> NDArray[np.bool_]:
        """Which fits have an error of more than the true value in the mass or a moment, shape (N,)."""
        return np.asarray((np.abs(self.nonlinear.errors[:, JUDGED]) > 1.0).any(axis=1))


def refit_all(
    chosen: Sequence[str],
    counts: Mapping[str, int],
    seed: int,
    store: Path | None,
    workers: Workers,
    progress: Callable[[str], None],
) -> dict[str, dict[str, Refits]]:
    """Fit fresh sets of noise by each procedure at each level of noise.

    Parameters
    ----------
    chosen : sequence of str; levels of noise
    counts : mapping of str to int; number of fits by procedure, `LIKELIHOOD` or `PAPER`
    seed, store, workers, progress
        See `studies.common.monte_carlo.run_trials`.

    Returns
    -------
    dict of str to dict of str to Refits
        Fits by level and procedure.
    """
    plan = [(level, procedure) for level in chosen for procedure, count in counts.items() for _ in range(count)]
    trials = run_trials(refit, plan, store, seed=seed, workers=workers, progress=progress).complete()
    results: dict[str, dict[str, Refits]] = {level: {} for level in chosen if plan}
    for level, procedure in dict.fromkeys(plan):
        made = [trial for task, trial in zip(plan, trials, strict=True) if task == (level, procedure)]
        both = (estimators.Spread.of(_joined([trial[name] for trial in made])) for name in ("nonlinear", "linear"))
        results[level][procedure] = Refits(*both)
    return results


def _joined(solved: Sequence[estimators.Solved]) -> estimators.Solved:
    errors, stated, chi2 = (np.concatenate(parts) for parts in zip(*solved, strict=True))
    return errors, stated, chi2


def refit(task: tuple[str, str], rng: np.random.Generator) -> dict[str, estimators.Solved]:
    """Fit one set of noise by a procedure at a level of noise, nonlinearly and to first order.

    Fits start from the truth: the question is where the optimum lies, not whether it is reached.
    """
    level, procedure = task
    noise = levels(fly())[level]
    fit = _likelihood if procedure == estimators.LIKELIHOOD else _paper
    return fit(Draws.of(fly(), 1, rng), noise, rng)


def _likelihood(draws: Draws, noise: Noise, rng: np.random.Generator) -> dict[str, estimators.Solved]:
    measured, linear = draws.measured_motion(noise), estimators.linearised()
    manoeuvre = Manoeuvre(draws.recording(noise), measured)
    posterior = Posterior.of(model_of(noise, biased=False), [manoeuvre], step=estimators.STEP, flat_prior=True)
    refined, optimum = maximise(posterior, rng, np.zeros(posterior.size))
    chi2 = optimum.chi2 / (refined.samples - refined.size)
    errors = linear.residual(draws.raw("rate", noise), draws.raw("accel", noise), draws.joints(Wiener(), noise))
    return {
        "nonlinear": _solved(Knowledge.at(refined, optimum.z), 1.0, chi2),
        "linear": estimators.Estimator(linear, linear.whitening(noise, measured)).solve(errors),
    }


def _paper(draws: Draws, noise: Noise, rng: np.random.Generator) -> dict[str, estimators.Solved]:
    """Fit as the paper does: signals treated, accelerations integrated, squares of SI units added."""
    flight, linear = draws.flight, estimators.linearised()
    rate, accel = (draws.treated(LowPass(), family, noise)[:, 0] for family in ("rate", "accel"))
    joints = draws.joints(estimators.PIECES, noise)
    moved = SampledJoints(np.stack(motion().evaluate(flight.time)) + joints[0])
    recording = recording_of(flight.time, flight.rate + rate[0], flight.accel + accel[0])
    posterior = estimators.raw_posterior(recording, moved, biased=False)
    weight = estimators.integrated(flight.time, None)
    scalars = weight.shape[1]  # the posterior's other rows are padding

    def residual(z: Floats) -> Floats:
        values: Floats = weight @ posterior.residuals(z).ravel()[:scalars]
        return values

    def jacobian(z: Floats) -> Floats:
        slopes: Floats = weight @ posterior.jacobian(z)[:scalars]
        return slopes

    solution = least_squares(residual, np.zeros(posterior.size), jacobian, method="lm", x_scale="jac")
    variance = 2.0 * solution.cost / (len(weight) - posterior.size)
    knowledge = Knowledge(*linearise(posterior, solution.x), jacobian(solution.x))
    equal_weights = estimators.Estimator(linear, weight, declared=False)
    return {
        "nonlinear": _solved(knowledge, np.sqrt(variance), variance),
        "linear": equal_weights.solve(linear.residual(rate, accel, joints)),
    }


def _solved(knowledge: Knowledge, sigma: float, chi2: float) -> estimators.Solved:
    return (knowledge.values - paper.TRUTH)[None], sigma * knowledge.sd[None], np.array([chi2])
