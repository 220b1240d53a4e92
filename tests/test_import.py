"""Importing the package, and computing with it, leaves JAX as it is, and needs no setting of it."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

HEAD = """
import json, sys, threading, warnings
import jax, jax.numpy as jnp
import numpy as np

floats = jax.jit(lambda x: 2.0 * x)
before = [str(jnp.ones(3).dtype), str(floats(np.ones(3)).dtype)]
filters = list(warnings.filters)
import bayesid
assert warnings.filters == filters
shipped = f"{bayesid.__path__[0]}/app/demonstration_data/study.toml"
posterior = bayesid.load_posterior(bayesid.Study.load(shipped))
z = posterior.starting_point() + 1e-3 * np.random.default_rng(0).normal(size=(3, posterior.size))
"""

COMPUTED = """
beside = []
thread = threading.Thread(target=lambda: beside.append(posterior.log_density(z)))
thread.start()
thread.join()
computed = {"density": posterior.log_density(z), "in a thread": beside[0]}
result = bayesid.identify(posterior, seed=1, effective_samples=50.0)
computed |= {"draws": result.chains.z, "evidence": result.evidence.value, "slopes": posterior.jacobian(z[0])}
"""

END = """
after = [str(jnp.ones(3).dtype), str(floats(np.ones(3)).dtype)]
print(json.dumps([before, after, {key: np.asarray(value).tolist() for key, value in computed.items()}]))
"""


def computed_where(precision: str) -> list:
    """Return what a fresh interpreter computes with the setting of JAX for all of its process."""
    settings = {"JAX_ENABLE_X64": precision, "JAX_COMPILATION_CACHE_DIR": os.environ["BAYESID_TEST_COMPILED"]}
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", HEAD + COMPUTED + END],
        env=os.environ | settings,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.slow
def test_code_of_jax_beside_it_stays_in_its_precision_and_the_results_are_those_of_64_bits():
    before, after, ours = computed_where("0")
    assert before == ["float32"] * 2
    assert after == before
    everywhere, _, reference = computed_where("1")
    assert everywhere == ["float64"] * 2
    assert ours == reference
