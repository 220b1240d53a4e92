"""Which effects of the catalogue could be at work in a study, and where."""

from __future__ import annotations

from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.register import known_effects
from bayesid.simulation.effects.wheel_history import WheelHistory
from bayesid.simulation.model import Model
from bayesid.simulation.own_effects import check_own_effect

__all__ = ["candidates"]


def candidates(
    model: Model, *, knows_latitude: bool = True, records_wheels: bool = False, longest: float | None = None
) -> list[Effect]:
    """Return every effect that the model does not have and that could exist in its situation.

    Where an effect could exist its class states (`Effect.instances`).

    Parameters
    ----------
    model : Model
    knows_latitude : bool
        Whether the recordings say where on the orbit they were made.
    records_wheels : bool
        Whether the momentum of the wheels is recorded, so that none runs unseen.
    longest : float, optional
        Length of the longest recording [s], over which the history of a wheel is resolved.

    Raises
    ------
    InputError
        If a hook of an effect of the user's own breaks its contract.
    """
    present = {effect.label for effect in model.effects}
    found = [
        (_over(effect, longest) if isinstance(effect, WheelHistory) else effect).attach(model.robot)
        for kind in known_effects().values()
        if (knows_latitude or not kind.uses_latitude(model.orbit)) and not (records_wheels and kind is WheelHistory)
        for effect in kind.instances(model)
        if effect.label not in present
    ]
    for effect in found:
        check_own_effect(effect, model.robot, model.sensors)
    return found


def _over(effect: WheelHistory, longest: float | None) -> WheelHistory:
    return effect if longest is None else WheelHistory(effect.place, longest)
