"""All numbers of the study."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studies.sensors import montecarlo
from studies.sensors.draws import Draws
from studies.sensors.integration import Falsified, Scalar, falsified, scalars
from studies.sensors.linear import Linear, raw_posterior
from studies.sensors.montecarlo import Spread
from studies.sensors.refits import Refits, refit
from studies.sensors.regressor import Regression, attenuation, regress
from studies.sensors.setting import Flight, Noise, fly, levels, motion

__all__ = ["REALISTIC", "REGRESSED", "Effort", "Result", "compute"]

REALISTIC = "2″, 1e-5, 1e-5"
"""Level of noise that stands for good sensors of today: star sensor, accelerometer [m/s2], encoder [rad]."""

REGRESSED = ("0.04 deg/s", "0.009 deg/s", REALISTIC)
"""Levels at which the linear method is tried."""


@dataclass(frozen=True)
class Effort:
    """How much is computed.

    Parameters
    ----------
    draws : int
        Sets of noise.
    ours, theirs : int
        Nonlinear fits by the package's likelihood and by the paper's procedure.
    levels : sequence of str
        Of noise; all where empty.
    """

    draws: int
    ours: int
    theirs: int
    levels: Sequence[str] = ()


@dataclass(frozen=True)
class Result:
    """The study's numbers, by level of noise and by treatment; relative to the true quantities.

    Attributes
    ----------
    predicted : mapping of str to (10,) array
        Errors of (19) with central differences, in closed form.
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


def compute(effort: Effort, seed: int, progress: Callable[[str], None]) -> Result:
    """Fly, treat, estimate."""
    began = time.perf_counter()
    progress("flights of the independent simulator, Jacobian")
    flight, free = fly(), fly(gradient=False)
    raw = raw_posterior(flight, motion())
    linear = Linear.of(flight, raw)
    draws_seed, scalar_seed = np.random.SeedSequence(seed).generate_state(2)
    draws = Draws(flight, effort.draws, int(draws_seed))
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
    regressions = {name: regress(free, elsewhere, chosen[name]) for name in regressed}
    refits = {}
    for name in regressed if effort.ours else ():
        progress(f"nonlinear fits, noise {name}, {time.perf_counter() - began:.0f} s")
        refits[name] = refit(raw, linear, draws, chosen[name], effort.ours, effort.theirs)
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
