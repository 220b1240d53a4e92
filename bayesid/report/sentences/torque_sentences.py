"""Sentences on the joint torques of a diagnosis."""

from __future__ import annotations

from bayesid._io.words import joined
from bayesid.diagnosis import Status, TorqueReading, TorquesNotRead
from bayesid.report.numbers import format_fixed, format_p_value, format_quantity, format_unit, relation
from bayesid.report.sentences.set_words import probability_text, set_text

__all__ = ["torque_sentence", "torque_size"]


def torque_sentence(found: TorqueReading | TorquesNotRead) -> str:
    """Return what the joint torques say beside the verdict on the motion, or why they were not read."""
    if isinstance(found, TorquesNotRead):
        return f"The joint torques were not evaluated. {found.reason}"
    before, after = (format_fixed(value, 2) for value in found.chi2_per_sample)
    match found.verdict.status:
        case Status.ADEQUATE:
            return (
                "The joint torques leave nothing but the declared noise "
                f"(p {relation(format_p_value(found.p_value))}, chi-square per sample {before})."
            )
        case Status.EXPLAINED:
            rows = [row for row in found.causes if row.name in found.verdict.causes]
            sizes = joined([f"{row.name} ({torque_size(found, row.name)}, ± sd)" for row in rows])
            return (
                f"The joint torques are explained by {sizes}; chi-square per sample goes from {before} to {after}. "
                "It changes no motion, since that of the joints is measured."
            )
        case Status.AMBIGUOUS:
            others = [found.verdict.causes, *found.verdict.ambiguous_with]
            return f"The joint torques are ambiguous: {'; or '.join(map(set_text, others))}."
        case Status.UNRESOLVED:
            return "The joint torques leave more than noise, and the recordings do not say what."
    return (
        "The joint torques leave something that is neither friction nor a constant error of a sensor "
        f"({probability_text(found.probabilities.unknown)}); chi-square per sample is {before}."
    )


def torque_size(found: TorqueReading, name: str) -> str:
    """Return the amplitudes of one candidate, ± sd."""
    row = next(row for row in found.causes if row.name == name)
    return ", ".join(
        f"{item.name} {format_quantity(mean, sd)} {format_unit(item.unit)}"
        for item, mean, sd in zip(row.quantities, row.mean.tolist(), row.sd.tolist(), strict=True)
    )
