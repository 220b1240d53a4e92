"""Which effects of the catalogue could be at work in a study, and where."""

from __future__ import annotations

import inspect

from bayesid._io.errors import InputError
from bayesid.diagnosis.candidates.catalogue_signatures import MOMENT_UNITS
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.internal_effects import FlexibleAppendage, FuelSlosh
from bayesid.simulation.effects.mass_shift import MassShift
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
        If an effect of the user's own breaks the contract of a hook, or has no amplitudes that could be weighed.
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
        _check_candidate(effect)
    return found


def _check_candidate(effect: Effect) -> None:
    """Refuse an effect of the user's own that is not linear in amplitudes, which a diagnosis could not weigh."""
    if type(effect).__module__.partition(".")[0] == __name__.partition(".")[0]:
        return
    if effect.modes_count:
        if isinstance(effect, (FlexibleAppendage, FuelSlosh)):
            return
        problem = "a vibration of one's own has no bounds by which it could be weighed"
        remedy = "Derive it from FlexibleAppendage or FuelSlosh"
    else:
        shapes = [parameter.name for parameter in effect.in_amplitudes().parameters if not parameter.is_amplitude]
        if not shapes or isinstance(effect, MassShift) or effect.amplitude_units == MOMENT_UNITS:
            return
        problem = f"it is not linear in {', '.join(shapes)}, whose prior is not a normal distribution about zero"
        remedy = "Override in_amplitudes and amplitudes by a form with amplitudes alone"
    raise InputError(
        problem,
        file=inspect.getsourcefile(type(effect)),
        place=f"effect {effect.label!r}",
        remedy=f"{remedy}, or let instances return none, so that it is no candidate",
    )


def _over(effect: WheelHistory, longest: float | None) -> WheelHistory:
    return effect if longest is None else WheelHistory(effect.place, longest)
