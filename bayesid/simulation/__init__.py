"""Simulation: the forward model with its orbit, effects, dynamics of the composite body, and sensors."""
