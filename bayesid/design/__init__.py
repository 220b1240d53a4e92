"""Design of the excitation: manoeuvres chosen by the posterior they lead to, within the limits of the robot.

Data flows one way: `parameterisation` -> `planned` (what the robot does, what its sensors tell) -> `criteria` and
`limits` -> `problem` (compiled, with gradients) -> `optimise` -> `design` (with the posterior each leads to).
"""

from bayesid.design.criteria import (
    AOptimal,
    ConditionNumber,
    Criterion,
    DOptimal,
    EOptimal,
    InformationGain,
    Paper26,
    Paper26Intended,
    Separation,
)
from bayesid.design.design import Design, best_design, design, evaluate
from bayesid.design.limits import Limit, Limits
from bayesid.design.optimise import Found, Search, optimise
from bayesid.design.parameterisation import BSplines, Fourier, Linear, PaperExcitation, Parameterisation
from bayesid.design.planned import Plan, Tip
from bayesid.design.predicted import Predicted, planned_manoeuvre, predict_posterior
from bayesid.design.problem import Problem
from bayesid.design.store import Store

__all__ = [
    "AOptimal",
    "BSplines",
    "ConditionNumber",
    "Criterion",
    "DOptimal",
    "Design",
    "EOptimal",
    "Found",
    "Fourier",
    "InformationGain",
    "Limit",
    "Limits",
    "Linear",
    "Paper26",
    "Paper26Intended",
    "PaperExcitation",
    "Parameterisation",
    "Plan",
    "Predicted",
    "Problem",
    "Search",
    "Separation",
    "Store",
    "Tip",
    "best_design",
    "design",
    "evaluate",
    "optimise",
    "planned_manoeuvre",
    "predict_posterior",
]
