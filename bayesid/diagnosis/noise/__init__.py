"""Faults of the noise: their tests, and the states of the noise model that they lead to."""
