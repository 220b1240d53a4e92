"""A nonlinear cause of the user's own is one class and its kind: a torque that sets in at an unknown instant."""

from __future__ import annotations

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest

from bayesid._io.errors import InputError
from bayesid.diagnosis import diagnose
from bayesid.diagnosis.candidates import cause_kind
from bayesid.diagnosis.candidates.cause_kind import kind_of, register_kind
from bayesid.diagnosis.candidates.instant_cause import InstantCause
from bayesid.diagnosis.outcome.candidate_table import amplitudes_of, instants_of
from bayesid.inference.posterior import Posterior
from bayesid.inference.predicted_readings import simulate_recordings
from bayesid.simulation.effects import Effect, Parameter, Wrench, create


class StepTorque(Effect):
    """A torque that sets in at an instant and stays."""

    name = "step-torque"
    cause_kind = "step"
    constant_names = ("instants",)
    parameters = tuple(Parameter(axis, "N m", 0.1) for axis in "xyz")
    instants = (0.0,)

    def wrench(self, values, instant, inner):
        begun = jnp.where(instant.environment.time > self.instants[0], 1.0, 0.0)
        return Wrench(jnp.zeros(3), begun * values)


class Step(InstantCause):
    """Its kind."""

    name = "step"


TORQUE, SHARE = np.array([0.0, 0.03, -0.02]), 0.43


@pytest.fixture(scope="module")
def found(planar_case):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cause_kind, "_REGISTER", dict(cause_kind._REGISTER))
        register_kind(Step())
        model, manoeuvre = planar_case.posterior.model, planar_case.posterior.manoeuvres[0]
        instant = SHARE * float(manoeuvre.recording.time[-1])
        truth = Posterior.of(model.extend(StepTorque().at((instant,))), [manoeuvre], step=planar_case.posterior.step)
        z = np.concatenate([planar_case.posterior.starting_point(), TORQUE / 0.1])
        (recording,) = simulate_recordings(truth, np.random.default_rng(3), z)
        effects = [create("aerodynamic-drag").attach(model.robot), StepTorque()]
        yield instant, diagnose(model, [replace(manoeuvre, recording=recording)], 0, effects=effects)


@pytest.mark.slow
def test_it_is_found_and_named_with_its_size_and_its_instant(found):
    instant, result = found
    assert result.verdict.causes == ("step-torque",)
    for item, expected in zip(amplitudes_of(result.after, "step-torque"), TORQUE, strict=True):
        assert abs(item.mean - expected) < 4.0 * item.sd
    (when,) = instants_of(result.after, "step-torque")
    assert abs(when.mean - instant) < 4.0 * when.sd + 0.5


class Unheard(StepTorque):
    """An effect whose kind nobody registered."""

    cause_kind = "unheard"


def test_an_effect_of_a_kind_that_nobody_registered_is_refused():
    with pytest.raises(InputError, match=r"unknown kind of cause, 'unheard'.*register_kind"):
        kind_of(Unheard())
