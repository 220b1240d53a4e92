"""The computation of all numbers of the study."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bayesid._math.arrays import Floats
from studies.common.monte_carlo import Workers
from studies.sensors import checks, estimators
from studies.sensors.checks import falsified, scalars
from studies.sensors.estimators import LIKELIHOOD, PAPER, Spread, linearised
from studies.sensors.signals import Draws, Flight, Noise, fly, levels

# level of noise that stands for good sensors of today: star sensor, accelerometer [m/s2], encoder [rad]
REALISTIC = "2″, 1e-5, 1e-5"

# levels at which the linear method and the nonlinear fits are tried
REGRESSED = ("0.04 deg/s", "0.009 deg/s", REALISTIC)


@dataclass(frozen=True)
class Effort:
    """Amount of what is computed."""

    draws: int  # number of sets of noise
    # numbers of nonlinear fits by the package's likelihood and by the paper's procedure
    likelihood_fits: int = 0
    paper_fits: int = 0
    levels: Sequence[str] = ()  # levels of noise; all where empty


@dataclass(frozen=True)
class Result:
    """The study's numbers, by level of noise and by treatment; relative to the true quantities."""

    flight: Flight  # true motion
    levels: Mapping[str, Noise]  # levels of noise by name
    # estimates by treatment of the joints, of the rates, and of the accelerometer
    joints: Mapping[str, Mapping[str, Spread]]
    rates: Mapping[str, Mapping[str, Spread]]
    accelerometers: Mapping[str, Mapping[str, Spread]]
    falsified: Mapping[str, Floats]  # errors without noise by use of the accelerometer
    scalars: Sequence[checks.Scalar]  # problems with one unknown
    regressions: Mapping[str, Mapping[str, Floats]]  # estimates of the linear method
    # errors of the linear method with central differences, in closed form
    predicted: Mapping[str, Floats]
    smoothing: Mapping[str, checks.SmoothingErrors]  # errors of smoothed joints over the stated ones
    refits: Mapping[str, Mapping[str, checks.Refits]]  # nonlinear fits by procedure; empty where the effort has none
    effort: Effort  # amount of what was computed


SMALL = Effort(draws=8, levels=("0.04 deg/s", REALISTIC))  # takes a minute
FULL = Effort(draws=48, likelihood_fits=5, paper_fits=32)  # takes minutes


def run(
    *,
    full: bool = False,
    seed: int = 1,
    effort: Effort | None = None,
    trials: Path | None = None,
    workers: Workers = 1,
    progress: Callable[[str], None] = lambda text: None,
) -> Result:
    """Run the study: fly, treat and estimate; arguments that are not described are options of the command.

    Parameters
    ----------
    effort : Effort, optional; effort in place of that of ``full``
    """
    effort = effort or (FULL if full else SMALL)
    began = time.perf_counter()
    progress("flights of the independent simulator, Jacobian")
    flight, free, linear = fly(), fly(gradient=False), linearised()
    draws_seed, scalar_seed = np.random.SeedSequence(seed).generate_state(2)
    draws = Draws.of(flight, effort.draws, np.random.default_rng(int(draws_seed)))
    chosen = {name: noise for name, noise in levels(flight).items() if not effort.levels or name in effort.levels}
    joints: dict[str, dict[str, Spread]] = {}
    rates: dict[str, dict[str, Spread]] = {}
    accelerometers: dict[str, dict[str, Spread]] = {}
    for name, noise in chosen.items():
        progress(f"noise {name}, {time.perf_counter() - began:.0f} s")
        joints[name] = estimators.joints(linear, draws, noise)
        rates[name] = estimators.rates(linear, draws, noise)
        accelerometers[name] = estimators.accelerometers(linear, draws, noise)
    regressed = [name for name in REGRESSED if name in chosen]
    progress(f"linear method, {time.perf_counter() - began:.0f} s")
    elsewhere = draws.over(free)
    regressions = {name: checks.regress(elsewhere, chosen[name]) for name in regressed}
    fits = {LIKELIHOOD: effort.likelihood_fits, PAPER: effort.paper_fits}
    refits = checks.refit_all(regressed, fits, seed, trials, workers, lambda text: progress(f"nonlinear fits: {text}"))
    standard = chosen.get(REALISTIC, next(iter(chosen.values())))
    return Result(
        flight,
        chosen,
        joints,
        rates,
        accelerometers,
        falsified=falsified(flight, linear, standard),
        scalars=scalars(10 * effort.draws, np.random.default_rng(int(scalar_seed))),
        regressions=regressions,
        predicted={name: checks.attenuation(free, chosen[name]) for name in regressed},
        smoothing={name: checks.SmoothingErrors.of(draws, noise) for name, noise in chosen.items()},
        refits=refits,
        effort=effort,
    )
