"""The pairs of causes that act alike, what is hidden of each in MuJoCo, and how large it is."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from bayesid import Effect, Robot
from bayesid._math.arrays import Floats
from bayesid._math.double_precision import in_double_precision
from bayesid.robot.inertial_parameters import InertialParameters
from bayesid.robot.log_cholesky import log_cholesky_vector, vector_from_factor
from bayesid.simulation.effects import LinkInertia, MagneticDipole, Payload, ThrusterLeak, ThrusterPulses, WheelMomentum
from studies.common.flight import ORBIT, light_wheel
from studies.truth.mujoco import leak, magnet, pulses

__all__ = ["PAIRS", "Cause", "Pair"]

Hidden = tuple[Robot, dict[str, Any]]  # the robot as it truly is, and what else moves it (`studies.common.flight.fly`)

PERIOD, PULSE, FIRST = 20.0, 4.0, 7.0  # train of pulses: from one to the next, length, and beginning of the first [s]
HAND, LINK = "link6", "link3"  # links with the payload and with the error
INCLINATION = 0.611  # of the orbit of ETS-VII, 35 degrees [rad]; only the magnetic field depends on it


@dataclass(frozen=True)
class Cause:
    """A cause to hide."""

    effect: Effect  # with which it is fitted
    name: str  # in reports
    words: str  # what is hidden, with its size
    amplitudes: Floats  # (k,): amplitudes of the effect in SI units
    turned: Callable[[np.random.Generator], Floats]  # amplitudes of the same size in a random direction, (k,)
    hide: Callable[[Floats, Robot], Hidden]  # amplitudes and the robot without it -> what flies
    # amplitudes, (n, k) -> those whose effect of first order is the whole effect of the given ones
    linear: Callable[[Floats], Floats] = lambda amplitudes: amplitudes

    @property
    def label(self) -> str:
        """Label of the effect."""
        return self.effect.label


@dataclass(frozen=True)
class Pair:
    """Two causes that act alike."""

    name: str
    causes: tuple[Cause, Cause]

    @property
    def labels(self) -> tuple[str, str]:
        """Labels of both."""
        first, second = self.causes
        return first.label, second.label

    def cause(self, label: str) -> Cause:
        """Return one of them by its label."""
        return next(cause for cause in self.causes if cause.label == label)


def _direction(rng: np.random.Generator, count: int = 3) -> Floats:
    vector = rng.normal(size=count)
    return np.asarray(vector / np.linalg.norm(vector))


def _vector(
    effect: Effect, name: str, words: str, vector: tuple[float, float, float], hide: Callable[[Floats], dict[str, Any]]
) -> Cause:
    """Return a cause whose last three amplitudes are a vector, any others zero, such as the force of a leak."""
    given = np.array(vector)
    before = len(effect.parameters) - 3
    return Cause(
        effect,
        name,
        words,
        np.pad(given, (before, 0)),
        lambda rng: np.pad(np.linalg.norm(given) * _direction(rng), (before, 0)),
        lambda amplitudes, robot: (robot, hide(amplitudes[before:])),
    )


def _body(mass: float, place: Floats) -> Floats:
    """Return the ten moments of a compact body about the origin of its link."""
    return InertialParameters(mass, place, 0.01 * mass * np.eye(3)).vector


def _with_moments(amplitudes: Floats, robot: Robot) -> Hidden:
    vector = robot.link(HAND).inertial.vector + amplitudes
    return robot.with_inertial(HAND, InertialParameters.from_vector(vector)), {}


@in_double_precision
def _with_error(amplitudes: Floats, robot: Robot) -> Hidden:
    vector = np.asarray(log_cholesky_vector(robot.link(LINK).inertial, jnp.asarray(amplitudes)))
    return robot.with_inertial(LINK, InertialParameters.from_vector(vector)), {}


@in_double_precision
def _first_order(coordinates: Floats) -> Floats:
    """Return log-Cholesky coordinates that to first order change a body's moments by what the given ones do, (n, 10).

    The change of the pseudo-inertia is linear in its value for a body whose factor is one, so the answer holds for all.
    """
    moments = partial(vector_from_factor, jnp.eye(4))
    none = jnp.zeros(coordinates.shape[-1])
    changes = jax.vmap(moments)(jnp.asarray(coordinates)) - moments(none)
    return np.asarray(jnp.linalg.solve(jax.jacfwd(moments)(none), changes.T).T)


WHEEL = _vector(
    WheelMomentum(), "wheel momentum", "wheels with −0.6, 0.35, 0.7 N m s", (-0.6, 0.35, 0.7),
    lambda vector: {"rotor": light_wheel(vector)},
)  # fmt: skip
LEAK = _vector(
    ThrusterLeak(), "leak", "leak of −0.3, 0.18, 0.36 mN m", (-3e-4, 1.8e-4, 3.6e-4),
    lambda vector: {"fields": [leak((0.0, 0.0, 0.0), vector)]},
)  # fmt: skip
PULSES = _vector(
    ThrusterPulses(f"{PERIOD},{PULSE},0,{FIRST}"), "pulses",
    f"pulses of −1.5, 0.9, 1.8 mN m for {PULSE:g} s every {PERIOD:g} s", (-1.5e-3, 9e-4, 1.8e-3),
    lambda vector: {"fields": [pulses(vector, every=PERIOD, length=PULSE, start=FIRST)]},
)  # fmt: skip
DIPOLE = _vector(
    MagneticDipole(), "dipole", "dipole of −9, 5, 11 A m²", (-9.0, 5.0, 11.0),
    lambda vector: {"fields": [magnet(replace(ORBIT, inclination=INCLINATION), vector)]},
)  # fmt: skip
PAYLOAD = Cause(
    Payload(HAND), "payload", "payload of 5 kg at 0.3 m from the origin of the hand",
    _body(5.0, np.array([0.0, 0.0, 0.3])), lambda rng: _body(5.0, 0.3 * _direction(rng)), _with_moments,
)  # fmt: skip
ERROR = Cause(
    LinkInertia(LINK), "link error", "link 3 with an error of 0.1 in a coordinate of its inertia",
    0.1 * np.eye(10)[0], lambda rng: 0.1 * _direction(rng, 10), _with_error, _first_order,
)  # fmt: skip

PAIRS: Mapping[str, Pair] = {
    pair.name: pair
    for pair in (
        Pair("wheel and leak", (WHEEL, LEAK)),
        Pair("leak and pulses", (LEAK, PULSES)),
        Pair("wheel and dipole", (WHEEL, DIPOLE)),
        Pair("payload and link error", (PAYLOAD, ERROR)),
    )
}
"""All pairs by their names; a quick run takes the first."""
