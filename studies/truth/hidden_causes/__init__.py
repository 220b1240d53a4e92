"""Studies with something hidden in their data: every name of the catalogue, pairs, outside effects and nulls."""

from studies.truth.hidden_causes.catalogue import CASES, Case
from studies.truth.hidden_causes.causes import ColouredNoise, EncoderOffset, Outliers, Quantisation, VectorFault

__all__ = ["CASES", "Case", "ColouredNoise", "EncoderOffset", "Outliers", "Quantisation", "VectorFault"]
