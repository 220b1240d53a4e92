"""The forward model: orbit, effects, dynamics of the composite body, sensors."""
