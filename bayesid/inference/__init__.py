"""From a posterior density to its optimum, its Laplace approximation, its evidence and its samples."""

from bayesid.inference.charts import Chart, LinearChart, LogCholeskyChart
from bayesid.inference.ensemble import Chains, LaplaceMove, sample
from bayesid.inference.identification import Identification, identify
from bayesid.inference.importance import Evidence, choose_chart, importance_sample
from bayesid.inference.optimum import Optimum, maximise

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
