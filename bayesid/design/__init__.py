"""Design of the excitation: manoeuvres chosen by the posterior that they would give, within the limits of the robot.

Data flow in one direction: `trajectories` -> `plan` (motion of the robot and information of its sensors) -> `criteria`
and `motion_limits` -> `design_problem` (compiled, with gradients) -> `trajectory_search` -> `design_result` (each
manoeuvre with its predicted posterior). `excitation_loop` plans a manoeuvre, has a spacecraft execute it, identifies
the bodies and plans again from the posterior.
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
    known_criteria,
    named_criteria,
    register_criterion,
)
from bayesid.design.decision_rate import DecisionRate
from bayesid.design.design_problem import Problem
from bayesid.design.design_result import Design, best_design, design, evaluate
from bayesid.design.excitation_loop import Loop, NotFlown
from bayesid.design.knowledge_update import Laplace, Sampled, worst_relative_sd
from bayesid.design.loop_goals import CauseProbability, Goal, QuantitySd, RelativePrecision, TipRegion
from bayesid.design.motion_limits import Limit, Limits
from bayesid.design.plan import Plan
from bayesid.design.predicted_posterior import Predicted, planned_manoeuvre, planned_posterior, predict
from bayesid.design.separation import Separation
from bayesid.design.simulated_spacecraft import PlannedMotion, SimulatedSpacecraft, Spacecraft
from bayesid.design.trajectories import BSplines, Fourier, Linear, PaperExcitation, TrajectoryFamily
from bayesid.design.trajectory_search import THOROUGH, Search, SearchResult, Store, optimise
from bayesid.robot.kinematics import Tip

__all__ = [
    "THOROUGH",
    "AOptimal",
    "BSplines",
    "CauseProbability",
    "ConditionNumber",
    "Criterion",
    "DOptimal",
    "DecisionRate",
    "Design",
    "EOptimal",
    "Fourier",
    "Goal",
    "InformationGain",
    "Laplace",
    "Limit",
    "Limits",
    "Linear",
    "Loop",
    "NotFlown",
    "Paper26",
    "Paper26Intended",
    "PaperExcitation",
    "Plan",
    "PlannedMotion",
    "Predicted",
    "Problem",
    "QuantitySd",
    "RelativePrecision",
    "Sampled",
    "Search",
    "SearchResult",
    "Separation",
    "SimulatedSpacecraft",
    "Spacecraft",
    "Store",
    "Tip",
    "TipRegion",
    "TrajectoryFamily",
    "best_design",
    "design",
    "evaluate",
    "known_criteria",
    "named_criteria",
    "optimise",
    "planned_manoeuvre",
    "planned_posterior",
    "predict",
    "register_criterion",
    "worst_relative_sd",
]
