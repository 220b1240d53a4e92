"""Hidden vibrations along a motion whose acceleration jumps between two nodes, against a closed form."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from bayesid.diagnosis.response.hidden_vibration import Vibration
from bayesid.robot.composite_tables import ENTRIES
from bayesid.simulation.effects import FuelSlosh

CORNERS = np.array([5.13, 9.37, 20.26, 24.6, 24.9, 33.4])
"""Instants at which the centre of mass begins or ends to speed up [s]."""

STEPS = np.array([0.02, -0.03, 0.01, -0.015, 0.03, -0.015])
"""Jumps of its acceleration there [m/s2]; their sum is zero."""

MASS, FREQUENCY, DAMPING = 3.0, 0.18, 0.01


def instants(times: np.ndarray) -> SimpleNamespace:
    """A heavy body that does not turn, seen from a base origin that keeps clear of its moving centre of mass."""
    since = np.maximum(times[:, None] - CORNERS, 0.0)
    along = np.array([1.0, 0.0, 0.0])

    def moving(values: np.ndarray) -> np.ndarray:
        return (values @ STEPS)[None, :, None] * along

    bend = moving((since > 0.0).astype(float))
    nothing = np.zeros((1, len(times), 3))
    body = SimpleNamespace(
        mass=np.full((1, len(times)), 1e9),
        com=moving(0.5 * since**2),
        com_rate=moving(since),
        com_acceleration=bend,
        inverse=np.zeros((1, len(times), 3, 3)),
    )
    environment = SimpleNamespace(time=times[None])
    return SimpleNamespace(environment=environment, body=body, rate=nothing, rate_change=nothing, acceleration=-bend)


def swinging(times: np.ndarray) -> np.ndarray:
    """Momentum of a mass on a spring relative to an origin with the acceleration of the corners, in closed form."""
    omega = 2.0 * np.pi * FREQUENCY
    damped = omega * np.sqrt(1.0 - DAMPING**2)
    since = np.maximum(times[:, None] - CORNERS, 0.0)
    return MASS * (np.exp(-DAMPING * omega * since) * np.sin(damped * since) / damped) @ STEPS


def test_a_mass_on_a_spring_is_struck_at_the_instants_of_the_jumps_and_not_half_a_step_beside() -> None:
    """The largest error is 0.5 % of the swing; it was 32 % with a curve through the accelerations at the nodes."""
    node = instants(np.arange(0.0, 40.01, 0.5))
    vibration = Vibration.along(node, node)
    values = np.array([[MASS, FREQUENCY, DAMPING, 0.0, 0.0, 0.0]])
    found = vibration.rows(FuelSlosh(), values)[0][0, 0][:, ENTRIES["first_rate"]]
    expected = swinging(node.environment.time[0])
    np.testing.assert_allclose(found[:, 1:], 0.0, atol=1e-12)
    assert np.abs(found[:, 0] - expected).max() < 0.015 * np.abs(expected).max()
