"""Every number by which a diagnosis decides something, except the prior of causes and their bounds.

Numbers that only set how finely something is computed, such as nodes, steps and tolerances, are next to their code.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

__all__ = ["DEFAULT_SETTINGS", "FULL", "DiagnosisSettings"]

FULL = 6
"""Recordings up to which every course and instant of what nobody listed is weighed in each of them, and every one of
them is drawn; with more, the work on one recording is bounded."""


@dataclass(frozen=True)
class DiagnosisSettings:
    """Thresholds of a diagnosis.

    Attributes
    ----------
    alarm_level : float
        Probability of an alarm if the model lacks nothing, over all candidates and tests of the noise together. Of a
        hundred studies that lack nothing, one is not called adequate.
    named_from : float
        Probability of its class from which a cause is named without rivals. With the prior of 0.1 for one cause, at
        most one study in 73 that lacks nothing names one (`CausePrior`).
    covered : float
        Total probability of the alternatives of an ambiguous verdict.
    most_alternatives : int
        Largest number of alternatives that are named; if more are needed, none is, since a longer list decides nothing.
    most_beside_unnamed : int
        Largest number of causes that are named if an unnamed cause is at work: more of them occur if several causes of
        the catalogue imitate one effect from outside.
    unknown_from : float
        Probability of a generic candidate above which it is present: the majority.
    remainder_from : float
        Probability of a generic candidate from which the named causes explain the data only partly: the complement of
        `named_from`.
    visible_information : float
        Information on amplitudes at the bound of their scale, in the most visible direction, from which the data reveal
        a difference between two causes: one, at which posterior and prior are equally wide.
    suspect_p_value : float
        Local p-value of a test of the noise below which the fault is weighed as a cause. It is larger than that of the
        alarm, since the evidence of the fault is computed and penalised in any case.
    fault_far_behind : float
        Nats by which the sets with a fault may be expected to fall behind the best explanation and still be weighed;
        beyond, they have less than 1 part in 20,000 of its probability.
    fault_estimate_far_behind : float
        Nats by which the first estimate of a fault, before it is refined, may be behind the best explanation.
    fault_alone_far_behind : float
        Nats by which a refined fault without causes may be behind it.
    outlying : float
        Whitened residual from which a sample counts as an outlier [standard deviations]; noise has one in 150,000.
    event_level : float
        Probability of as many coincident outliers by chance below which they are an event and not a fault of the noise.
    matters : float
        Probability from which a set is re-evaluated under other ranges of the scales: a third of a per cent.
    agrees : float
        Difference between the cost of a fit and its linear prediction below which the linear evidence is valid [nats].
    most_linearisations : int
        Largest number of linearisations about the best set; the third hardly changes anything.
    cannot_be_left_out : float
        Log evidence of a cause added to the others of a fit from which no linear model can omit it [nats]: that of ten
        standard deviations.
    not_linear : float
        Share of the log evidence of the largest cause of such a fit that the linear model may get wrong: a tenth of a
        per cent, the square of changes of three per cent.
    plausible : float
        Probability from which a vibration is tuned and fitted, and the instants of a jump are searched for.
    vibration_far_behind : float
        Nats behind the best vibration from which the fit of another is not completed.
    restart_from : float
        Difference from the predicted cost beyond which a fit in amplitudes is restarted from the prior's centre [nats].
    fitted_in_full_from : float
        Probability from which a set is fitted in full and judged by its residual.
    most_full_fits : int
        Largest number of sets that are fitted in full, the most probable first.
    bodies_improbable : float
        Prior probability of bodies as far from their centre as in a fit, below which they compensate for something that
        the model lacks.
    misfit : float
        Chi-square per sample below which a fit follows the data, regardless of its bodies.
    frame_advantage : float
        Advantage in twice the log likelihood that names the axes in which the direction of a disturbance is fixed.
    frame_share : float
        Share of what three free axes explain that one fixed direction must explain to be named.
    weak_power : float
        Power below which a candidate could hardly have been detected.
    trusted_from : float
        Probability that nothing is lacking from which a loop trusts its model in spite of an alarm.
    """

    alarm_level: float = 0.01
    named_from: float = 0.9
    covered: float = 0.95
    most_alternatives: int = 4
    most_beside_unnamed: int = 2
    unknown_from: float = 0.5
    remainder_from: float = 0.1
    visible_information: float = 1.0
    suspect_p_value: float = 1e-3
    fault_far_behind: float = 10.0
    fault_estimate_far_behind: float = 60.0
    fault_alone_far_behind: float = 20.0
    outlying: float = 4.5
    event_level: float = 1e-3
    matters: float = 3e-3
    agrees: float = 0.5
    most_linearisations: int = 3
    cannot_be_left_out: float = 50.0
    not_linear: float = 1e-3
    plausible: float = 0.01
    vibration_far_behind: float = 40.0
    restart_from: float = 20.0
    fitted_in_full_from: float = 0.05
    most_full_fits: int = 4
    bodies_improbable: float = 1e-6
    misfit: float = 4.0
    frame_advantage: float = 6.0
    frame_share: float = 0.6
    weak_power: float = 0.5
    trusted_from: float = 0.05

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            top = 1.0 if name in _PROBABILITIES else np.inf
            if not 0.0 < value < top:
                raise ValueError(f"{name} must be positive and below {top:g}, received {value}")


_PROBABILITIES = {
    "alarm_level",
    "named_from",
    "covered",
    "unknown_from",
    "remainder_from",
    "suspect_p_value",
    "event_level",
    "matters",
    "plausible",
    "fitted_in_full_from",
    "bodies_improbable",
    "frame_share",
    "weak_power",
    "trusted_from",
}

DEFAULT_SETTINGS = DiagnosisSettings()
