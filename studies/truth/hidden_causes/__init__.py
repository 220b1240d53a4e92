"""Studies with something hidden in their data: every name of the catalogue, pairs, outside effects and nulls.

`CASES` is the catalogue; physical causes are bodies, springs and fields of `studies.truth.mujoco`.
"""

from studies.truth.hidden_causes.case import Case
from studies.truth.hidden_causes.catalogue import CASES
from studies.truth.hidden_causes.sensor_faults import ColouredNoise, EncoderOffset, Outliers, Quantisation, VectorFault

__all__ = ["CASES", "Case", "ColouredNoise", "EncoderOffset", "Outliers", "Quantisation", "VectorFault"]
