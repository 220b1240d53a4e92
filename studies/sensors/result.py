"""The computation of all numbers of the study."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studies.common.monte_carlo import Workers
from studies.sensors import montecarlo
from studies.sensors.draws import Draws
from studies.sensors.integration import Falsified, Scalar, falsified, scalars
from studies.sensors.linear import linearised
from studies.sensors.montecarlo import LIKELIHOOD, PAPER, Spread
from studies.sensors.refits import Refits, refit_all
from studies.sensors.regressor import Regression, attenuation, regress
from studies.sensors.setting import Flight, Noise, fly, levels

__all__ = ["REALISTIC", "Effort", "Result", "compute"]

REALISTIC = "2″, 1e-5, 1e-5"
"""Level of noise that stands for good sensors of today: star sensor, accelerometer [m/s2], encoder [rad]."""

REGRESSED = ("0.04 deg/s", "0.009 deg/s", REALISTIC)
"""Levels at which the linear method and the nonlinear fits are tried."""


@dataclass(frozen=True)
class Effort:
    """Amount of what is computed.

    Parameters
    ----------
    draws : int
        Number of sets of noise.
    likelihood_fits, paper_fits : int
        Numbers of nonlinear fits by the package's likelihood and by the paper's procedure.
    levels : sequence of str
        Levels of noise; all where empty.
    """

    draws: int
    likelihood_fits: int = 0
    paper_fits: int = 0
    levels: Sequence[str] = ()


@dataclass(frozen=True)
class Result:
    """The study's numbers, by level of noise and by treatment; relative to the true quantities.

    Attributes
    ----------
    flight : Flight
        True motion.
    levels : mapping of str to Noise
        Levels of noise by name.
    joints, rates, accelerometers : mapping of str to mapping of str to Spread
        Estimates by treatment of the joints, of the rates, and of the accelerometer.
    falsified : mapping of str to Falsified
        Errors without noise by use of the accelerometer.
    scalars : sequence of Scalar
        Problems with one unknown.
    regressions : mapping of str to mapping of str to Regression
        Estimates of the linear method.
    predicted : mapping of str to (10,) array
        Errors of the linear method with central differences, in closed form.
    refits : mapping of str to mapping of str to Refits
        Nonlinear fits by procedure; empty where the effort has none.
    effort : Effort
        Amount of what was computed.
    seconds : float
        Time that the computation took [s].
    """

    flight: Flight
    levels: Mapping[str, Noise]
    joints: Mapping[str, Mapping[str, Spread]]
    rates: Mapping[str, Mapping[str, Spread]]
    accelerometers: Mapping[str, Mapping[str, Spread]]
    falsified: Mapping[str, Falsified]
    scalars: Sequence[Scalar]
    regressions: Mapping[str, Mapping[str, Regression]]
    predicted: Mapping[str, NDArray[np.floating]]
    refits: Mapping[str, Mapping[str, Refits]]
    effort: Effort
    seconds: float


def compute(
    effort: Effort, seed: int, trials: Path | None, workers: Workers, progress: Callable[[str], None]
) -> Result:
    """Fly, treat and estimate; see `studies.sensors.run`."""
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
        joints[name] = montecarlo.joints(linear, draws, noise)
        rates[name] = montecarlo.rates(linear, draws, noise)
        accelerometers[name] = montecarlo.accelerometers(linear, draws, noise)
    regressed = [name for name in REGRESSED if name in chosen]
    progress(f"linear method, {time.perf_counter() - began:.0f} s")
    elsewhere = draws.over(free)
    regressions = {name: regress(elsewhere, chosen[name]) for name in regressed}
    fits = {LIKELIHOOD: effort.likelihood_fits, PAPER: effort.paper_fits}
    refits = refit_all(regressed, fits, seed, trials, workers, lambda text: progress(f"nonlinear fits: {text}"))
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
        predicted={name: attenuation(free, chosen[name]) for name in regressed},
        refits=refits,
        effort=effort,
        seconds=time.perf_counter() - began,
    )
