"""Base parameters of an arm on a fixed base by FIGAROH, a toolbox that is built on Pinocchio too, and by its rank."""

from __future__ import annotations

import importlib.util
import warnings
from dataclasses import dataclass
from importlib.metadata import version
from types import SimpleNamespace

import numpy as np
import pinocchio as pin
from scipy.linalg import subspace_angles

from bayesid import Robot
from bayesid._math.arrays import Floats
from bayesid.identifiability import Base, base_parameters, standard_names
from bayesid.identifiability.base_parameters import GRAVITY

STATES = 80  # number of random states, many more than the parameters need

# statement in place of FIGAROH's version
ABSENT = "is not evaluated, since it is not installed (the extra peers brings it)"


@dataclass(frozen=True)
class Comparison:
    """Numbers of base parameters, and how far the two tools' spaces of them are apart."""

    robot: str  # name of the robot
    gravity: tuple[float, float, float]  # gravity on the fixed base, base axes [m/s2]
    # number by this package, rank of Pinocchio's regressor, and number by FIGAROH
    count: int
    rank: int
    peer: int | None
    tool: str  # FIGAROH and its version, or why it was not run
    # largest angle between the rows that take standard to base parameters, this package's and FIGAROH's [rad]
    angle: float | None


def compare(robot: Robot, rng: np.random.Generator, gravity: tuple[float, float, float] = GRAVITY) -> Comparison:
    """Compare the base parameters of an arm bolted to the ground; each link is fixed on a separate joint."""
    base = base_parameters(robot, base=Base.FIXED, gravity=gravity)
    model = pin.buildModelFromXML(robot.urdf)
    model.gravity.linear = np.array(gravity)
    q = rng.uniform(-np.pi, np.pi, size=(STATES, model.nq))
    v, a = rng.normal(size=(2, STATES, model.nv))
    data = model.createData()
    rows = np.concatenate(
        [
            np.atleast_2d(pin.computeJointTorqueRegressor(model, data, *state)).copy()
            for state in zip(q, v, a, strict=True)
        ]
    )
    length = np.linalg.norm(rows, axis=0)
    rank = int(np.linalg.matrix_rank(rows / np.where(length > 0.0, length, 1.0), tol=1e-9))
    if importlib.util.find_spec("figaroh") is None:
        return Comparison(robot.name, gravity, base.count, rank, None, ABSENT, None)
    links = [next(name for name, link in robot.links.items() if link.joint == k) for k in range(len(robot.joints))]
    names = standard_names(links)
    peer = _figaroh(model, q, v, a, names)
    projection = base.projection[:, [base.standard.index(name) for name in names]]
    angle = float(subspace_angles(peer.T, projection.T).max()) if peer.shape == projection.shape else None
    return Comparison(robot.name, gravity, base.count, rank, len(peer), f"FIGAROH {version('figaroh')}", angle)


def _figaroh(model: pin.Model, q: Floats, v: Floats, a: Floats, names: tuple[str, ...]) -> Floats:
    """Return FIGAROH's matrix that takes the standard parameters of the links to base parameters."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # its libraries warn as they are imported
        from figaroh.tools.qrdecomposition import QRDecomposer
        from figaroh.tools.regressor import RegressorBuilder, eliminate_non_dynaffect

    robot = SimpleNamespace(model=model, data=model.createData())
    regressor = RegressorBuilder(robot).build_basic_regressor(q, v, a, {"act_idxv": []})
    reduced, kept = eliminate_non_dynaffect(regressor, dict.fromkeys(names, 0.0))
    mapping = QRDecomposer().decompose(reduced, kept).M
    full = np.zeros((len(mapping), len(names)))
    full[:, [names.index(name) for name in kept]] = mapping
    return full
