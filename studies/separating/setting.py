"""The rivals of the study, and the models that hold them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bayesid import Effect, Model
from bayesid._math.arrays import Floats
from bayesid.inference.unknowns import Unknowns
from bayesid.simulation.effects import ThrusterLeak, WheelMomentum
from studies.common import mission
from studies.common.models import ARM_SPREAD

__all__ = ["CANDIDATES", "DRIFT", "RIVALS", "SPREAD", "STAGES", "TRUTHS"]
__all__ += ["amplitude", "drifting", "rival_model", "rival_of"]

# the two causes with the widths of their priors; the leak is a small one, of half a millinewton
CANDIDATES: tuple[Effect, ...] = (WheelMomentum(1.0), ThrusterLeak(5e-4, 5e-4))

# momentum left in the wheels [N m s] and torque of the leak [N m], base axes, of which one is hidden
TRUTHS: dict[str, Floats] = {
    "wheel-momentum": np.array([-0.6, 0.35, 0.7]),
    "thruster-leak": np.array([-3e-4, 1.8e-4, 3.6e-4]),
}

RIVALS = tuple(TRUTHS)  # labels of the two rivals

# stages of the study, with the manoeuvres that are fitted together in each
STAGES = {
    "first alone": ("first",),
    "first, d-optimal": ("first", "d-optimal"),
    "first, separating": ("first", "separation"),
}

SPREAD = 0.1  # relative width of the prior of the base

# rate of the base when a manoeuvre starts, about a degree in a minute [rad/s]; unknown to every fit
DRIFT = np.array([3e-4, -2e-4, 2.5e-4])


def rival_of(label: str) -> str:
    """Return the label of the other rival."""
    return next(other for other in RIVALS if other != label)


def rival_model(labels: Sequence[str], arm_spread: float = ARM_SPREAD) -> Model:
    """Return the mission's model with some of the candidates, given by their labels."""
    model = mission.base_unknown(arm_spread, base_spread=SPREAD)
    return replace(model, effects=(*model.effects, *(effect for effect in CANDIDATES if effect.label in labels)))


def amplitude(label: str) -> Floats:
    """Return the hidden amplitude of a rival in standard deviations of its prior; a leak has no force."""
    effect = next(effect for effect in CANDIDATES if effect.label == label)
    sigma = np.array([parameter.sigma for parameter in effect.parameters])
    return np.pad(TRUTHS[label], (len(sigma) - 3, 0)) / sigma


def drifting(unknowns: Unknowns) -> Floats:
    """Return the coordinates of the prior's centre, but with every manoeuvre starting at the rate `DRIFT`."""
    z = np.zeros(unknowns.size)
    z[unknowns.layout.all_rates] = np.tile(DRIFT / unknowns.rate_sigma, unknowns.recordings)
    return z
