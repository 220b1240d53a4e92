"""Sentences of a design report: the outcome, the meaning of each criterion, and the assumptions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from bayesid._io.words import counted, joined, ordinal
from bayesid.design import Design, Separation, expected_probability, noncentrality_for
from bayesid.report.numbers import format_number, format_percent, format_range, format_unit
from bayesid.report.sentences.model_assumptions import planning_sentences

__all__ = [
    "MEANING",
    "assumption_sentences",
    "design_sentences",
    "reference_design",
    "separation_sentence",
    "summary",
]

SURE = 0.95
"""Probability of the right one of two rivals at which they count as told apart."""

REFERENCE = "paper-26"
"""Name of the design that the others are compared with."""

MEANING: Mapping[str, str] = {
    "paper-26": "The paper's (26) as printed, of the largest excursions y1, y2, y3 of the base's position and of its "
    "attitude. The signed differences cancel most of it: of each triple −y1² + y2² + 3 y3² remains to be maximised, "
    "which rewards the third state, penalises the first and says nothing of balance. Metres are added to radians.",
    "paper-26-intended": "What (26) appears to intend: the squares of the excursions less the sizes of their "
    "differences, so that an uneven motion counts against itself whatever the sign.",
    "condition-number": "The smallest condition number of the regressor of the base's force balance, columns per unit "
    "of the prior's width, torques over the radius of gyration.",
    "d-optimal": "The smallest volume of the posterior: the determinant of its covariance.",
    "a-optimal": "The smallest mean variance of the log-Cholesky coordinates of the bodies.",
    "e-optimal": "The smallest standard deviation along the direction that is known worst.",
    "information-gain": "The largest expected gain of information on the bodies, averaged over draws of their prior "
    "instead of taken at its centre.",
    "separation": "The largest expected log Bayes factor between the rival effects, each in the direction of its "
    "amplitudes that shows least, with everything else unknown. Directions that no manoeuvre shows are left out.",
}
"""Meaning of each criterion, by its name."""


def reference_design(designs: Sequence[Design]) -> Design:
    """Return the design that the others are compared with: the one by (26), or the first where there is none."""
    return next((design for design in designs if design.name == REFERENCE), designs[0])


def summary(designs: Sequence[Design], best: Design) -> str:
    """Return which manoeuvre is best and by how much it narrows the posterior."""
    reference, family = reference_design(designs), best.problem.plan.family
    names = joined(body.name for body in best.problem.plan.model.bodies)
    text = (
        f"{counted(len(designs), 'manoeuvre')} of {family.duration:g} s for the robot "
        f"{best.problem.plan.model.robot.name}, of the family {family.name} with {family.size} parameters, "
        f"{'was' if len(designs) == 1 else 'were'} designed to identify {names}. "
        f"The smallest posterior is that of {best.name}"
    )
    if best is reference:
        return f"{text}. {_verdict(best)}"
    ratio = best.predicted.geometric_mean / reference.predicted.geometric_mean
    worst = best.predicted.worst / reference.predicted.worst
    return (
        f"{text}: in the geometric mean its standard deviations are {ratio:.3g} times those of {reference.name}, and "
        f"{worst:.3g} times along the worst direction. {_verdict(best)}"
    )


def design_sentences(designs: Sequence[Design], best: Design) -> list[str]:
    """Return one sentence on each design and one on the best, for the terminal."""
    reference = reference_design(designs)
    scale = reference.predicted.geometric_mean
    lines = []
    for design in designs:
        ratio = design.predicted.geometric_mean / scale
        size = "" if design is reference else f"standard deviations {ratio:.3g} times those of {reference.name}, and "
        kept = "every limit is kept" if design.go else "some limit is not kept"
        lines.append(f"{design.name}: {size}{kept} with 99 % probability under the present uncertainty of the robot.")
    return [*lines, *map(separation_sentence, filter(_separates, designs)), f"Best: {best.name}."]


def _separates(design: Design) -> bool:
    return isinstance(_separation(design), Separation)


def _separation(design: Design) -> Separation | None:
    criteria = (item for item in design.problem.criteria if item.name == design.criterion)
    return next((item for item in criteria if isinstance(item, Separation)), None)


def separation_sentence(design: Design) -> str:
    """Return how well a manoeuvre that was designed to tell effects apart does so, and down to which size."""
    criterion = _separation(design)
    if criterion is None:
        raise ValueError(f"{design.name} was not designed to tell effects apart")
    noncentrality = float(np.exp(-2.0 * design.costs[criterion.name]))
    share = float(np.sqrt(noncentrality_for(SURE) / noncentrality))
    unseen = [f"{count} of {label}" for label, count in criterion.left_out.items()]
    rest = f" Directions of the amplitudes that no manoeuvre shows are left out: {joined(unseen)}." if unseen else ""
    return (
        f"{design.name} tells {joined(criterion.rivals)} apart: of the size of their priors, the least distinct has a "
        f"signal-to-noise ratio of {format_number(float(np.sqrt(noncentrality)))} that no other can imitate. Of two "
        f"causes that are equally probable before, the right one is expected to have a probability of "
        f"{format_number(SURE)} afterwards if its size is {format_percent(share, 2)} of its prior's, and "
        f"{format_number(expected_probability(0.25 * noncentrality_for(SURE)))} if half of that.{rest}"
    )


def assumption_sentences(best: Design) -> list[str]:
    """Return what the design assumes."""
    problem = best.problem
    plan = problem.plan
    sensors = [
        f"Sensor {sensor.kind.value}: white noise of {format_range(sensor.noise.sigma(plan.interval))} "
        f"{format_unit(sensor.kind.unit)} per sample and axis."
        for sensor in plan.model.sensors
    ]
    return [
        "The search compares manoeuvres by the white noise of the sensors and the noise of the encoders at the "
        "start; the predicted standard deviations and covariances below take the encoders along the manoeuvre and "
        "include the filters, and every other unknown is marginalised.",
        "Predictions hold to first order about the prior's centre (Laplace), and include the prior.",
        f"Sampling every {plan.interval:g} s; the search integrates with steps of {format_number(plan.step)} s and "
        f"simulates every {f'{ordinal(plan.thinning)} ' if plan.thinning > 1 else ''}sample. Limits are evaluated "
        "every half step in the search, and eight times more finely at its end.",
        f"Tip speed and tip rate are those of {plan.tip.name}, each the larger of the one relative to the base and the "
        "one relative to inertial space.",
        "The risk is evaluated over draws from the prior of the bodies with the base starting at rest: the initial "
        "rate, which the manoeuvre does not cause, is left out.",
        *sensors,
        *planning_sentences(plan),
    ]


def _verdict(best: Design) -> str:
    if best.go:
        return "It keeps every limit, with 99 % probability also under the present uncertainty of the robot."
    broken = ", ".join(
        f"{risk.name} ({format_number(risk.quantile)} {format_unit(risk.unit)})" for risk in best.risks if not risk.go
    )
    return (
        "It keeps every limit for the robot as given, but under the present uncertainty not with 99 % probability: "
        f"{broken}. It is a no go until the robot is known better or the limits leave more room."
    )
