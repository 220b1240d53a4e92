"""Studies: each returns its numbers and figures, and writes its report."""

import jax

jax.config.update("jax_enable_x64", True)  # of a study's own process, as some compute with JAX themselves
