"""Rows of the report's tables."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bayesid.inference.body_quantities import BODY_QUANTITIES
from bayesid.report.numbers import format_number, format_quantity, format_unit
from bayesid.simulation.sensors import Kind
from studies.base_body import paper
from studies.base_body.information import ARM, STAR
from studies.base_body.noise_free import NoiseFree
from studies.base_body.readings import CLAIM
from studies.base_body.result import GRADES, BaseBody
from studies.common.ets7 import BASE

__all__ = ["arm_table", "case_table", "goal_rows", "grade_table", "posterior_table", "printed_table", "reading_table"]

Floats = NDArray[np.float64]
Table = tuple[Sequence[str], list[list[str]]]

GOAL = 1e-6
PRINTED = ["left", *["right"] * 6]
CASES = ["left", *["right"] * 5]
POSTERIOR = ["left", *["right"] * 3]
READINGS = ["right", "left", *["right"] * 4]


def printed_table(case: NoiseFree, printed: Floats) -> Table:
    """Every quantity: truth, the paper's guess and result, ours, and both errors."""
    rows = []
    for index, (name, unit) in enumerate(BODY_QUANTITIES.items()):
        truth = paper.TRUTH[index]
        values = (truth, paper.GUESS[index], printed[index])
        rows.append(
            [
                f"{name} [{format_unit(unit)}]",
                *(format_number(value, 6) for value in values),
                f"{case.estimate[index]:.7g}".replace("-", "−"),
                format_number(abs(printed[index] / truth - 1.0), 1),
                format_number(abs(case.error[index]), 1),
            ]
        )
    return ["", "truth", "guess", "paper", "here", "error, paper", "error, here"], rows


def case_table(result: BaseBody) -> Table:
    """Every noise-free case: worst errors, misfit and evaluations."""
    rows = [
        [
            name,
            format_number(abs(case.error[0]), 1),
            format_number(float(np.abs(case.error[1:4]).max()), 1),
            format_number(float(np.abs(case.error[4:7]).max()), 1),
            format_number(float(np.abs(case.error[7:]).max()), 1),
            format_number(case.misfit, 2),
        ]
        for name, case in result.noise_free.items()
    ]
    return ["manoeuvre, model", "mass", "centre of mass", "moments", "products", "misfit"], rows


def goal_rows(result: BaseBody) -> list[list[str]]:
    """Return the questions and their answers in numbers."""
    cases, well, poor = result.noise_free, result.noise_free["well"], result.noise_free["poor"]
    exact = [name for name in cases if "gradient" not in name]
    worst = max(cases[name].worst for name in exact)
    loss = poor.uncertainty / well.uncertainty
    rows = [
        [
            f"noise-free, every parameter within {format_number(GOAL)} (paper: 10⁻⁴ to 6 × 10⁻²; poor: to 0.5)",
            f"{'reached' if worst < GOAL else 'missed'}: worst of {len(exact)} cases {format_number(worst, 2)}",
        ],
        [
            "poorly exciting manoeuvre",
            f"still exact without noise; with noise izz is {loss[6]:.1f} and ixy {loss[7]:.1f} times more uncertain",
        ],
        [
            "gravity gradient left out of the model",
            f"worst error {_percent(cases['well, no gradient'].worst)} instead of {format_number(well.worst, 1)}",
        ],
        [
            f"realistic sensors, arm exact (2″ star sensor, {format_number(GRADES[0])} m/s²)",
            f"sd of mass {_percent(result.grades['exact'][0, 0])}, of moments up to "
            f"{_percent(result.grades['exact'][0, 4:7].max())}",
        ],
        [
            "the same, arm known to 5 %",
            f"sd of mass {_percent(result.grades['5 %'][0, 0])}: {result.arm_ratio:.0f} times wider",
        ],
        [
            f"best accelerometer, {format_number(GRADES[-1])} m/s²",
            f"sd of mass {_percent(result.grades['exact'][-1, 0])} if everything else is exact, "
            f"{_percent(result.grades['5 %'][-1, 0])} with the arm known to 5 %",
        ],
        ["sigma 0.04 in rad/s", f"{result.readings[0].fraction:.0f} times the peak rate: cannot be what was meant"],
    ]
    if "well, arm 1/7" in cases:
        error = format_number(cases["well, arm 1/7"].worst, 1)
        rows.insert(3, ["mass ratio 1/7 instead of 1/25", f"as exact: worst error {error}"])
    return rows


def widths(result: BaseBody) -> dict[str, str]:
    """Return widths that noise would give the two manoeuvres, for the text."""
    well, poor = result.noise_free["well"].uncertainty, result.noise_free["poor"].uncertainty
    picked = {"mass": 0, "izz": 6, "ixz": 8}
    texts = {name: _percent(float(poor[index])) for name, index in picked.items()}
    return texts | {"well": ", ".join(_percent(float(well[index])) for index in picked.values())}


def blindness(result: BaseBody) -> dict[str, str]:
    """Return what leaving the gradient out does to the fit, for the text."""
    case = result.noise_free["well, no gradient"]
    samples = 6 * len(case.recording.time)
    return {
        "misfit": format_number(case.misfit, 2),
        "chi2": format_number(case.misfit**2 * samples, 2),
        "bias": format_number(float((np.abs(case.error) / case.uncertainty).max()), 2),
    }


def posterior_table(result: BaseBody) -> Table:
    """Every quantity with both arms."""
    rows = []
    for index, (name, unit) in enumerate(BODY_QUANTITIES.items()):
        cells = []
        for found in result.sampled.values():
            body = found.bodies[BASE]
            cells.append(format_quantity(float(body.mean[index]), float(body.sd[index])))
        rows.append([f"{name} [{format_unit(unit)}]", format_number(paper.TRUTH[index], 6), *cells])
    return ["", "truth", *(f"arm {name}" for name in result.sampled)], rows


def sampler_sentences(result: BaseBody) -> list[str]:
    """Return how the samplers did and how far the truth is from their mean."""
    sentences = []
    for name, found in result.sampled.items():
        body, chains = found.bodies[BASE], found.chains
        miss = body.mean - paper.TRUTH
        distance = float(miss @ np.linalg.solve(np.cov(body.values.T), miss))
        sentences.append(
            f"Arm {name}: {found.posterior.size} unknowns, {chains.effective_samples:.0f} effective samples of "
            f"{chains.evaluations} evaluations, R-hat {chains.r_hat:.4f}, acceptance {chains.acceptance:.2f}, "
            f"{'converged' if chains.converged else 'not converged'}; chi² {found.optimum.chi2:.0f} of "
            f"{found.posterior.samples} samples. Squared distance of the truth from the mean, in the posterior's "
            f"metric: {distance:.1f}, expected 10 ± 4.5. "
            + (" ".join(found.disagreements) or "Mode, importance sampling and ensembles agree.")
        )
    return sentences


def grade_table(result: BaseBody) -> Table:
    """Every accelerometer and what it gives, by knowledge of the rest."""
    rows = [
        [
            format_number(grade),
            *(f"{_percent(own[index, 0])} / {_percent(own[index, 4:7].max())}" for own in result.grades.values()),
        ]
        for index, grade in enumerate(GRADES)
    ]
    return ["accelerometer [m/s²]", *(f"arm {name}" for name in result.grades)], rows


def reading_table(result: BaseBody) -> Table:
    """Every unit the sigmas may have."""
    rows = [
        [
            f"{reading.sigma:g}",
            format_unit(reading.unit),
            f"{format_number(100.0 * reading.fraction, 2)} %",
            _percent(reading.mass),
            _percent(reading.moment),
            f"{reading.manoeuvres:,.0f}".replace(",", " "),
        ]
        for reading in result.readings
    ]
    return ["sigma", "unit", "noise / peak", "mass", "worst moment", "manoeuvres for 2 %"], rows


def reading_sentences(result: BaseBody) -> list[str]:
    """Return which readings one manoeuvre's error of 2 % allows."""
    sentences, fitting = [], []
    for sigma in dict.fromkeys(reading.sigma for reading in result.readings):
        own = [reading for reading in result.readings if reading.sigma == sigma]
        able = [reading.unit for reading in own if max(reading.mass, reading.moment) <= CLAIM]
        buried = [format_unit(reading.unit) for reading in own if reading.fraction > 1.0]
        sentences.append(
            f"{sigma:g}: in {' or '.join(buried) or 'no unit'} it exceeds the whole signal. An error of 2 % from one "
            f"manoeuvre of this kind would allow {'; '.join(map(format_unit, able)) or 'none of these readings'}."
        )
        fitting.append(set(able))
    both = [
        unit
        for unit in dict.fromkeys(reading.unit for reading in result.readings)
        if all(unit in own for own in fitting)
    ]
    sentences.append(f"Readings that fit both: {'; '.join(map(format_unit, both)) or 'none'}.")
    return sentences


def arm_table(result: BaseBody) -> Table:
    """Every quantity with the arm exact and known to 5 %, fast and, if computed, slow."""
    sigma = {Kind.ATTITUDE: STAR, Kind.ACCEL: GRADES[0]}
    cases = {"fast": result.fast} | ({} if result.slow is None else {"slow": result.slow})
    columns = {
        f"{name}, arm {arm}": information.relative_sd(sigma, known)
        for name, information in cases.items()
        for arm, known in (("exact", (ARM,)), ("5 %", ()))
    }
    header = ["", *columns]
    rows = [
        [name, *(format_number(100.0 * column[index], 2) for column in columns.values())]
        for index, name in enumerate(BODY_QUANTITIES)
    ]
    return header, rows


def _percent(value: float) -> str:
    return f"{format_number(100.0 * value, 2)} %"
