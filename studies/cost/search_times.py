"""How soon a search for manoeuvres can begin, and what one step of it takes, each in a process of its own.

The problem is that of `studies.excitation`: d-optimality for the base of ETS-VII with the arm known to 5 %, 120 s at
0.5 s, 48 free control points, the noise of the encoders in the criterion.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

EVALUATIONS = 30  # number of manoeuvres at which the criterion is evaluated


class SearchTimes(NamedTuple):
    """Times of a search."""

    # time from the start of a process until all that a search needs is compiled, without compiled code and with it [s]
    cold: float
    warm: float
    # times of one criterion with its gradient, and of all limits with their Jacobian, one core [s]
    criterion: tuple[float, ...]
    limits: tuple[float, ...]
    unknowns: int  # number of free numbers of a manoeuvre


def search_times() -> SearchTimes:
    """Measure a search, without compiled code and then with what that compiled."""
    with tempfile.TemporaryDirectory() as folder:
        cache = Path(folder)
        cold = search_clock(cache, one_core=False)
        warm = search_clock(cache, one_core=False)
        step = search_clock(cache, one_core=True)
    return SearchTimes(cold["ready"], warm["ready"], tuple(step["criterion"]), tuple(step["limits"]), step["unknowns"])


def search_clock(cache: Path, *, one_core: bool) -> dict:
    """Return what `main` prints, run in a process of its own with a folder of compiled code."""
    command = [sys.executable, "-m", __name__, repr(time.time()), *(["one-core"] if one_core else [])]
    environment = os.environ | {"BAYESID_CACHE": str(cache)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"the clock of the search failed: {done.stderr.strip()[-500:]}")
    return json.loads(done.stdout)


def main() -> None:
    """Print the time until a search can begin and those of its steps, as JSON.

    The first argument is the time at which the process was started [s since the epoch]; ``one-core`` after it keeps all
    threads on one core.
    """
    if sys.argv[2:] == ["one-core"]:
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})  # before JAX starts its threads, which inherit it

    from bayesid.app.compilation_cache import keep_compiled

    keep_compiled()
    import numpy as np

    from bayesid.design import DOptimal
    from studies.common import mission

    criterion = DOptimal()
    problem = mission.problem(mission.base_unknown(), mission.splines(), criterion)
    problem.compile()
    ready = time.time() - float(sys.argv[1])
    family = problem.plan.family
    rng = np.random.default_rng(0)
    seconds, limits = [], []
    for parameters in family.centre + 0.3 * family.scale * rng.normal(size=(EVALUATIONS, family.size)):
        began = time.perf_counter()
        problem.cost(criterion, parameters)
        middle = time.perf_counter()
        problem.fractions(parameters)
        seconds.append(middle - began)
        limits.append(time.perf_counter() - middle)
    print(json.dumps({"ready": ready, "criterion": seconds, "limits": limits, "unknowns": family.size}))


if __name__ == "__main__":
    main()
