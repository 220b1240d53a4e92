"""Trial of an effect that does not belong to the package, so that a mistake in it is named before a simulation.

Every hook that it overrides is called once, traced as in a simulation, at one instant of a moving robot.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from bayesid._io.errors import InputError
from bayesid._math.double_precision import in_double_precision
from bayesid.recording.joint_motion import Excitation
from bayesid.robot.robot import Robot
from bayesid.simulation.dynamics import composite
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.instant import Environment, Instant, Modes, Readings, Wrench
from bayesid.simulation.sensors import Sensor
from bayesid.simulation.simulator import EffectKey
from bayesid.simulation.time_grid import time_tables

__all__ = ["check_own_effect"]

PACKAGE = __name__.partition(".")[0]

TIMES = np.linspace(0.0, 8.0, 17)
"""Times of the tables and readings of the trial [s]."""

TYPICAL = 0.1
"""Coordinates of standard-normal prior at which the hooks are called: neither zero nor far away."""

_PASSED: set[tuple[object, ...]] = set()
"""What has been tried, so that a search that builds many models of one effect tries it once."""


@in_double_precision
def check_own_effect(effect: Effect, robot: Robot, sensors: Sequence[Sensor]) -> None:
    """Call the hooks of an effect of the user's own, once for each robot; those of the package are tested with it.

    Parameters
    ----------
    effect : Effect
        Effect as it enters from a study, a plugin or a program.
    robot : Robot
    sensors : sequence of Sensor
        Sensors whose readings the effect may change.

    Raises
    ------
    InputError
        If a hook fails, returns another shape than its contract says, or numbers that are not finite; the message
        names the effect's file, the effect and the hook.
    """
    if type(effect).__module__.partition(".")[0] == PACKAGE:
        return
    trial = (EffectKey(effect), robot.name, len(robot.joints), tuple(sensor.kind for sensor in sensors))
    if trial in _PASSED:
        return
    for hook, call, expected in _trials(effect, robot, sensors):
        if not effect.uses(hook):
            continue
        try:
            result = call()
        except Exception as error:
            message = str(error).partition("\n")[0]
            raise _fault(effect, hook, f"it fails: {type(error).__name__}: {message}") from error
        shapes = jax.tree.map(np.shape, result)
        if expected is not None and shapes != expected:
            raise _fault(effect, hook, f"it returns the shape {shapes} instead of {expected}")
        if not all(np.isfinite(np.asarray(leaf)).all() for leaf in jax.tree.leaves(result)):
            raise _fault(effect, hook, "it returns numbers that are not finite")
    _PASSED.add(trial)


def _fault(effect: Effect, hook: str, problem: str) -> InputError:
    return InputError(
        problem,
        file=inspect.getsourcefile(type(effect)),
        place=f"effect {effect.label!r}: {hook}",
        remedy=f"Correct the effect; help(bayesid.Effect.{hook}) describes its return value",
    )


def _trials(effect: Effect, robot: Robot, sensors: Sequence[Sensor]) -> Iterator[tuple[str, Callable[[], Any], object]]:
    """Yield every physical hook with a call of it and the shapes that it must return, None where any will do."""
    values = jnp.array([parameter.value(jnp.asarray(TYPICAL)) for parameter in effect.parameters])
    zeros = np.zeros(len(robot.joints))
    motion = Excitation(zeros, zeros + TYPICAL, 1.0)
    tables = time_tables(robot, (), (), motion, TIMES)
    instant = _instant(tables.known[-1], tables.environment, len(robot.wheels))
    inner = jnp.full(effect.states, TYPICAL)
    count = effect.modes_count
    readings = _readings(robot, sensors)

    def traced(hook: str, *given: Any) -> Callable[[], Any]:
        return lambda: jax.jit(getattr(effect, hook))(values, *given)

    yield "momentum", traced("momentum", instant, inner), ((3,), (3,))
    yield "wrench", traced("wrench", instant, inner), Wrench((3,), (3,))  # type: ignore[arg-type]
    yield "derivative", traced("derivative", instant, inner), (effect.states,)
    yield "specific_force", traced("specific_force", instant, jnp.ones(3)), (3,)
    yield "gravity_gradient_tensor", traced("gravity_gradient_tensor", instant), (3, 3)
    yield "modes", traced("modes"), Modes((count,), (count,), (count, 3), (count, 3), (count, 3, 3))  # type: ignore[arg-type]
    yield "friction", traced("friction", jnp.full((2, len(zeros)), TYPICAL)), (2, len(zeros))
    yield "read", traced("read", readings), jax.tree.map(np.shape, readings)
    columns = 0
    if effect.uses("table"):
        table = _table(effect, robot, motion)
        columns = table.shape[-1] if np.ndim(table) == 3 else -1
        yield "table", lambda: table, (len(TIMES), tables.known.shape[1], max(columns, 0))
    yield "loads", traced("loads"), (columns,)


def _table(effect: Effect, robot: Robot, motion: Excitation) -> Any:
    try:
        return effect.table(robot, motion, TIMES)
    except Exception as error:
        raise _fault(effect, "table", f"it fails: {type(error).__name__}: {error}") from error


def _instant(row: Any, environment: Environment, wheels: int) -> Instant:
    """Return an instant at which nothing is zero or singular that need not be, with directions in place of an orbit."""
    now = jax.tree.map(lambda leaf: jnp.asarray(leaf[-1]), environment)
    x, y, z = jnp.eye(3)
    spinning = jnp.full((wheels, now.wheels.shape[-1]), TYPICAL)
    now = now._replace(zenith=x, velocity=y, sun=x, north=z, gradient=jnp.asarray(1e-6), wheels=spinning)
    moving = 1e-2 * jnp.array([1.0, -2.0, 1.5])
    return Instant(now, composite(jnp.asarray(row)), jnp.eye(3), moving, moving, moving)


def _readings(robot: Robot, sensors: Sequence[Sensor]) -> Readings:
    channels = {sensor.kind.value: jnp.tile(jnp.array(sensor.kind.rest), (len(TIMES), 1)) for sensor in sensors}
    return Readings(jnp.asarray(TIMES), channels, jnp.zeros((len(TIMES), len(robot.joints))))
