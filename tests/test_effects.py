"""A contract for every registered effect, and effects written by a user."""

from __future__ import annotations

import re
from pathlib import Path
from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from bayesid._io.errors import InputError
from bayesid.inference.mode import maximise
from bayesid.inference.posterior import Posterior
from bayesid.recording.joint_motion import MeasuredMotion
from bayesid.recording.recording import Recording
from bayesid.robot.body_prior import BodyPrior
from bayesid.robot.robot import Robot
from bayesid.simulation.effects import Effect, Parameter, Readings, Wrench, create, register
from bayesid.simulation.effects.effect import _REGISTER, Composite, Environment, Instant
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.sensors import Kind, Sensor, White
from studies.truth import mujoco as mj
from studies.truth import stepwise as ref

PLANAR = Path(__file__).resolve().parents[1] / "bayesid" / "robot" / "models" / "planar.urdf"
HOOKS = ("momentum", "wrench", "derivative", "specific_force", "read", "gravity_gradient_tensor", "friction")


def instance(name: str) -> Effect:
    """The effect; those that need a place get one of the planar robot's."""
    try:
        return create(name)
    except (TypeError, InputError):
        for place in ("link2", "joint2", "rate"):
            try:
                return create(f"{name}:{place}")
            except (TypeError, InputError):
                continue
        raise


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
        unit,
        vector(),
        vector(),
        jnp.zeros(6),
    )
    attitude = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return Instant(environment, body, jnp.asarray(attitude * np.linalg.det(attitude)), *(vector() * 0.01,) * 3)


def readings() -> Readings:
    rng, count = np.random.default_rng(1), 12
    quaternion = rng.normal(size=(count, 4))
    quaternion /= np.linalg.norm(quaternion, axis=1)[:, None]
    rate, accel = rng.normal(size=(2, count, 3))
    channels = {"rate": jnp.asarray(rate), "accel": jnp.asarray(accel), "attitude": jnp.asarray(quaternion)}
    return Readings(jnp.arange(count) * 0.5, channels, jnp.asarray(rng.normal(size=(count, 2))))


def call(effect: Effect, hook: str, values):
    inner = jnp.full(effect.states, 0.1)
    if hook == "read":
        return effect.read(values, readings())
    if hook == "specific_force":
        return effect.specific_force(values, instant(), jnp.asarray([0.1, -0.2, 0.3]))
    if hook == "gravity_gradient_tensor":
        return effect.gravity_gradient_tensor(values, instant())
    if hook == "friction":
        return effect.friction(values, jnp.linspace(-0.1, 0.1, 12).reshape(6, 2))
    return getattr(effect, hook)(values, instant(), inner)


SHAPES = {
    "momentum": lambda _: ((3,), (3,)),
    "wrench": lambda _: Wrench((3,), (3,)),
    "derivative": lambda effect: (effect.states,),
    "specific_force": lambda _: (3,),
    "read": lambda _: Readings((12,), {"rate": (12, 3), "accel": (12, 3), "attitude": (12, 4)}, (12, 2)),
    "gravity_gradient_tensor": lambda _: (3, 3),
    "friction": lambda _: (6, 2),
}


@pytest.fixture(params=sorted(_REGISTER))
def effect(request) -> Effect:
    return instance(request.param)


WITH_PARAMETERS = [name for name in sorted(_REGISTER) if instance(name).parameters]
WITH_AMPLITUDE = [name for name in WITH_PARAMETERS if not any(p.mean for p in instance(name).parameters)]


def typical(effect: Effect, times: float) -> jnp.ndarray:
    """Values so many prior standard deviations from the prior's mean."""
    return jnp.array([parameter.mean + times * parameter.sigma for parameter in effect.parameters])


# the contract ---------------------------------------------------------------------------------------------------------


def test_names_are_in_kebab_case_and_a_summary_says_what_it_is(effect):
    assert re.fullmatch(r"[a-z]+(-[a-z]+)*", effect.name)
    assert effect.label.partition(":")[0] == effect.name
    assert len(effect.summary) > 20


def test_parameters_have_names_units_and_a_width(effect):
    names = [parameter.name for parameter in effect.parameters]
    assert len(set(names)) == len(names)
    for parameter in effect.parameters:
        assert parameter.name
        assert parameter.unit
        assert np.isfinite(parameter.mean)
        assert 0.0 < parameter.sigma < np.inf


def test_hooks_return_the_right_shapes_and_can_be_compiled(effect):
    values = typical(effect, 0.3)
    for hook in HOOKS:
        found = jax.jit(lambda v, hook=hook: call(effect, hook, v))(values)
        assert jax.tree.map(jnp.shape, found) == SHAPES[hook](effect), hook
        for leaf in jax.tree.leaves(found):
            assert np.isfinite(leaf).all(), hook
        plain = call(effect, hook, values)
        for left, right in zip(jax.tree.leaves(found), jax.tree.leaves(plain), strict=True):
            np.testing.assert_allclose(left, right, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("effect", WITH_PARAMETERS, indirect=True)
def test_hooks_can_be_differentiated(effect):
    """Forward derivatives against central differences with a step of 1e-4 sigma: to 1e-5 of the largest element."""
    values = typical(effect, 0.3)
    sigma = jnp.array([parameter.sigma for parameter in effect.parameters])
    moved = False
    for hook in HOOKS:
        if not effect.uses(hook):
            continue

        def flat(scaled, hook=hook):
            found = call(effect, hook, values + sigma * scaled)
            return jnp.concatenate([jnp.ravel(leaf) for leaf in jax.tree.leaves(found)])

        exact = jax.jacfwd(flat)(jnp.zeros(len(sigma)))
        for column in range(len(sigma)):
            e = jnp.zeros(len(sigma)).at[column].set(1e-4)
            difference = (flat(e) - flat(-e)) / 2e-4
            scale = max(float(jnp.abs(exact[:, column]).max()), 1e-9)
            assert float(jnp.abs(difference - exact[:, column]).max()) < 1e-5 * scale + 1e-10, hook
            moved |= bool(jnp.abs(exact[:, column]).max() > 0.0)
    assert moved or not any(effect.uses(hook) for hook in HOOKS), "no hook depends on the parameters"


@pytest.mark.parametrize("effect", WITH_AMPLITUDE, indirect=True)
def test_zero_values_change_nothing(effect):
    values = jnp.zeros(len(effect.parameters))
    for hook in ("momentum", "wrench", "specific_force"):
        for leaf in jax.tree.leaves(call(effect, hook, values)):
            np.testing.assert_array_equal(leaf, 0.0)
    for left, right in zip(*map(jax.tree.leaves, (call(effect, "read", values), readings())), strict=True):
        np.testing.assert_allclose(left, right, rtol=1e-14, atol=1e-15)


def test_hooks_that_are_not_overridden_do_nothing():
    nothing = Effect()
    assert not any(nothing.uses(hook) for hook in HOOKS)
    for hook in HOOKS[:4]:
        for leaf in jax.tree.leaves(call(nothing, hook, jnp.zeros(0))):
            assert not np.asarray(leaf).any()


def test_the_register():
    with pytest.raises(InputError, match=r"unknown effect 'phlogiston'. Choose from .*gravity-gradient"):
        create("phlogiston")

    class Nameless(Effect):
        pass

    with pytest.raises(InputError, match="effect Nameless has no name"):
        register(Nameless)


# a user's own effects -------------------------------------------------------------------------------------------------


class ConstantTorque(Effect):
    """A torque of unknown size on the base."""

    name = "constant-torque"
    parameters = tuple(Parameter(axis, "N m", 0.01) for axis in "xyz")

    def wrench(self, values, instant, inner):
        return Wrench(jnp.zeros(3), values)


TAU = 8.0


class CreepingTorque(Effect):
    """A torque that approaches its final value with a time constant of 8 s: an effect with states of its own."""

    name = "creeping-torque"
    states: ClassVar[int] = 3
    parameters = tuple(Parameter(axis, "N m", 0.01) for axis in "xyz")

    def derivative(self, values, instant, inner):
        return (values - inner) / TAU

    def wrench(self, values, instant, inner):
        return Wrench(jnp.zeros(3), inner)


TORQUE = np.array([2e-3, -1e-3, 1.5e-3])
SIGMA, POINT = 1e-5, (0.1, -0.15, 0.3)
TIMES = np.arange(0.0, 30.01, 0.5)


def posterior_of(rate: np.ndarray, accel: np.ndarray, motion: mj.Motion) -> Posterior:
    rng, channels = np.random.default_rng(3), {}
    position = np.array([motion(t)[0] for t in TIMES])
    for index in range(2):
        channels[f"position.joint{index + 1}"] = position[:, index] + 1e-6 * rng.normal(size=len(TIMES))
    for family, values in (("rate", rate), ("accel", accel)):
        for index, axis in enumerate("xyz"):
            channels[f"{family}.{axis}"] = values[:, index] + SIGMA * rng.normal(size=len(TIMES))
    recording, robot = Recording("own", None, TIMES, channels), Robot.from_urdf(PLANAR)
    smoothed = MeasuredMotion.from_recording(recording, robot, sigma={0: 1e-6})
    sensors = (Sensor(Kind.RATE, White(SIGMA)), Sensor(Kind.ACCEL, White(SIGMA), position=POINT))
    prior = BodyPrior("base_link", robot.link("base_link").inertial, 0.1)
    return Posterior.of(Model(robot, sensors, (prior,)), [Manoeuvre(recording, smoothed)], step=0.5)


def identified(posterior: Posterior, effect: Effect) -> tuple[np.ndarray, np.ndarray, float]:
    """Values, covariance and chi2 per sample of the model extended by the effect."""
    extended = Posterior.of(posterior.model.extend(effect), posterior.manoeuvres, step=0.5)
    assert extended.unknowns.names[-3:] == tuple(f"{effect.label}.{axis}" for axis in "xyz")
    assert posterior.model.effects == ()
    refined, optimum = maximise(extended, np.random.default_rng(0))
    values = np.asarray(refined.unknowns.values_at(optimum.z).effects[0])
    return values, optimum.covariance[-3:, -3:] * 0.01**2, optimum.chi2 / refined.samples


@pytest.mark.parametrize("kind", ["constant", "creeping"])
def test_an_effect_of_ones_own_is_composed_and_identified(kind):
    """Truth: a hidden thrust in MuJoCo, and a torque that grows as 1 - exp(-t / tau) in the reference.

    Chi-square of the three torques is below 21.1, exceeded by chance once in 10,000.
    """
    motion = mj.smooth_motion(2, 30.0, seed=5, amplitude=0.4, frequencies=(0.04, 0.07), ramp=8.0)
    rate0 = (0.01, -0.02, 0.015)
    if kind == "constant":
        effect = ConstantTorque()
        thrust = mj.Thrust(0.0, 1e9, torque=tuple(TORQUE))
        truth = mj.TruthModel(PLANAR, thrusts=[thrust], accel_position=POINT).run(motion, TIMES, rate0=rate0, step=0.1)
    else:
        effect = CreepingTorque()
        truth = ref.simulate(
            PLANAR,
            motion,
            TIMES,
            0.1,
            gradient=False,
            rate0=rate0,
            accel_position=POINT,
            base_torque=lambda t: TORQUE * (1.0 - np.exp(-t / TAU)),
        )
    values, covariance, chi2 = identified(posterior_of(truth.rate, truth.accel, motion), effect)
    error = values - TORQUE
    assert error @ np.linalg.solve(covariance, error) < 21.1
    assert (np.sqrt(np.diag(covariance)) < 0.2 * np.abs(TORQUE)).all()  # it was found, not left at its prior
    assert 0.6 < chi2 < 1.3
