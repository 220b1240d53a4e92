"""Section 3.1 of the paper: which combinations of the inertial parameters can be identified at all.

The paper's two-joint example is worked through, then ETS-VII: the base parameters as sums of standard parameters, those
that follow once the dependent ones are known, and the data that show the scale of the masses.
``python -m studies.base_parameters`` writes ``reports/base_parameters.pdf``.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from threadpoolctl import threadpool_limits

from bayesid import Robot
from bayesid.identifiability import Base
from studies.base_parameters.peers import compare
from studies.base_parameters.report import Result, write_report
from studies.base_parameters.structure import equations_at, identify_by_torques, scale_cases, structure
from studies.common.ets7 import ets7
from studies.common.provenance import MODELS, study_origin
from studies.common.study import Command

__all__ = ["Result", "main", "run"]


@threadpool_limits.wrap(limits=1)  # threads would slow the many small factorisations down
def run(*, seed: int = 1) -> Result:
    """Run the study with random states that follow from the seed."""
    planar, arm = Robot.shipped("planar"), ets7()
    rngs = [np.random.default_rng(stream) for stream in np.random.SeedSequence(seed).spawn(5)]
    return Result(
        planar=structure(planar),
        equations=equations_at(planar, rngs[0]),
        arm=structure(arm),
        grounded=(structure(planar, Base.FIXED), structure(arm, Base.FIXED)),
        recovery=identify_by_torques(arm, rngs[1]),
        scale=scale_cases(arm, rngs[2]),
        peers=tuple(compare(robot, rngs[3]) for robot in (planar, arm)),
        tilted=compare(arm, rngs[4], gravity=(3.0, 2.0, -9.0)),
        seed=seed,
    )


COMMAND = Command("base_parameters", "Say which inertial parameters can be identified at all.", seed=1)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the study and write its report."""
    options = COMMAND.parse(arguments)
    robots = [MODELS / f"{name}.urdf" for name in ("planar", "ets7")]
    write_report(run(seed=options.seed), options.output, origin=study_origin(COMMAND.name, options, robots))
