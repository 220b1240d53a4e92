"""The measurements: simulations by this package and others, and effective samples by its moves and emcee's own."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import emcee
import jax
import numpy as np
from emcee.autocorr import integrated_time

from bayesid import (
    BodyPrior,
    Excitation,
    Manoeuvre,
    MeasuredMotion,
    Model,
    Orbit,
    Posterior,
    Robot,
    Sensor,
    SensorKind,
    White,
)
from bayesid.design.design_result import sample_times
from bayesid.inference import Chains, LogCholeskyParameterisation, identify
from bayesid.inference.predicted_readings import integration_error_at, simulate_manoeuvre
from bayesid.simulation.effects import GravityGradient
from studies.benchmark.device import LAST, DeviceTimes, measured_on_device, search_seconds
from studies.common.ets7 import INTERVAL, RADIUS, ets7
from studies.common.study import show
from studies.truth import stepwise
from studies.truth.mujoco import TruthModel, rollout
from studies.truth.orbit import Orbit as TrueOrbit

SIGMA = 1.0e-5  # noise per sample of rate [rad/s] and accelerometer [m/s2]
DURATION = 120.0  # length of every manoeuvre [s]

# link and joint of the chain in URDF
LINK = """
  <link name="link{n}"><inertial><origin xyz="{half} 0 0.01"/><mass value="{mass}"/>
    <inertia ixx="{thin}" iyy="{thick}" izz="{thick}" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="joint{n}" type="revolute"><parent link="{parent}"/><child link="link{n}"/>
    <origin xyz="{length} 0 0" rpy="{turn} 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-6.3" upper="6.3" effort="1" velocity="10"/></joint>"""


def chain(links: int) -> Robot:
    """Return a robot whose arm of 3 m and 60 kg is cut into equal links."""
    length, mass = 3.0 / links, 60.0 / links
    thick = mass * (length**2 / 12.0 + 0.01)
    parts = [
        LINK.format(
            n=n,
            parent=f"link{n - 1}" if n > 1 else "base_link",
            half=length / 2.0,
            length=length if n > 1 else 0.8,
            mass=mass,
            thin=0.015 * mass,
            thick=thick,
            turn=np.pi / 2.0 if n % 2 else -np.pi / 2.0,
        )
        for n in range(1, links + 1)
    ]
    base = """<link name="base_link"><inertial><origin xyz="0.05 0.02 -0.1"/><mass value="640"/>
    <inertia ixx="210" iyy="265" izz="240" ixy="-4" ixz="6.5" iyz="3"/></inertial></link>"""
    return Robot.from_string(f'<robot name="chain">{base}{"".join(parts)}</robot>')


def model_of(robot: Robot) -> Model:
    """Return the model with an unknown base, rate sensor, accelerometer and gravity gradient."""
    sensors = (Sensor(SensorKind.RATE, White(SIGMA)), Sensor(SensorKind.ACCEL, White(SIGMA), position=(0.3, 0.2, 0.4)))
    prior = BodyPrior(robot.base, robot.link(robot.base).inertial, 1.0)
    return Model(robot, sensors, (prior,), Orbit(RADIUS), (GravityGradient(),))


def excitation(joints: int, seed: int) -> Excitation:
    """Return a random manoeuvre of all joints that lasts `DURATION`."""
    rng = np.random.default_rng(seed)
    shrink = np.sqrt(6.0 / joints)
    return Excitation(
        offset=0.5 * shrink * rng.normal(size=joints),
        amplitude=0.5 * shrink * rng.normal(size=joints),
        frequency=2.0 * np.pi / 30.0,
        periods=2,
        ramp=0.5 * (DURATION - 60.0),
    )


def posterior_of(
    robot: Robot, *, recordings: int = 1, interval: float = INTERVAL, encoder_sigma: float = 0.0
) -> Posterior:
    """Return the posterior of simulated recordings.

    Parameters
    ----------
    robot : Robot
    recordings : int; number of recordings of different manoeuvres
    interval : float; time between samples [s]
    encoder_sigma : float; noise of the joint positions [rad]; the joints' motion is known exactly where it is 0
    """
    model = model_of(robot)
    manoeuvres = []
    for seed in range(recordings):
        rng = np.random.default_rng(seed)
        motion = excitation(len(robot.joints), seed)
        time, name = sample_times(DURATION, interval), f"manoeuvre-{seed}"
        recording = simulate_manoeuvre(model, motion, time, name=name, rng=rng, encoder_sigma=encoder_sigma)
        measured = (
            MeasuredMotion.from_recording(recording, robot, sigma={0: encoder_sigma}) if encoder_sigma else motion
        )
        manoeuvres.append(Manoeuvre(recording, measured))
    return Posterior.of(model, manoeuvres)


BATCH = 64  # number of simulations that are evaluated per call

# what is evaluated where no other case is named, in words
EVALUATED = (
    f"one recording of {round(DURATION / INTERVAL) + 1} samples over {DURATION:g} s, joints known exactly, base and "
    f"initial rate unknown, in batches of {BATCH} points"
)

STEPS = (0.1, 0.05, 0.02, 0.01, 0.005)  # steps tried for MuJoCo, longest first [s]


class Rival(NamedTuple):
    """Another simulator."""

    name: str
    seconds: float  # time per simulation [s]
    step: float  # integration step that it needs [s]
    error: float  # largest error of a rate, in standard deviations of a sample


def best_of(function: Callable[[], Any], repeats: int) -> float:
    """Return the shortest time of several calls [s], after one that is not counted."""
    function()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return min(times)


def seconds_per_evaluation(posterior: Posterior, repeats: int = 10) -> float:
    """Return the time of one evaluation of the log density, simulation and sensors included [s]."""
    z = posterior.starting_point() + 0.01 * np.random.default_rng(0).normal(size=(BATCH, posterior.size))
    return best_of(lambda: posterior.log_density(z), repeats) / BATCH


def rivals(robot: Robot, posterior: Posterior, repeats: int = 2) -> list[Rival]:
    """Time the step-by-step Pinocchio loop and MuJoCo's rollouts of the same manoeuvre."""
    motion = excitation(len(robot.joints), 0)
    samples = posterior.data.times(0)
    with tempfile.TemporaryDirectory() as folder:
        urdf = Path(folder) / "robot.urdf"
        robot.write_urdf(urdf)
        return [_pinocchio(urdf, motion, samples, repeats), _mujoco(urdf, motion, samples, repeats)]


def _state_at(motion: Any) -> Callable[[float], tuple[Any, Any, Any]]:
    def at(instant: float) -> tuple[Any, Any, Any]:
        state = motion.evaluate(np.array([instant]))
        return state.position[0], state.velocity[0], state.acceleration[0]

    return at


def _pinocchio(urdf: Path, motion: Any, samples: Any, repeats: int) -> Rival:

    def simulate(step: float) -> Any:
        zenith = TrueOrbit(RADIUS).zenith
        return stepwise.simulate(urdf, _state_at(motion), samples, step, zenith=zenith)

    fine, coarse = simulate(0.25).rate, simulate(0.5).rate
    seconds = best_of(lambda: simulate(0.5), repeats)
    return Rival("Pinocchio, step by step in Python", seconds, 0.5, _sigmas(coarse - fine))


def _mujoco(urdf: Path, motion: Any, samples: Any, repeats: int) -> Rival:
    """Roll out in C, joints driven by the exact torques at mid-step; rollouts have no gravity gradient."""
    exact = TruthModel(urdf)
    at = _state_at(motion)
    right = exact.run(at, samples, step=0.1).rate
    for step in STEPS:
        count = round(DURATION / step)
        roll = rollout(exact, at, count, step)
        # readings are taken before a step, so that row k belongs to time k step
        row = np.round(samples / step).astype(int)
        use = row < count
        result = Rival("MuJoCo rollouts in C", best_of(roll, repeats), step, _sigmas(roll()[row[use]] - right[use]))
        if result.error < 0.01:
            break
    return result


def _sigmas(difference: Any) -> float:
    return float(np.abs(difference).max() / SIGMA)


class Sampling(NamedTuple):
    """Cost of effective samples, burn-in included and compilation not."""

    chains: Chains  # samples by the package's moves
    seconds: float  # time of the whole identification: mode, coordinates, evidence and samples [s]
    default_evaluations: int  # number of evaluations by emcee's default move, burn-in included
    default_effective: float  # number of effective samples that they gave
    default_seconds: float  # time that they took [s]
    default_lengths: float  # number of autocorrelation times that the default move's chain covers

    @property
    def cost(self) -> float:
        """Evaluations per effective sample by the package's moves."""
        return self.chains.evaluations / self.chains.effective_samples

    @property
    def default_cost(self) -> float:
        """Evaluations per effective sample by emcee's default move."""
        return self.default_evaluations / self.default_effective


def compare_moves(posterior: Posterior, *, effective: float, default_steps: int, seed: int) -> Sampling:
    """Sample one posterior with the package's moves and with emcee's default stretch move.

    Parameters
    ----------
    posterior : Posterior
    effective : float; number of effective samples by the package's moves
    default_steps : int; number of steps of the default move
    seed : int; seed of the samplers
    """
    identify(posterior, seed, effective_samples=1.0)  # compiles
    began = time.perf_counter()
    result = identify(posterior, seed, effective_samples=effective)
    seconds = time.perf_counter() - began
    refined, chains = result.posterior, result.chains
    sampler = emcee.EnsembleSampler(chains.walkers, refined.size, refined.log_density, vectorize=True)
    sampler.random_state = np.random.RandomState(seed).get_state()
    start = (
        LogCholeskyParameterisation(refined).proposal(result.optimum).draw(chains.walkers, np.random.default_rng(seed))
    )
    began = time.perf_counter()
    sampler.run_mcmc(start, default_steps, skip_initial_state_check=True)
    default_seconds = time.perf_counter() - began
    kept = default_steps - default_steps // 5
    tau = float(np.max(integrated_time(sampler.get_chain()[-kept:], tol=0, quiet=True)))
    return Sampling(
        chains=chains,
        seconds=seconds,
        default_evaluations=default_steps * chains.walkers,
        default_effective=kept * chains.walkers / tau,
        default_seconds=default_seconds,
        default_lengths=kept / tau,
    )


RUNS = 5  # number of runs, one after the other, whose spread is reported


@dataclass(frozen=True)
class Benchmark:
    """Times measured in one run [s]."""

    evaluation: float  # time of one evaluation of the log density of ETS-VII
    error: float  # integration error of that evaluation, in standard deviations of a sample
    rivals: list[Rival]  # other simulators of the same manoeuvre
    # time of one evaluation by number of links, and by number of samples
    links: dict[int, float]
    samples: dict[int, float]
    # time with white noise, with an encoder whose noise is negligible, and with one whose noise matters
    whitening: dict[str, float]
    windows: dict[str, int]  # number of earlier sample times that each of these whitenings conditions on
    sampling: Sampling  # cost of an effective sample

    @property
    def speedups(self) -> dict[str, float]:
        """Time of each rival over that of one evaluation, by its name."""
        return {rival.name: rival.seconds / self.evaluation for rival in self.rivals}


class Result(NamedTuple):
    """All runs, whether they took longer chains and more repeats, and the times of a device where there is one."""

    runs: list[Benchmark]
    full: bool
    device: DeviceTimes | None = None
    search: float | None = None  # time of a search for manoeuvres on the processor [s]


def run(*, full: bool = False, seed: int = 0, progress: Callable[[str], None] = show) -> Result:
    """Measure everything in each of `RUNS` runs.

    Parameters
    ----------
    full : bool; whether to take longer chains of the default move and more repeats
    seed : int; seed of the samplers in the first run
    progress : callable, optional; receives a line before each run
    """
    results = []
    for number in range(RUNS):
        progress(f"run {number + 1} of {RUNS}")
        results.append(_measured(full=full, seed=seed + number))
    measured = measured_on_device(posterior_of(ets7(), recordings=3), seed)
    if measured is not None:
        measured.write(LAST)
    with jax.default_device(jax.devices("cpu")[0]):
        return Result(results, full, measured, search_seconds(seed) if full else None)


def _measured(*, full: bool, seed: int) -> Benchmark:
    robot = ets7()
    single = posterior_of(robot)
    whitening = {"white": 0.0, "encoder 1e-6 rad": 1e-6, "encoder 1e-4 rad": 1e-4}
    posteriors = {name: posterior_of(robot, encoder_sigma=sigma) for name, sigma in whitening.items()}
    repeats = 20 if full else 5
    return Benchmark(
        evaluation=seconds_per_evaluation(single, repeats),
        error=integration_error_at(single, single.starting_point()),
        rivals=rivals(robot, single),
        links={count: seconds_per_evaluation(posterior_of(chain(count)), repeats) for count in (6, 20, 60)},
        samples={
            round(120.0 / interval) + 1: seconds_per_evaluation(posterior_of(robot, interval=interval), repeats)
            for interval in (1.0, 0.5, 0.2, 0.1)
        },
        whitening={name: seconds_per_evaluation(posterior, repeats) for name, posterior in posteriors.items()},
        windows={name: posterior.whitenings[0].window.longest for name, posterior in posteriors.items()},
        sampling=compare_moves(
            posterior_of(robot, recordings=3), effective=4000.0, default_steps=12000 if full else 600, seed=seed
        ),
    )
