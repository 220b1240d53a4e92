"""Tables of the report, each as its header and its rows, and numbers for its sentences."""

from __future__ import annotations

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.inference.body_quantities import BODY_QUANTITIES
from bayesid.report.numbers import format_fixed, format_number, format_percent, format_quantity, format_unit
from bayesid.simulation.sensors import Kind
from studies.base_body import paper
from studies.base_body.information import ARM, STAR
from studies.base_body.noise_free import NoiseFree
from studies.base_body.readings import CLAIM
from studies.base_body.result import GRADES, BaseBody
from studies.common.ets7 import BASE
from studies.common.quantities import HEADINGS, MASS, MOMENTS

__all__ = ["arm_table", "case_table", "goal_rows", "grade_table", "gradient_numbers", "poor_numbers"]
__all__ += ["posterior_table", "printed_table", "reading_sentences", "reading_table", "sampler_sentences"]

Table = tuple[list[str], list[list[str]]]

GOAL = 1e-6
"""Largest relative error that is allowed without noise; the integration allows no smaller one."""


def goal_rows(result: BaseBody) -> list[list[str]]:
    """Return the questions and their answers in numbers."""
    cases, well, poor = result.noise_free, result.noise_free["well"], result.noise_free["poor"]
    exact = [name for name in cases if "gradient" not in name]
    worst = max(cases[name].worst for name in exact)
    loss = poor.uncertainty / well.uncertainty
    arm_exact, arm_known = result.grades["exact"], result.grades["5 %"]
    rows = [
        [
            f"Is every parameter within {format_number(GOAL)} of the truth without noise? The paper's errors are "
            "10⁻⁴ to 6 × 10⁻², and up to 0.5 with the poorly exciting manoeuvre.",
            f"{'Yes' if worst < GOAL else 'No'}: the worst error of {len(exact)} cases is {format_number(worst, 2)}.",
        ],
        [
            "What does the poorly exciting manoeuvre cost?",
            f"Nothing without noise; with noise izz is {format_fixed(loss[6], 1)} and ixy {format_fixed(loss[7], 1)} "
            "times more uncertain.",
        ],
        [
            "What does it cost to leave the gravity gradient out of the model?",
            f"The worst error is {format_percent(cases['well, no gradient'].worst)} instead of "
            f"{format_number(well.worst, 1)}.",
        ],
        [
            "What do realistic sensors give with an exact arm (a star sensor of 2″ and an accelerometer of "
            f"{format_number(GRADES[0])} m/s²)?",
            f"The mass has a standard deviation of {format_percent(arm_exact[0, MASS])}, the moments of up to "
            f"{format_percent(arm_exact[0, MOMENTS].max())}.",
        ],
        [
            "What do the same sensors give with the arm known to 5 %?",
            f"The mass has a standard deviation of {format_percent(arm_known[0, MASS])}, {result.arm_ratio:.0f} times "
            "as much.",
        ],
        [
            f"What does the best accelerometer give, {format_number(GRADES[-1])} m/s²?",
            f"The mass has a standard deviation of {format_percent(arm_exact[-1, MASS])} if everything else is exact, "
            f"and of {format_percent(arm_known[-1, MASS])} with the arm known to 5 %.",
        ],
        [
            "Can the paper's sigma of 0.04 be in rad/s?",
            f"No: it would be {result.readings[0].fraction:.0f} times the peak rate.",
        ],
    ]
    if "well, arm 1/7" in cases:
        answer = f"It is as exact: the worst error is {format_number(cases['well, arm 1/7'].worst, 1)}."
        rows.insert(3, ["What does a mass ratio of 1/7 change, instead of 1/25?", answer])
    return rows


def printed_table(case: NoiseFree, printed: Floats) -> Table:
    """Return for every quantity the truth, the paper's guess and result, this study's result, and both errors."""
    rows = [
        [
            heading,
            *(format_number(values[index], 6) for values in (paper.TRUTH, paper.GUESS, printed)),
            format_number(case.estimate[index], 7),
            format_number(abs(printed[index] / paper.TRUTH[index] - 1.0), 1),
            format_number(abs(case.error[index]), 1),
        ]
        for index, heading in enumerate(HEADINGS)
    ]
    return ["quantity", "truth", "guess", "paper", "here", "error, paper", "error, here"], rows


def case_table(result: BaseBody) -> Table:
    """Return the worst errors and the misfit of every noise-free case."""
    groups = (slice(0, 1), slice(1, 4), slice(4, 7), slice(7, 10))
    rows = [
        [
            name,
            *(format_number(float(np.abs(case.error[group]).max()), 1) for group in groups),
            format_number(case.misfit, 2),
        ]
        for name, case in result.noise_free.items()
    ]
    return ["manoeuvre, model", "mass", "centre of mass", "moments", "products", "misfit"], rows


def poor_numbers(result: BaseBody) -> dict[str, str]:
    """Return the peak rates of the poorly exciting manoeuvre, and what noise makes of both manoeuvres."""
    well, poor = result.noise_free["well"], result.noise_free["poor"]
    picked = {"mass": 0, "izz": 6, "ixz": 8}
    return {
        "peak": ", ".join(format_fixed(1e3 * value, 2) for value in poor.peak),
        "well": ", ".join(format_percent(well.uncertainty[index], 2) for index in picked.values()),
        **{name: format_percent(poor.uncertainty[index], 2) for name, index in picked.items()},
    }


def gradient_numbers(result: BaseBody) -> dict[str, str]:
    """Return what leaving the gravity gradient out does to the fit."""
    case = result.noise_free["well, no gradient"]
    samples = 6 * len(case.recording.time)
    return {
        "misfit": format_number(case.misfit, 2),
        "chi2": format_number(case.misfit**2 * samples, 2),
        "bias": format_number(float((np.abs(case.error) / case.uncertainty).max()), 2),
    }


def posterior_table(result: BaseBody) -> Table:
    """Return the sampled posterior of every quantity with both arms."""
    bodies = [identified.bodies[BASE] for identified in result.sampled.values()]
    rows = [
        [
            heading,
            format_number(paper.TRUTH[index], 6),
            *(format_quantity(float(body.mean[index]), float(body.sd[index])) for body in bodies),
        ]
        for index, heading in enumerate(HEADINGS)
    ]
    return ["quantity", "truth", *(f"arm {name}" for name in result.sampled)], rows


def sampler_sentences(result: BaseBody) -> list[str]:
    """Return how the samplers did and how far the truth is from their mean."""
    sentences = []
    for name, identified in result.sampled.items():
        body, chains = identified.bodies[BASE], identified.chains
        miss = body.mean - paper.TRUTH
        distance = float(miss @ np.linalg.solve(np.cov(body.values.T), miss))
        sentences.append(
            f"Arm {name}: the posterior has {identified.posterior.size} unknowns. The ensembles gave "
            f"{chains.effective_samples:.0f} effective samples from {chains.evaluations} evaluations, with R-hat "
            f"{chains.r_hat:.4f} and acceptance {chains.acceptance:.2f}, and have "
            f"{'' if chains.converged else 'not '}converged. Chi² is {identified.optimum.chi2:.0f} for "
            f"{identified.posterior.samples} samples. The squared distance of the truth from the mean, in the "
            f"posterior's metric, is {distance:.1f}; 10 ± 4.5 is expected. "
            + (" ".join(identified.disagreements) or "Mode, importance sampling and ensembles agree.")
        )
    return sentences


def grade_table(result: BaseBody) -> Table:
    """Return the standard deviations that every accelerometer leaves, by knowledge of the rest."""
    rows = [
        [
            format_number(grade),
            *(
                f"{format_percent(widths[index, MASS], 2)} / {format_percent(widths[index, MOMENTS].max(), 2)}"
                for widths in result.grades.values()
            ),
        ]
        for index, grade in enumerate(GRADES)
    ]
    return ["accelerometer [m/s²]", *(f"arm {name}" for name in result.grades)], rows


def reading_table(result: BaseBody) -> Table:
    """Return what every unit would mean that the sigmas may have."""
    rows = [
        [
            f"{reading.sigma:g} {format_unit(reading.unit)}",
            *(format_percent(value, 2) for value in (reading.fraction, reading.mass, reading.moment)),
            format_number(reading.manoeuvres),
        ]
        for reading in result.readings
    ]
    return ["sigma", "noise / peak", "mass", "worst moment", "manoeuvres for 2 %"], rows


def reading_sentences(result: BaseBody) -> list[str]:
    """Return in which units one manoeuvre can have an error of 2 %."""
    sentences, fitting = [], []
    for sigma in dict.fromkeys(reading.sigma for reading in result.readings):
        chosen = [reading for reading in result.readings if reading.sigma == sigma]
        fitting.append([format_unit(item.unit) for item in chosen if max(item.mass, item.moment) <= CLAIM])
        buried = [format_unit(reading.unit) for reading in chosen if reading.fraction > 1.0]
        sentences.append(
            f"Sigma {sigma:g} exceeds the whole signal in {' and in '.join(buried) or 'no unit'}. One manoeuvre could "
            f"have an error of 2 % with {'; '.join(fitting[-1]) or 'none of these units'}."
        )
    both = [unit for unit in fitting[0] if all(unit in units for units in fitting)]
    return [*sentences, f"Units that fit both values: {'; '.join(both) or 'none'}."]


def arm_table(result: BaseBody) -> Table:
    """Return every quantity with the arm exact and known to 5 %, fast and, if computed, slow."""
    sigma = {Kind.ATTITUDE: STAR, Kind.ACCEL: GRADES[0]}
    cases = {"fast": result.fast} | ({} if result.slow is None else {"slow": result.slow})
    columns = {
        f"{name}, arm {arm}": 100.0 * information.relative_sd(sigma, known)
        for name, information in cases.items()
        for arm, known in (("exact", (ARM,)), ("5 %", ()))
    }
    rows = [
        [name, *(format_number(column[index], 2) for column in columns.values())]
        for index, name in enumerate(BODY_QUANTITIES)
    ]
    return ["quantity", *columns], rows
