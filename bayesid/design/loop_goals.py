"""What a loop is to reach, and the review of what it has flown."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from bayesid._io.errors import InputError
from bayesid.design.base_prediction import predict
from bayesid.design.knowledge_update import worst_relative_sd
from bayesid.inference.body_quantities import BODY_QUANTITIES, BodyDraws
from bayesid.simulation.model import Manoeuvre, Model

__all__ = [
    "CauseProbability",
    "Goal",
    "QuantitySd",
    "RelativePrecision",
    "Review",
    "Reviewer",
    "StepKnowledge",
    "TipRegion",
    "goal_dict",
]

DRAWS = 300  # number of draws of what is known from which the region of the end-effector is computed


@dataclass(frozen=True)
class StepKnowledge:
    """What a loop knows after a step."""

    model: Model  #: model whose prior is the posterior after the step
    bodies: Mapping[str, BodyDraws]  #: draws of the quantities of the bodies to identify
    flown: Manoeuvre  #: manoeuvre of the step
    #: probability that a cause of the catalogue, or ``"unknown"``, is at work in what was recorded so far; empty where
    #: the recordings are not diagnosed
    causes: Mapping[str, float]
    seed: int  #: seed of the random numbers that a goal needs


class Goal(Protocol):
    """Goal of a loop.

    Attributes
    ----------
    text, unit : str
        What is measured, as it is printed, and the unit of its value.
    target : float
        Value to be reached.
    diagnosed : bool
        Whether the recordings must be diagnosed to know the value.
    """

    @property
    def text(self) -> str: ...  # noqa: D102

    @property
    def unit(self) -> str: ...  # noqa: D102

    @property
    def target(self) -> float: ...  # noqa: D102

    @property
    def diagnosed(self) -> bool: ...  # noqa: D102

    def value(self, knowledge: StepKnowledge) -> float:
        """Return the value after a step."""
        ...

    def reached(self, value: float) -> bool:
        """Return whether a value suffices."""
        ...


class _Smaller:
    """Goal that is reached where its value is small enough."""

    diagnosed = False
    target: float

    def reached(self, value: float) -> bool:
        """Return whether a value is at most the target."""
        return bool(value <= self.target)


@dataclass(frozen=True)
class RelativePrecision(_Smaller):
    """Relative standard deviation of the draws of the bodies, by default the worst of mass and principal moments.

    Parameters
    ----------
    target : float
    measure : callable
        Function of the draws of the bodies to identify, by name.
    """

    target: float = 0.01
    measure: Callable[[Mapping[str, BodyDraws]], float] = worst_relative_sd
    text = "worst relative sd of mass and principal moments"
    unit = "1"

    def value(self, knowledge: StepKnowledge) -> float:
        """Return the measure of the bodies."""
        return float(self.measure(knowledge.bodies))


@dataclass(frozen=True)
class QuantitySd(_Smaller):
    """Standard deviation of one quantity of a body.

    Parameters
    ----------
    body : str
        Name of the link or load.
    quantity : str
        One of `BODY_QUANTITIES`.
    target : float
        In the quantity's unit.
    """

    body: str
    quantity: str
    target: float

    def __post_init__(self) -> None:
        if self.quantity not in BODY_QUANTITIES:
            problem = f"{self.quantity!r} is not a quantity of a body"
            raise InputError(problem, place="required sd", remedy=f"Name one of {', '.join(BODY_QUANTITIES)}")
        if not 0.0 < self.target < np.inf:
            raise InputError(f"{self.target:g} is not a valid sd", place="required sd", remedy="Give a positive number")

    @property
    def text(self) -> str:
        """What is measured."""
        return f"sd of {self.body}.{self.quantity}"

    @property
    def unit(self) -> str:
        """Unit of the quantity."""
        return BODY_QUANTITIES[self.quantity]

    def value(self, knowledge: StepKnowledge) -> float:
        """Return the standard deviation of the draws."""
        if self.body not in knowledge.bodies:
            problem = f"{self.body!r} is not a body to identify"
            raise InputError(problem, place="required sd", remedy=f"Name one of {', '.join(knowledge.bodies)}")
        return float(knowledge.bodies[self.body].sd[list(BODY_QUANTITIES).index(self.quantity)])


@dataclass(frozen=True)
class TipRegion(_Smaller):
    """Longest semi-axis of the 95 % region of the end-effector at the end of the last manoeuvre, if repeated.

    Parameters
    ----------
    target : float
        [m]
    frame : str, optional
        Frame of the end-effector in the URDF, by default the last link.
    """

    target: float
    frame: str | None = None
    text = "longest semi-axis of the 95 % region of the end-effector at the end of the last manoeuvre"
    unit = "m"

    def value(self, knowledge: StepKnowledge) -> float:
        """Return the semi-axis from draws of what is known."""
        rng = np.random.default_rng(knowledge.seed)
        prediction = predict(knowledge.model, knowledge.flown, rng, draws=DRAWS, tip_frame=self.frame)
        return float(np.max(prediction.tip.pose().millimetres.semi_axes)) * 1e-3


@dataclass(frozen=True)
class CauseProbability:
    """Probability that a cause is at work, which is to be decided: near one, or as near zero.

    Parameters
    ----------
    cause : str
        Label of an effect of the catalogue, or ``"unknown"``.
    target : float
        Probability above which the cause is taken to be present; below one minus it, absent.
    """

    cause: str
    target: float = 0.95
    unit = "1"
    diagnosed = True

    def __post_init__(self) -> None:
        if not 0.5 < self.target < 1.0:
            raise InputError(
                f"{self.target:g} is not a decisive probability", place="requested cause", remedy="Give 0.9 to 0.99"
            )

    @property
    def text(self) -> str:
        """What is measured."""
        return f"probability of {self.cause}"

    def value(self, knowledge: StepKnowledge) -> float:
        """Return the probability."""
        if self.cause not in knowledge.causes:
            problem = f"{self.cause!r} is not a candidate of the diagnosis"
            raise InputError(
                problem, place="requested cause", remedy=f"Name one of {', '.join(sorted(knowledge.causes))}"
            )
        return knowledge.causes[self.cause]

    def reached(self, value: float) -> bool:
        """Return whether the cause is decided, either way."""
        return max(value, 1.0 - value) >= self.target


def goal_dict(goal: Goal, value: float) -> dict[str, Any]:
    """Return the entry of a goal in loop.json.

    Parameters
    ----------
    goal : Goal
    value : float
        Value reached, in the goal's unit.
    """
    return {"goal": goal.text, "value": value, "wanted": goal.target, "unit": goal.unit, "reached": goal.reached(value)}


@dataclass(frozen=True)
class Review:
    """What the recordings so far say of the model."""

    status: str  #: status of the verdict, such as ``adequate`` or ``explained``
    causes: tuple[str, ...]  #: causes that the verdict names
    trusted: bool  #: whether the model may be right, so that it makes sense to identify it further
    probabilities: Mapping[str, float]  #: probability of every cause of the catalogue, and of ``"unknown"``
    remainder: str = "none"  #: whether something unnamed acts beside the causes: ``none``, ``undecided``, ``present``

    def to_dict(self) -> dict[str, Any]:
        """Return the entry of loop.json."""
        return {
            "status": self.status,
            "causes": list(self.causes),
            "remainder": self.remainder,
            "trusted": self.trusted,
            "probabilities": dict(self.probabilities),
        }


class Reviewer(Protocol):
    """Method by which the recordings of a loop are reviewed."""

    def review(self, model: Model, manoeuvres: Sequence[Manoeuvre], seed: int, file: Path) -> Review:
        """Write what was found to a JSON file, and return its summary.

        Parameters
        ----------
        model : Model
            The loop's model with its first prior.
        manoeuvres : sequence of Manoeuvre
            All manoeuvres flown so far.
        seed : int
            Seed of all random numbers.
        file : Path
        """
        ...
