"""The identified robot: a URDF that any simulator can load, and a file with the uncertainty of its bodies.

Every body takes the posterior mean of its ten linear parameters. Pseudo-inertias of physical bodies form a convex cone,
so that their mean is a physical body too (Wensing, Kim & Slotine 2018). The motion depends on ratios of sums that are
linear in these parameters: the combinations that the data leave undetermined form a straight ridge, on which the mean
lies.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from bayesid._io.files import write_json
from bayesid._math.arrays import Floats
from bayesid.inference.body_quantities import BODY_QUANTITIES, BodyDraws, body_dict
from bayesid.inference.identification import Identification
from bayesid.inference.posterior_as_prior import InertialDraws
from bayesid.robot.inertial_parameters import InertialParameters, mass_com_inertia
from bayesid.robot.robot import Robot

__all__ = ["identified_robot", "uncertainty", "write_identified"]


def identified_robot(result: Identification) -> Robot:
    """Return the robot with the posterior mean of every unknown body, marginalised ones included."""
    robot = result.posterior.model.robot
    for name, vectors in _draws(result).items():
        robot = robot.with_inertial(name, InertialParameters.from_vector(vectors.mean(axis=0)))
    return robot


def uncertainty(result: Identification) -> dict[str, Any]:
    """Return the mean, standard deviation and joint covariance of all unknown bodies, as in identification.json.

    The mean of a centre of mass or inertia differs from that of `identified_robot`, since neither is linear in the
    parameters that are averaged there; the difference is far below a standard deviation where the posterior is narrow.
    """
    bodies = {name: BodyDraws(name, mass_com_inertia(vectors)) for name, vectors in _draws(result).items()}
    values = np.concatenate([body.values for body in bodies.values()], axis=1)
    return {
        "bodies": {name: body_dict(body) for name, body in bodies.items()},
        "covariance": {
            "names": [f"{name}.{key}" for name in bodies for key in BODY_QUANTITIES],
            "matrix": np.cov(values.T).tolist(),
        },
    }


def write_identified(result: Identification, folder: Path) -> None:
    """Write ``identified.urdf`` and ``identified-uncertainty.json`` to a folder."""
    identified_robot(result).write_urdf(folder / "identified.urdf")
    write_json(folder / "identified-uncertainty.json", uncertainty(result))


def _draws(result: Identification) -> dict[str, Floats]:
    """Return the draws of the linear parameters of every unknown body, shape (draws, 10)."""
    draws = InertialDraws.of(result)
    return {name: draws.values[:, index] for index, name in enumerate(draws.names)}
