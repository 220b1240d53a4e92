"""Bayesian identification of the inertial parameters of free-flying space robots."""

import jax

jax.config.update("jax_enable_x64", True)
