"""A mistake as a hypothesis, and the families of mistakes that are weighed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import reduce
from typing import ClassVar, TypeVar

from bayesid.inference.conventions.readings_on_grid import ReadingsOnGrid
from bayesid.simulation.model import Model

__all__ = ["LEVELS", "Mistake", "MistakeFamily", "convention_families"]

LEVELS = 4
"""Number of levels at which members of continuous families are refined, each finer than the last."""


@dataclass(frozen=True)
class Mistake:
    """One member of a family.

    Attributes
    ----------
    name, channel : str
        As in `Convention`.
    place : str
        What it changes; of two mistakes in one place only one is made.
    rank : int
        Mistakes are undone in the order of their ranks: times, units, gravity, then axes and joints.
    undo : callable
        Readings as they would be without the mistake.
    remedy, text : callable
        Remedy and sentence for a recording, given its readings as recorded.
    share : float
        Share of the family's prior probability.
    seen_by : tuple of str
        Parts of the balance that the mistake disturbs; by default all.
    nearby : callable, optional
        Members near it at a level of refinement from 0 to `LEVELS` - 1, where the family is continuous.
    value : float, optional
        What is wrong by how much, in a continuous family: two members less than one apart are the same mistake.
    parts : tuple of Mistake, optional
        Mistakes that it stands for, made together, in the order in which they are undone.
    effect : bool
        Whether it is no convention but an effect of the catalogue, which is left to a diagnosis where it explains most.
    """

    name: str
    channel: str
    place: str
    rank: int
    undo: Callable[[ReadingsOnGrid], ReadingsOnGrid]
    remedy: Callable[[ReadingsOnGrid], str]
    text: Callable[[ReadingsOnGrid], str]
    share: float
    seen_by: tuple[str, ...] = ()
    nearby: Callable[[int], tuple[Mistake, ...]] = lambda level: ()
    value: float | None = None
    parts: tuple[Mistake, ...] = ()
    effect: bool = False

    @classmethod
    def together(cls, *parts: Mistake) -> Mistake:
        """Return the mistake of making several at once, in the place of the first."""

        def undo(readings: ReadingsOnGrid) -> ReadingsOnGrid:
            return reduce(lambda seen, part: part.undo(seen), parts, readings)

        share = min(part.share for part in parts)
        return replace(parts[0], undo=undo, share=share, parts=parts)

    def is_like(self, other: Mistake) -> bool:
        """Whether another member of the same continuous family says the same."""
        if self.name != other.name or self.value is None or other.value is None:
            return False
        return abs(self.value - other.value) < 1.0


class MistakeFamily:
    """Family of mistakes. To add one, subclass it, define `members`, and apply `MistakeFamily.register`.

    Attributes
    ----------
    title : str
        What the mistakes are about, in the plural.
    prior : float
        Probability that a recording has a mistake of the family.
    """

    title: ClassVar[str]
    prior: ClassVar[float] = 0.02

    _known: ClassVar[list[MistakeFamily]] = []

    @staticmethod
    def register(family: type[F]) -> type[F]:
        """Make a family known; a class decorator."""
        MistakeFamily._known.append(family())
        return family

    def members(self, model: Model, readings: ReadingsOnGrid) -> Iterator[Mistake]:
        """Yield the members that readings of a model could have.

        Parameters
        ----------
        model : Model
        readings : ReadingsOnGrid
            Of the first recording.
        """
        raise NotImplementedError


F = TypeVar("F", bound=MistakeFamily)


def convention_families() -> tuple[MistakeFamily, ...]:
    """Return all registered families."""
    return tuple(MistakeFamily._known)
