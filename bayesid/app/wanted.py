"""What the options of ``bayesid loop`` want to be reached."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from bayesid._io.errors import InputError

if TYPE_CHECKING:
    from bayesid.design.loop_goals import Goal
    from bayesid.simulation.model import Model

__all__ = ["goals_of"]


def goals_of(
    model: Model,
    precision: float | None,
    deviations: Sequence[str],
    region: float | None,
    cause: str | None,
    tip_frame: str | None,
) -> tuple[Goal, ...]:
    """Return the goals of a loop; a relative precision of 1 % where nothing else is wanted.

    Parameters
    ----------
    model : Model
        Model of the loop.
    precision : float or None
        Relative standard deviation of mass and principal moments.
    deviations : sequence of str
        ``BODY.QUANTITY=SD``, in SI units.
    region : float or None
        Longest semi-axis of the end-effector's region [mm].
    cause : str or None
        ``NAME`` or ``NAME=PROBABILITY``.
    tip_frame : str or None
        Frame of the end-effector.

    Raises
    ------
    InputError
        If an option cannot be read, or the model has no such body.
    """
    from bayesid.design.loop_goals import CauseProbability, QuantitySd, RelativePrecision, TipRegion

    goals: list[Goal] = []
    if precision is not None:
        if not 0.0 < precision < 1.0:
            raise InputError(
                f"{precision:g} is not between 0 and 1",
                place="--wanted",
                remedy="Give a relative precision: 0.01 is 1 %",
            )
        goals.append(RelativePrecision(precision))
    for text in deviations:
        name, _, value = text.partition("=")
        bodies = [body.name for body in model.bodies]
        body = next((body for body in bodies if name.startswith(f"{body}.")), None)
        if body is None:
            raise InputError(
                f"{text!r} names no body to identify",
                place="--wanted-sd",
                remedy=f"Write BODY.QUANTITY=SD, with a body among {', '.join(bodies)}: {bodies[0]}.mass=0.5",
            )
        goals.append(QuantitySd(body, name.removeprefix(f"{body}."), _number(value, text, "--wanted-sd")))
    if region is not None:
        if not region > 0.0:
            raise InputError(f"{region:g} mm", place="--wanted-tip", remedy="Give a positive number of millimetres")
        goals.append(TipRegion(1e-3 * region, tip_frame))
    if cause is not None:
        name, sign, value = cause.partition("=")
        goals.append(CauseProbability(name, _number(value, cause, "--wanted-cause") if sign else 0.95))
    return tuple(goals) or (RelativePrecision(),)


def _number(text: str, whole: str, place: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{whole!r} has no number after '='", place=place, remedy="Write NAME=NUMBER") from None
