"""Studies with something hidden in their data: every name of the catalogue, pairs, outside effects and nulls."""

from studies.truth.hidden_causes.catalogue import CASES, Case
from studies.truth.hidden_causes.causes import ColouredNoise, EncoderOffset, Outliers, Quantisation, VectorFault
from studies.truth.hidden_causes.further import FURTHER_CASES, NOW_LISTED, WheelCase

__all__ = [
    "CASES",
    "FURTHER_CASES",
    "NOW_LISTED",
    "Case",
    "ColouredNoise",
    "EncoderOffset",
    "Outliers",
    "Quantisation",
    "VectorFault",
    "WheelCase",
]
