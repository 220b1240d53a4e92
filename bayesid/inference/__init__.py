"""Inference: the posterior density, its mode, Laplace approximation, evidence and samples."""

from bayesid.inference.ensemble import Chains, LaplaceMove, sample
from bayesid.inference.identification import Identification, identify
from bayesid.inference.importance import Evidence, choose_parameterisation, importance_sample
from bayesid.inference.mode import Optimum, maximise
from bayesid.inference.parameterisation import LinearParameterisation, LogCholeskyParameterisation, Parameterisation

__all__ = [
    "Chains",
    "Evidence",
    "Identification",
    "LaplaceMove",
    "LinearParameterisation",
    "LogCholeskyParameterisation",
    "Optimum",
    "Parameterisation",
    "choose_parameterisation",
    "identify",
    "importance_sample",
    "maximise",
    "sample",
]
