"""A mistake as a hypothesis, and the families of mistakes that are weighed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import ClassVar, TypeVar

from bayesid.inference.conventions.readings_on_grid import ReadingsOnGrid
from bayesid.simulation.model import Model

__all__ = ["Mistake", "MistakeFamily", "convention_families"]


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
        Mistakes are undone in the order of their ranks: units, gravity, then axes and joints.
    undo : callable
        Readings as they would be without the mistake.
    remedy, text : callable
        Remedy and sentence for a recording, given its readings as recorded.
    share : float
        Share of the family's prior probability.
    seen_by : tuple of str
        Parts of the balance that the mistake disturbs; by default all.
    offset : tuple of int, str and float, optional
        Joint, its name and what is added to its angle, where the search may refine it.
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
    offset: tuple[int, str, float] | None = None


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
