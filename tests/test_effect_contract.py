"""The contract of effects: every hook that an effect overrides, at every place, by itself and in the simulation."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from bayesid._io.errors import InputError
from bayesid.diagnosis.candidates.cause_kind import kind_of
from bayesid.recording.actions import Actions
from bayesid.recording.joint_motion import Motion
from bayesid.recording.recording import Recording
from bayesid.recording.sampled_curve import SampledCurve
from bayesid.recording.wheel_motion import WheelMotion
from bayesid.robot.body_prior import BodyPrior
from bayesid.robot.joint_state import JointState
from bayesid.robot.log_cholesky import relative
from bayesid.robot.robot import Robot
from bayesid.robot.wheel import Wheel
from bayesid.simulation.effects import Effect, Events, Parameter, Readings, Resonance, Wrench, create, known_effects
from bayesid.simulation.instant import Composite, Environment, Instant
from bayesid.simulation.joint_torques import TorqueSensor
from bayesid.simulation.model import Model
from bayesid.simulation.orbit import Orbit
from bayesid.simulation.sensors import Sensor, SensorKind, White
from bayesid.simulation.simulator import ModelConstants, Simulator, Values
from bayesid.simulation.time_grid import build_grid, pad_grids

WHEEL = Wheel("wheel1", (0.0, 0.6, 0.8), 0.5, (0.1, 0.2, -0.3))
ROBOT = Robot.from_urdf(
    Path(__file__).resolve().parents[1] / "bayesid" / "robot" / "models" / "planar.urdf"
).with_wheel(WHEEL)
ORBIT = Orbit(6.9e6, 0.01, inclination=0.9, sun=(0.6, 0.0, 0.8))
SENSORS = (
    Sensor(SensorKind.RATE, White(1e-5)),
    Sensor(SensorKind.ACCEL, White(1e-5), position=(0.1, -0.15, 0.3)),
    Sensor(SensorKind.ATTITUDE, White(1e-5)),
)
UNKNOWN = (BodyPrior("link2", ROBOT.link("link2").inertial, 0.1),)
PLAIN = Model(ROBOT, SENSORS, UNKNOWN, ORBIT)
JOINTS = tuple(joint.name for joint in ROBOT.joints)
WITH_TORQUE = Model(ROBOT, SENSORS, UNKNOWN, ORBIT, torque=TorqueSensor(JOINTS, (0.01,) * len(JOINTS)))


class CreepingWheel(Effect):
    """An effect with states, which no shipped effect has: the momentum of a wheel that runs up."""

    name = "creeping-wheel"
    summary = "A wheel in the base runs up to an unknown momentum."
    states: ClassVar[int] = 3
    parameters = tuple(Parameter(axis, "N m s", 0.1) for axis in "xyz")

    def derivative(self, values, instant, inner):
        return (values - inner) / 3.0

    def momentum(self, values, instant, inner):
        return inner, (values - inner) / 3.0


def places(kind: type[Effect]) -> list[Effect]:
    """The effect wherever it can occur: with torque sensors if it shows in them alone."""
    return [effect.attach(ROBOT) for effect in kind.instances(PLAIN) or kind.instances(WITH_TORQUE)]


# other test files of the process may have registered effects; those are not shipped
KINDS = [kind for kind in known_effects().values() if kind.__module__.startswith("bayesid.")]
EFFECTS = [effect for kind in (*KINDS, CreepingWheel) for effect in places(kind)]
LINEAR = [effect.in_amplitudes() for effect in EFFECTS if effect.in_amplitudes() is not effect]
NAMES = {id(effect): effect.label for effect in EFFECTS} | {id(effect): f"{effect.label}, linear" for effect in LINEAR}


def overridden(kind: type[Effect]) -> list[str]:
    """Names of what a class states or does in place of `Effect`."""
    public = [name for name in vars(Effect) if not name.startswith("_")]
    unwrapped: Callable[[type, str], Any] = lambda owner, name: inspect.getattr_static(owner, name)  # noqa: E731
    return [name for name in public if unwrapped(kind, name) is not unwrapped(Effect, name)]


def typical(effect: Effect, times: float = 0.3) -> jnp.ndarray:
    """Values so many prior standard deviations from the prior's mean."""
    return jnp.array([parameter.mean + times * parameter.sigma for parameter in effect.parameters])


# what the hooks are called with ---------------------------------------------------------------------------------------


def instant() -> Instant:
    """An instant of no symmetry."""
    rng = np.random.default_rng(0)
    tensor = np.diag([3.0, 4.0, 5.0]) + 0.1
    vector = lambda: jnp.asarray(rng.normal(size=3))  # noqa: E731
    body = Composite(
        mass=jnp.asarray(70.0),
        com=vector(),
        com_rate=vector(),
        com_acceleration=vector(),
        inertia=jnp.asarray(tensor),
        inertia_rate=jnp.eye(3) * 0.1,
        inverse=jnp.asarray(np.linalg.inv(tensor)),
        second_moment=jnp.asarray(0.5 * np.trace(tensor) * np.eye(3) - tensor),
        spin=vector(),
        spin_rate=vector(),
    )
    unit = jnp.asarray([0.6, 0.0, 0.8])
    environment = Environment(
        jnp.asarray(7.0),
        unit,
        jnp.asarray(1.2e-6),
        unit[::-1],
        unit,
        jnp.asarray(0.4),
        jnp.asarray([0.0, 0.6, 0.8]),
        vector(),
        vector(),
        jnp.zeros(6),
        jnp.asarray(rng.normal(size=(1, 5))),
        jnp.ones(()),
    )
    attitude = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return Instant(environment, body, jnp.asarray(attitude * np.linalg.det(attitude)), *(vector() * 0.01,) * 3)


def readings() -> Readings:
    rng, count = np.random.default_rng(1), 12
    quaternion = rng.normal(size=(count, 4))
    quaternion /= np.linalg.norm(quaternion, axis=1)[:, None]
    rate, accel = rng.normal(size=(2, count, 3))
    channels = {"rate": rate, "accel": accel, "attitude": quaternion}
    return jax.tree.map(jnp.asarray, Readings(np.arange(count) * 0.5, channels, rng.normal(size=(count, 2))))


class Swing(Motion):
    """Both joints swing."""

    def evaluate(self, time):
        time = np.asarray(time, dtype=float)
        size, speed, phase = np.array([0.5, -0.4]), np.array([0.7, 1.1]), np.array([0.3, 1.0])
        angle = time[:, None] * speed + phase
        return JointState(size * np.sin(angle), size * speed * np.cos(angle), -size * speed**2 * np.sin(angle))


SWING, TIMES = Swing(), np.linspace(0.0, 6.0, 13)
BODY = jnp.asarray(ROBOT.link("link2").inertial.vector)


def columns(effect: Effect) -> int:
    return effect.table(ROBOT, SWING, TIMES).shape[2]


# hooks of values: how each is called, and the shapes it must give -----------------------------------------------------

CALLS: dict[str, Callable[[Effect, Any], Any]] = {
    "momentum": lambda effect, values: effect.momentum(values, instant(), jnp.full(effect.states, 0.1)),
    "wrench": lambda effect, values: effect.wrench(values, instant(), jnp.full(effect.states, 0.1)),
    "derivative": lambda effect, values: effect.derivative(values, instant(), jnp.full(effect.states, 0.1)),
    "specific_force": lambda effect, values: effect.specific_force(values, instant(), jnp.asarray([0.1, -0.2, 0.3])),
    "gravity_gradient_tensor": lambda effect, values: effect.gravity_gradient_tensor(values, instant()),
    "modes": lambda effect, values: effect.modes(values),
    "read": lambda effect, values: effect.read(values, readings()),
    "friction": lambda effect, values: effect.friction(values, jnp.linspace(-0.1, 0.1, 12).reshape(6, 2)),
    "loads": lambda effect, values: effect.loads(values),
    "body_loads": lambda effect, values: effect.body_loads(values, BODY),
    "report": lambda effect, values: effect.report(values),
    "amplitudes": lambda effect, values: effect.amplitudes(values),
}
SHAPES: dict[str, Callable[[Effect], Any]] = {
    "momentum": lambda _: ((3,), (3,)),
    "wrench": lambda _: Wrench((3,), (3,)),
    "derivative": lambda effect: (effect.states,),
    "specific_force": lambda _: (3,),
    "gravity_gradient_tensor": lambda _: (3, 3),
    "modes": lambda effect: tuple((effect.modes_count, *rest) for rest in ((), (), (3,), (3,), (3, 3))),
    "read": lambda _: Readings((12,), {"rate": (12, 3), "accel": (12, 3), "attitude": (12, 4)}, (12, 2), ()),
    "friction": lambda _: (6, 2),
    "loads": lambda effect: (columns(effect),),
    "body_loads": lambda effect: (11 * columns(effect),),
    "report": lambda effect: (len(effect.quantities),),
    "amplitudes": lambda effect: (len(effect.in_amplitudes().parameters),),
}
ADDED = {"momentum", "wrench", "specific_force", "loads", "body_loads", "friction"}
"""Hooks that give nothing where the effect is absent; of the others `read` gives the true readings."""


def leaves(given: Any) -> list[np.ndarray]:
    return [np.asarray(leaf) for leaf in jax.tree.leaves(given)]


def check_values(effect: Effect, hook: str) -> None:
    """Shapes, finite, the same compiled; derivatives are those of differences; nothing where the effect is absent."""
    values, call = typical(effect), CALLS[hook]
    given = call(effect, values)
    assert jax.tree.map(jnp.shape, given) == SHAPES[hook](effect)
    compiled = jax.jit(lambda v: call(effect, v))(values)
    for left, right in zip(leaves(compiled), leaves(given), strict=True):
        assert np.isfinite(left).all()
        np.testing.assert_allclose(left, right, rtol=1e-9, atol=1e-12)
    nothing = np.concatenate([leaf.ravel() for leaf in leaves(readings())]) if hook == "read" else 0.0
    assert np.abs(np.concatenate([leaf.ravel() for leaf in leaves(given)]) - nothing).max() > 0.0
    if not effect.parameters:
        return
    check_derivatives(effect, hook)
    absent = leaves(call(effect, jnp.asarray(effect.absent)))
    if hook in ADDED and not effect.states:  # whose states go on until they have decayed
        for leaf in absent:
            np.testing.assert_array_equal(leaf, 0.0)
    if hook == "read":
        for left, right in zip(absent, leaves(readings()), strict=True):
            np.testing.assert_allclose(left, right, rtol=1e-14, atol=1e-15)


def check_derivatives(effect: Effect, hook: str) -> None:
    """Forward derivatives against central differences with a step of 1e-4 sigma: to 1e-5 of the largest element."""
    values = typical(effect)
    sigma = jnp.array([parameter.sigma for parameter in effect.parameters])

    def flat(scaled):
        given = CALLS[hook](effect, values + sigma * scaled)
        return jnp.concatenate([jnp.ravel(leaf) for leaf in jax.tree.leaves(given)])

    exact = np.asarray(jax.jacfwd(flat)(jnp.zeros(len(sigma))))
    assert np.isfinite(exact).all()
    assert np.abs(exact).max() > 0.0
    for column in range(len(sigma)):
        e = jnp.zeros(len(sigma)).at[column].set(1e-4)
        difference = np.asarray((flat(e) - flat(-e)) / 2e-4)
        scale = max(np.abs(exact[:, column]).max(), 1e-9)
        assert np.abs(difference - exact[:, column]).max() < 1e-5 * scale + 1e-10


# hooks of the recording's motion, and statements ----------------------------------------------------------------------


def check_table(effect: Effect, hook: str) -> None:
    table = effect.table(ROBOT, SWING, TIMES)
    assert table.shape == (len(TIMES), 28, len(effect.loads(typical(effect))))
    assert np.isfinite(table).all()
    assert (np.abs(table).max(axis=(0, 1)) > 0.0).all()


def check_displaced(effect: Effect, hook: str) -> None:
    change = effect.displaced(ROBOT, SWING, TIMES)
    assert change.weights.shape == (columns(effect), len(change.motions))
    np.testing.assert_allclose(change.weights.sum(axis=1), 0.0, atol=1e-9 * np.abs(change.weights).max())


def check_in_recording(effect: Effect, hook: str) -> None:
    """In every recording it is the same effect with the same parameters."""
    for index in range(3):
        assert (effect.in_recording(index).name, effect.in_recording(index).parameters) == (
            effect.name,
            effect.parameters,
        )


def check_jumps(effect: Effect, hook: str) -> None:
    """The table is the same up to the jump and another just after it; without one, an event begins just after it."""
    (when,) = effect.jumps(TIMES[-1])
    if isinstance(effect, Events):
        environment = instant().environment
        begun = [float(effect.begun(when + after, environment.recording)[0]) for after in (0.0, 1e-9)]
        assert begun == [0.0, 1.0]
        return
    table = effect.table(ROBOT, SWING, np.array([0.0, when, when + 1e-9, TIMES[-1]]))
    np.testing.assert_array_equal(table[0], table[1])
    assert not np.allclose(table[1], table[2])
    np.testing.assert_array_equal(table[2], table[3])


def check_body_tables(effect: Effect, hook: str) -> None:
    """Known and unknown bodies together are all of them, and loads have a column each."""
    tables = [table for _, table in effect.body_tables(ROBOT, ("link2",), SWING, TIMES)]
    together = np.concatenate(tables, axis=2)
    values = typical(effect)
    assert together.shape == (len(TIMES), 28, len(effect.body_loads(values, BODY)))
    whole = effect.table(ROBOT, SWING, TIMES) @ np.asarray(effect.loads(values))
    np.testing.assert_allclose(
        together @ np.asarray(effect.body_loads(values, BODY)), whole, atol=1e-9 * np.abs(whole).max()
    )


def check_places(effect: Effect, hook: str) -> None:
    """Labels differ, are accepted by a model, and nothing occurs where there is neither orbit, sensor nor joint."""
    kind = type(effect)
    labels = [place.label for place in places(kind)]
    assert len(set(labels)) == len(labels)
    for place in places(kind):
        assert (WITH_TORQUE if place.uses("friction") else PLAIN).extend(place).effects[-1].label == place.label


def check_lacks(effect: Effect, hook: str) -> None:
    """A model without orbit and without the sensor lacks what it says, so that the effect occurs nowhere in it."""
    others = tuple(sensor for sensor in SENSORS if sensor.kind != getattr(effect, "sensor", None))
    poor, kind = Model(replace(ROBOT, wheels=()), others, UNKNOWN), type(effect)
    assert kind.lacks(PLAIN) is None
    assert kind.lacks(poor)
    assert not kind.instances(poor)
    with pytest.raises(InputError, match=re.escape(f"requires {kind.lacks(poor)}")):
        poor.extend(effect)


def check_starts(effect: Effect, hook: str) -> None:
    for start in effect.starts:
        assert start.shape == (len(effect.parameters),)
        assert np.isfinite(start).all()


def check_starts_near(effect: Effect, hook: str) -> None:
    rng = np.random.default_rng(4)
    resonances = [Resonance(f, 10.0 * np.cov(rng.normal(size=(6, 9)))) for f in (0.2, 0.05, 0.6)]
    for alone in (False, True):
        given = effect.starts_near(resonances, alone)
        assert given
        for start in given:
            assert start.shape == (len(effect.parameters),)
            assert np.isfinite(start).all()


def check_tuned(effect: Effect, hook: str) -> None:
    values = np.array(typical(effect))
    values[[parameter.name for parameter in effect.parameters].index("frequency")] = 0.5
    tuned = effect.tuned(values)
    assert tuned.parameters == effect.parameters
    assert tuned.longest_step == pytest.approx(0.2)
    assert tuned.longest_step < effect.longest_step


def check_in_amplitudes(effect: Effect, hook: str) -> None:
    linear = effect.in_amplitudes()
    assert linear.in_amplitudes() is linear
    assert linear.label == effect.label
    assert all(parameter.is_amplitude for parameter in linear.parameters)
    np.testing.assert_array_equal(effect.amplitudes(jnp.asarray(effect.absent)), 0.0)


def check_physical_bounds(effect: Effect, hook: str) -> None:
    """One bound for each unit of the amplitudes, also of the linear form; tests/test_bounds.py looks at the sizes."""
    bounds = effect.physical_bounds(PLAIN)
    assert tuple(bound.unit for bound in bounds) == effect.amplitude_units
    assert all(0.0 < bound.largest < np.inf for bound in bounds)
    assert effect.in_amplitudes().physical_bounds(PLAIN) == bounds


def check_amplitude_quantities(effect: Effect, hook: str) -> None:
    """They are what `loads` returns, if not parameters, and vanish with the effect."""
    quantities = effect.amplitude_quantities
    assert len({name for name, _ in quantities}) == len(quantities)
    assert effect.loads(jnp.asarray(effect.absent)).shape == (len(quantities),)


def check_amplitude_shapes(effect: Effect, hook: str) -> None:
    """Every form has a positive spread for each amplitude, the largest of which is its scale; forms differ."""
    shapes = np.array(effect.amplitude_shapes)
    assert shapes.shape[1] == len(effect.amplitude_quantities)
    assert (shapes > 0.0).all()
    np.testing.assert_array_equal(shapes.max(axis=1), 1.0)
    assert len(np.unique(shapes, axis=0)) == len(shapes)


def check_absent(effect: Effect, hook: str) -> None:
    assert effect.absent.shape == (len(effect.parameters),)


def check_attach(effect: Effect, hook: str) -> None:
    again = effect.attach(ROBOT)
    assert (again.label, again.parameters) == (effect.label, effect.parameters)


def check_quantities(effect: Effect, hook: str) -> None:
    names = [name for name, _ in effect.quantities]
    assert len(set(names)) == len(names) > 0


def check_label(effect: Effect, hook: str) -> None:
    name, _, place = effect.label.partition(":")
    assert name == effect.name
    assert not place or place in {*ROBOT.links, *JOINTS, *"xyz", WHEEL.name}


def check_candidate(effect: Effect, hook: str) -> None:
    assert effect.candidate == effect.label or effect.label.startswith(f"{effect.candidate}:")


def check_entry(effect: Effect, hook: str) -> None:
    again = create(effect.entry)
    assert (type(again), again.label, again.entry) == (type(effect), effect.label, effect.entry)
    assert jax.tree.map(np.asarray, again.constants) == jax.tree.map(np.asarray, effect.constants)


def check_link(effect: Effect, hook: str) -> None:
    assert effect.link in ROBOT.links


def check_step(effect: Effect, hook: str) -> None:
    assert 0.0 < effect.longest_step < np.inf


def check_name(effect: Effect, hook: str) -> None:
    assert re.fullmatch(r"[a-z]+(-[a-z]+)*", effect.name)


def check_sentence(effect: Effect, hook: str) -> None:
    assert len(getattr(effect, hook)) > 20
    assert getattr(effect, hook).endswith(".")


def check_parameters(effect: Effect, hook: str) -> None:
    """Names differ, units are given, priors are proper."""
    names = [parameter.name for parameter in effect.parameters]
    assert len(set(names)) == len(names) > 0
    for parameter in effect.parameters:
        assert parameter.unit
        assert np.isfinite(parameter.mean)
        assert 0.0 < parameter.sigma < np.inf


def check_needs_orbit(effect: Effect, hook: str) -> None:
    assert not type(effect).instances(Model(ROBOT, SENSORS, UNKNOWN))


def check_needs_latitude(effect: Effect, hook: str) -> None:
    assert not type(effect).instances(Model(ROBOT, SENSORS, UNKNOWN, Orbit(7e6)))


def check_constants(effect: Effect, hook: str) -> None:
    """The effect with its constants put in anew does the same, and they are arguments of what is compiled."""
    values = typical(effect)
    assert all(constant is not None for constant in effect.constants)
    again = jax.jit(lambda constants: effect.bound(constants).loads(values))(effect.constants)
    np.testing.assert_allclose(again, effect.loads(values), rtol=1e-9, atol=1e-12)


def check_count(effect: Effect, hook: str) -> None:
    hooks = {"states": "derivative", "modes_count": "modes"}
    assert getattr(effect, hook) > 0
    assert effect.uses(hooks[hook])


def check_per_recording(effect: Effect, hook: str) -> None:
    """Each of two recordings has its own values: the readings of one do not depend on those of the other."""
    flight = Flight(PLAIN.extend(effect), recordings=2)
    there, absent = typical(effect, SMALL), jnp.asarray(effect.absent)
    only = flight(**{effect.label: jnp.stack([there, absent])})
    none = flight(**{effect.label: jnp.stack([absent, absent])})
    for key in ("rate", "accel"):
        assert np.abs(only[key] - none[key])[0].max() > SHOWN[key]
        np.testing.assert_array_equal(only[key][1], none[key][1])


def check_is_body(effect: Effect, hook: str) -> None:
    """The parameters are log-Cholesky coordinates: their entries relative to the model's body load it linearly."""
    z = 0.3 * np.random.default_rng(5).normal(size=(24, len(effect.parameters)))
    linear = np.stack([np.asarray(relative(jnp.asarray(row))) for row in z])
    loads = np.stack([np.asarray(effect.loads(jnp.asarray(row))) for row in z])
    matrix = np.linalg.lstsq(linear, loads, rcond=None)[0]
    np.testing.assert_allclose(linear @ matrix, loads, atol=1e-9 * np.abs(loads).max())


def check_is_added_body(effect: Effect, hook: str) -> None:
    """The amplitudes are mass, first moment and second moments of a body."""
    units = [quantity.unit for quantity in effect.amplitude_quantities]
    assert units == ["kg", *["kg m"] * 3, *["kg m2"] * 6]


def check_cause_kind(effect: Effect, hook: str) -> None:
    """The kind is registered, and can weigh the effect."""
    kind_of(effect).check(effect)
    assert kind_of(effect).name == effect.cause_kind


def check_reach_of_swing(effect: Effect, hook: str) -> None:
    """No place of the mass is farther from the base origin along an axis."""
    places = [parameter for parameter in effect.parameters if parameter.name.startswith("position.")]
    ends = [abs(float(parameter.value(np.asarray(side)))) for parameter in places for side in (-8.0, 8.0)]
    assert effect.reach_of_swing == pytest.approx(max(ends))


def check_in_study(effect: Effect, hook: str) -> None:
    """What is resolved over the longest recording has the same name; recorded wheels leave no unseen one."""
    assert effect.in_study(None, False) is effect
    assert effect.in_study(100.0, False).label == effect.label
    assert effect.in_study(100.0, True) is None


def check_shows_in(effect: Effect, hook: str) -> None:
    """The line of a wheel shows where it lies below half the sampling rate, and nowhere else."""
    time = np.arange(0.0, 10.0, 0.1)
    channels = {f"rate.{axis}": 0.0 * time for axis in "xyz"}
    slow, fast = (
        Recording("r", None, time, {**channels, "wheel_speed.wheel1": speed + 0.0 * time}) for speed in (20, 40)
    )
    assert effect.shows_in([fast, slow])
    assert not effect.shows_in([fast, slow], 5.0)
    assert not effect.shows_in([fast])


def check_members(effect: Effect, hook: str) -> None:
    """All that the registration of the class makes known is known, the effect among it."""
    names = {member.name for member in type(effect).members()}
    assert effect.name in names
    assert names <= set(known_effects())


CHECKS: dict[str, Callable[[Effect, str], None]] = {
    **dict.fromkeys(CALLS, check_values),
    "name": check_name,
    "summary": check_sentence,
    "separated_by": check_sentence,
    "parameters": check_parameters,
    "needs_orbit": check_needs_orbit,
    "needs_latitude": check_needs_latitude,
    "constant_names": check_constants,
    "states": check_count,
    "modes_count": check_count,
    "instances": check_places,
    "lacks": check_lacks,
    "longest_step": check_step,
    "quantities": check_quantities,
    "amplitude_quantities": check_amplitude_quantities,
    "amplitude_shapes": check_amplitude_shapes,
    "physical_bounds": check_physical_bounds,
    "attach": check_attach,
    "starts": check_starts,
    "absent": check_absent,
    "in_amplitudes": check_in_amplitudes,
    "starts_near": check_starts_near,
    "tuned": check_tuned,
    "label": check_label,
    "candidate": check_candidate,
    "entry": check_entry,
    "link": check_link,
    "table": check_table,
    "in_recording": check_in_recording,
    "jumps": check_jumps,
    "per_recording": check_per_recording,
    "is_body": check_is_body,
    "body_tables": check_body_tables,
    "is_added_body": check_is_added_body,
    "cause_kind": check_cause_kind,
    "reach_of_swing": check_reach_of_swing,
    "in_study": check_in_study,
    "shows_in": check_shows_in,
    "members": check_members,
}
FRAMEWORK = {"uses", "uses_latitude", "constants", "bound", "amplitude_units", "instants", "at"}
"""What the simulation asks of an effect and no effect overrides."""


def hooks_of(effect: Effect) -> list[str]:
    """What to check of an effect: all that its class overrides; of a linear form what it does."""
    hooks = overridden(type(effect)) + (["parameters"] if effect.parameters else [])  # most are set by __init__
    return [hook for hook in dict.fromkeys(hooks) if hook in PHYSICS or effect not in LINEAR]


PHYSICS = {*CALLS, "table", "body_tables"} - {"report", "amplitudes"}
PAIRS = [(effect, hook) for effect in (*EFFECTS, *LINEAR) for hook in hooks_of(effect)]


@pytest.mark.parametrize(("effect", "hook"), PAIRS, ids=[f"{NAMES[id(effect)]} {hook}" for effect, hook in PAIRS])
def test_every_hook_keeps_its_contract(effect, hook):
    CHECKS[hook](effect, hook)


def test_no_hook_is_left_out():
    """Everything public on `Effect` has a check, and something to check it on; every shipped effect has a place."""
    public = {name for name in vars(Effect) if not name.startswith("_")} - FRAMEWORK
    assert public == CHECKS.keys()
    assert {hook for _, hook in PAIRS} == CHECKS.keys()
    assert {type(effect) for effect in EFFECTS} == {*KINDS, CreepingWheel}
    exercised = {(type(effect), hook) for effect, hook in PAIRS}
    assert exercised >= {(kind, hook) for kind in KINDS for hook in overridden(kind)}


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_every_shipped_effect_says_what_it_is_and_what_separates_it(kind):
    check_sentence(kind, "summary")
    check_sentence(kind, "separated_by")


def test_hooks_that_are_not_overridden_do_nothing():
    nothing = Effect()
    for hook in ("momentum", "wrench", "derivative", "specific_force", "gravity_gradient_tensor", "loads", "friction"):
        assert not nothing.uses(hook)
        for leaf in leaves(CALLS[hook](nothing, jnp.zeros(0))):
            assert not leaf.any()


# in the simulation ----------------------------------------------------------------------------------------------------

CALLED: set[tuple[str, str]] = set()


def spied(effect: Effect) -> Effect:
    """The effect, with a note of every physical hook of its class that is called."""

    def noting(hook: str) -> Callable[..., Any]:
        def run(self, *given):
            CALLED.add((effect.label, hook))
            return getattr(kind, hook)(self, *given)

        return run

    kind = type(effect)
    spy = type(kind.__name__, (kind,), {hook: noting(hook) for hook in PHYSICS & set(overridden(kind))})
    changed = object.__new__(spy)
    changed.__dict__.update(effect.__dict__)
    return changed


class Flight:
    """A compiled simulation of a model, of values of its effects."""

    def __init__(self, model: Model, recordings: int = 1) -> None:
        self.model, self.recordings = model, recordings
        samples = np.linspace(0.0, 6.0, 25)
        speed = SampledCurve(np.arange(7.0), np.array([[0.1], [0.3], [0.5], [0.4], [0.0], [-0.2], [0.1]]))
        grid = build_grid(
            ROBOT,
            ("link2",),
            SWING,
            samples,
            0.25,
            orbit=ORBIT,
            argument_of_latitude=0.7,
            actions=Actions.none(WheelMotion.planned([WHEEL], {WHEEL.name: speed})),
            effects=model.effects,
            torques=model.torque is not None,
        )
        grids, attitude = pad_grids([grid] * recordings), jnp.asarray([[0.1, -0.2, 0.3, 0.9]] * recordings)
        attitude /= jnp.linalg.norm(attitude[0])
        rate, tilt = jnp.asarray([[0.02, -0.03, 0.01]] * recordings), jnp.zeros((recordings, 3))
        simulator, constants, speed = Simulator.of(model), ModelConstants.of(model), jnp.zeros((recordings, 0))
        self._run = jax.jit(
            lambda effects: simulator.readings(constants, Values(BODY, rate, tilt, speed, effects), grids, attitude)
        )

    def __call__(self, **present: jnp.ndarray) -> dict[str, np.ndarray]:
        """Readings with the named effects at some values and the others absent."""
        values = []
        for effect in self.model.effects:
            given = present.get(effect.label, jnp.asarray(effect.absent))
            own = effect.per_recording and given.ndim == 1
            values.append(jnp.stack([given] * self.recordings) if own else given)
        found = self._run(tuple(values))[0]
        return {key: np.asarray(value) for key, value in (*found.channels.items(), ("torque", found.torque))}


SMALL = 0.03
"""Size of the effects, in prior standard deviations, at which those beside each other leave the small robot whole."""

SHOWN = {"rate": 1e-7, "accel": 1e-7, "attitude": 1e-7, "torque": 1e-4}
"""Change of a reading that counts, a hundredth of the sensor's noise."""


def largest(first: dict[str, np.ndarray], second: dict[str, np.ndarray]) -> float:
    """Largest difference of readings, in units of what counts."""
    return max(np.abs(first[key] - second[key]).max(initial=0.0) / size for key, size in SHOWN.items())


@pytest.fixture(scope="module")
def without() -> dict[str, Flight]:
    """Simulations without effects."""
    return {"plain": Flight(PLAIN), "torque": Flight(WITH_TORQUE)}


def carrying(model: Model, effects: list[Effect]) -> Flight:
    for effect in effects:
        model = model.extend(effect)
    return Flight(model)


@pytest.fixture(params=["plain", "torque"])
def flights(request, without) -> tuple[Flight, Flight]:
    """Simulations without effects and with all that can act beside each other."""
    bare, torque = without[request.param], request.param == "torque"
    acting = [spied(effect) for effect in EFFECTS if effect.uses("friction") is torque and effect.parameters]
    return bare, carrying(bare.model, acting)


@pytest.mark.slow
def test_every_effect_changes_the_readings_and_nothing_where_it_is_absent(flights):
    """All in one simulation: each is there in turn while the others are absent; every overridden hook was called."""
    nothing, with_all = flights
    bare = with_all()
    assert largest(nothing(), bare) < 1e-5
    for effect in with_all.model.effects:
        present = with_all(**{effect.label: typical(effect, SMALL)})
        assert all(np.isfinite(values).all() for values in present.values()), effect.label
        assert largest(present, bare) > 1.0, effect.label
    labels = {effect.label for effect in with_all.model.effects}
    wanted = {
        (effect.label, hook)
        for effect in EFFECTS
        if effect.label in labels
        for hook in PHYSICS & set(overridden(type(effect)))
        # the grid builder asks for the parts of a table, of which the whole is the sum
        if not (hook == "table" and "body_tables" in overridden(type(effect)))
    }
    assert {pair for pair in CALLED if pair[0] in labels} >= wanted


def test_an_effect_without_parameters_changes_the_readings(without):
    for effect in (effect for effect in EFFECTS if not effect.parameters):
        assert largest(carrying(WITH_TORQUE, [spied(effect)])(), without["torque"]()) > 1.0
        assert {hook for label, hook in CALLED if label == effect.label} == PHYSICS & set(overridden(type(effect)))


@pytest.mark.slow
def test_amplitudes_describe_the_same_effect_where_it_is_small(without):
    """Against the effect at a small size, in the simulation."""
    small = {"joint-flexibility": jnp.array([8.0, 0.03])}
    originals = [effect for effect in EFFECTS if effect.in_amplitudes() is not effect]
    bare, whole, linear = without["plain"](), carrying(PLAIN, originals), carrying(PLAIN, LINEAR)
    for effect in originals:
        pressed = jnp.array([1e-4, 0.5, -0.3, 0.2])
        coordinates = 1e-3 * jnp.linspace(-1.0, 1.0, 10)  # of a link, log-Cholesky
        values = small.get(effect.name, pressed if len(effect.parameters) == 4 else coordinates)
        changes = []
        for flight, at in ((whole, values), (linear, effect.amplitudes(values))):
            there = flight(**{effect.label: at})
            changes.append(np.concatenate([((there[k] - bare[k]) / SHOWN[k]).ravel() for k in ("rate", "accel")]))
        assert np.linalg.norm(changes[0]) > 1.0
        assert np.linalg.norm(changes[1] - changes[0]) < 0.01 * np.linalg.norm(changes[0])
