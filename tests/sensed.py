"""What a rate sensor, an accelerometer at a point and a star sensor make of a simulated motion."""

from __future__ import annotations

from types import SimpleNamespace

import jax
import jax.numpy as jnp

from bayesid.simulation.dynamics import Samples
from bayesid.simulation.sensors import Sensed, SensorKind


def read(samples: Samples, point) -> SimpleNamespace:
    """Return time (T,), rate and accel (T, 3), attitude (T, 4) of a motion simulated with one mounting point."""
    sensed = jax.vmap(Sensed, (0, 0, None, 0))(
        samples.instant, samples.quaternion, jnp.asarray(point), samples.specific_force[:, 0]
    )
    rate, accel, attitude = (
        jax.vmap(kind.read)(sensed) for kind in (SensorKind.RATE, SensorKind.ACCEL, SensorKind.ATTITUDE)
    )
    return SimpleNamespace(time=samples.instant.environment.time, rate=rate, accel=accel, attitude=attitude)
