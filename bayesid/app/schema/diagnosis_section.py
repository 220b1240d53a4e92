"""Section of a study file on the prior of a diagnosis."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated

from pydantic import Field

from bayesid.app.schema.value_types import Name, Number, Positive, Section

Probability = Annotated[Number, Field(gt=0.0, lt=1.0)]


class DiagnosisSection(Section):
    """Section ``[diagnosis]``, what is believed of causes before the recordings are seen.

    Parameters
    ----------
    one_more_cause : float
        Probability that one more cause is at work, however many there are.
    outside_catalogue : float
        Probability that something is at work that the catalogue does not name.
    bounds : table of label to table of unit to float
        Largest plausible sizes that are known better than the defaults, by the label of the effect and the unit of its
        amplitudes.
    """

    one_more_cause: Probability = 0.1
    outside_catalogue: Probability = 0.1
    bounds: Mapping[Name, Mapping[Name, Positive]] = Field(default_factory=dict)
