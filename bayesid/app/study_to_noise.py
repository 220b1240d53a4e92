"""Faults of the noise that a study states under ``[model.noise]``, as a diagnosis names them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from bayesid._io.errors import InputError
from bayesid.app.schema import Study
from bayesid.diagnosis.noise import NoiseFault, noise_faults
from bayesid.simulation.model import Manoeuvre, Model

__all__ = ["with_stated_noise", "without_stated_faults"]

Size = float | Sequence[float]


def with_stated_noise(study: Study, model: Model) -> Model:
    """Return the model of a study with the faults of the noise that the study states.

    Parameters
    ----------
    study : Study
    model : Model

    Raises
    ------
    InputError
        If there is no such fault, or its quantities are others.
    """
    known = noise_faults([sensor.kind for sensor in model.sensors])
    for label, given in study.model.noise.items():
        place = f"model.noise.{label}"
        if label not in known:
            remedy = f"Choose from {', '.join(known)}"
            raise InputError(f"unknown noise fault {label!r}", place=place, remedy=remedy)
        try:
            model = known[label].in_model(model, _sizes(known[label], given))
        except InputError as error:
            raise error.within(place=place) from None
        except ValueError:
            remedy = "Give a number, or one for each axis if the quantity applies to the axes of a sensor"
            raise InputError(f"got {dict(given)}", place=place, remedy=remedy) from None
    return model


def without_stated_faults(study: Study, model: Model, manoeuvres: Sequence[Manoeuvre]) -> list[Manoeuvre]:
    """Return recordings treated as the stated faults ask: outliers left out, joints smoothed with their noise.

    Parameters
    ----------
    study : Study
    model : Model
        With the faults (`with_stated_noise`).
    manoeuvres : sequence of Manoeuvre
    """
    known = noise_faults([sensor.kind for sensor in model.sensors])
    # outliers last: they stand out from a fit with all else as stated
    for label, given in sorted(study.model.noise.items(), key=lambda fault: known[fault[0]].in_residual):
        manoeuvres = known[label].in_data(model, manoeuvres, _sizes(known[label], given))
    return list(manoeuvres)


def _sizes(fault: NoiseFault, given: Mapping[str, Size]) -> list[Size]:
    """Return the values of a fault's quantities, in their order."""
    keys = [quantity.name for quantity in fault.quantities]
    if set(keys) != set(given):
        text = f"got {', '.join(given) or 'nothing'}"
        raise InputError(text, remedy=f"Give {' and '.join(keys)}")
    return [given[key] for key in keys]
