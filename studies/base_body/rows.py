"""Tables of the report, each as its header and its rows, and the sentences on the sampled posterior."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bayesid.inference import Identification
from bayesid.inference.body_quantities import BODY_QUANTITIES
from bayesid.report.numbers import format_number, format_percent
from studies.base_body import paper
from studies.base_body.noise_free import NoiseFree
from studies.base_body.result import GRADES, BaseBody
from studies.common.ets7 import BASE
from studies.common.quantities import HEADINGS

__all__ = ["case_table", "estimates", "grades", "precision_table", "readings", "sampler_sentence", "squared_distance"]

Table = tuple[list[str], list[list[str]]]

CASES = {
    "well": "well exciting",
    "poor": "poorly exciting",
    "well, no gradient": "well exciting, no gravity gradient in the model",
    "poor, no gradient": "poorly exciting, no gravity gradient in the model",
    "well, rate unknown": "well exciting, initial rate unknown",
    "well, arm 1/7": "well exciting, arm of 1/7 of the base's mass",
}
"""Names of the noise-free cases in words."""


def _case_row(case: NoiseFree) -> list[str]:
    groups = (slice(0, 1), slice(1, 4), slice(4, 7), slice(7, 10))
    errors = [format_percent(float(np.abs(case.error[group]).max()), 1) for group in groups]
    return [*errors, format_number(case.misfit, 2)]


def case_table(result: BaseBody) -> Table:
    """Return the worst errors and the misfit of every noise-free case, those of the paper first."""
    groups = (slice(0, 1), slice(1, 4), slice(4, 7), slice(7, 10))
    printed = [
        [f"the paper, {name}", *(format_percent(float(np.abs(error[group]).max()), 1) for group in groups), "–"]
        for name, error in (
            ("well exciting", paper.RESULT_WELL / paper.TRUTH - 1.0),
            ("poorly exciting", paper.RESULT_POOR / paper.TRUTH - 1.0),
        )
    ]
    rows = [[CASES[name], *_case_row(case)] for name, case in result.noise_free.items()]
    return ["manoeuvre, model", "mass", "centre of mass", "moments", "products", "misfit"], [*printed, *rows]


def precision_table(result: BaseBody) -> Table:
    """Return the relative standard deviation of every quantity by speed and knowledge of the arm."""
    columns = result.precision
    rows = [
        [heading, *(format_percent(float(column[index]), 2) for column in columns.values())]
        for index, heading in enumerate(HEADINGS)
    ]
    return ["quantity", *columns], rows


def squared_distance(identified: Identification) -> float:
    """Return the squared distance of the truth from the posterior's mean, in the posterior's metric."""
    body = identified.bodies[BASE]
    miss = body.mean - paper.TRUTH
    return float(miss @ np.linalg.solve(np.cov(body.values.T), miss))


def sampler_sentence(name: str, identified: Identification) -> str:
    """Return how the sampler did."""
    chains = identified.chains
    return (
        f"Arm {name}: {identified.posterior.size} unknowns, {chains.effective_samples:.0f} effective samples from "
        f"{chains.evaluations} evaluations, R-hat {chains.r_hat:.4f}, {'' if chains.converged else 'not '}converged; "
        f"chi² is {identified.optimum.chi2:.0f} for {identified.posterior.samples} samples. "
        + (" ".join(identified.disagreements) or "Mode, importance sampling and ensembles agree.")
    )


def estimates(result: BaseBody) -> Iterator[tuple[object, ...]]:
    """Yield the rows of all estimates without noise, the paper's included: case, quantity, truth, estimate, error."""
    found = {"paper, well": paper.RESULT_WELL, "paper, poor": paper.RESULT_POOR}
    found |= {name: case.estimate for name, case in result.noise_free.items()}
    for name, values in found.items():
        for key, truth, value in zip(BODY_QUANTITIES, paper.TRUTH, values, strict=True):
            yield name, key, truth, value, value / truth - 1.0


def grades(result: BaseBody) -> Iterator[tuple[object, ...]]:
    """Yield the rows of the accelerometers' grades: what is known, noise [m/s2], quantity, relative deviation."""
    for name, widths in result.grades.items():
        for grade, row in zip(GRADES, widths, strict=True):
            for key, value in zip(BODY_QUANTITIES, row, strict=True):
                yield f"arm {name}", grade, key, value


def readings(result: BaseBody) -> Iterator[tuple[object, ...]]:
    """Yield the rows of what every unit would mean that the paper's sigmas may have."""
    for item in result.readings:
        yield item.sigma, item.unit, item.fraction, item.mass, item.moment, item.manoeuvres
