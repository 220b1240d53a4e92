"""From a posterior density to its optimum, its Laplace approximation, its evidence and its samples."""

from bayesid.inference.ensemble import Chains, LaplaceMove, sample
from bayesid.inference.identification import Identification, identify
from bayesid.inference.importance import Evidence, choose_chart, importance_sample
from bayesid.inference.mode import Optimum, maximise
from bayesid.inference.sampling_coordinates import Chart, LinearChart, LogCholeskyChart

__all__ = [
    "Chains",
    "Chart",
    "Evidence",
    "Identification",
    "LaplaceMove",
    "LinearChart",
    "LogCholeskyChart",
    "Optimum",
    "choose_chart",
    "identify",
    "importance_sample",
    "maximise",
    "sample",
]
