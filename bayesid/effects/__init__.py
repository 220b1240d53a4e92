"""Effects a model can carry; see `bayesid.effects.base.Effect` for writing one's own."""

from bayesid.effects.base import Effect, Moment, Parameter, Readings, Wrench, create, register
from bayesid.effects.environment import GravityGradient
from bayesid.effects.internal import WheelMomentum
from bayesid.effects.sensor import AccelBias, RateBias

__all__ = [
    "AccelBias",
    "Effect",
    "GravityGradient",
    "Moment",
    "Parameter",
    "RateBias",
    "Readings",
    "WheelMomentum",
    "Wrench",
    "create",
    "register",
]
