"""Posterior of one study as prior of the next, with a stated mass-property change in between.

A correlated Gaussian is fitted to the draws of all bodies in log-Cholesky coordinates about the bodies at the mean
coordinates. Fuel burnt, or a part released or taken on board, is subtracted from or added to the linear parameters of
each draw. Biases, initial rates and effects are left out, since they belong to their recordings.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bayesid._io.errors import InputError
from bayesid._io.files import write_json
from bayesid._math.arrays import Floats
from bayesid._math.on_device import on_device
from bayesid.inference.body_quantities import BODY_QUANTITIES, BodyDraws, body_dict
from bayesid.inference.posterior_file import SampledResult
from bayesid.robot.body_prior import BodyPrior, Mixing
from bayesid.robot.inertial_parameters import BASIS, BodyChange, InertialParameters, mass_com_inertia
from bayesid.robot.log_cholesky import log_cholesky_coordinates, log_cholesky_vector
from bayesid.robot.robot import Robot

__all__ = [
    "BodyChange",
    "InertialDraws",
    "JointPrior",
    "identified_robot",
    "joint_prior",
    "uncertainty",
    "write_identified",
]

DRAWS_PER_COORDINATE = 4
"""Smallest number of draws per coordinate from which a covariance is estimated."""

RECENTRED = 10
"""Largest number of iterations that move the centre to the mean; each leaves a small part of the offset."""


@dataclass(frozen=True)
class InertialDraws:
    """Draws of the inertial parameters of some bodies.

    Parameters
    ----------
    names : (B,) tuple of str
        Names of the bodies.
    values : (n, B, 10) array
        Draws of the linear parameters (`InertialParameters.vector`), in link axes.
    """

    names: tuple[str, ...]
    values: Floats

    @classmethod
    def of(cls, result: SampledResult) -> InertialDraws:
        """Return all draws of a result, marginalised bodies included."""
        names = tuple(prior.name for prior in result.posterior.model.priors)
        inertial = np.asarray(result.posterior.unknowns.values_of(result.chains.flat).inertial)
        return cls(names, inertial.reshape(len(inertial), len(names), 10))

    @classmethod
    def read(cls, file: Path) -> InertialDraws:
        """Return the draws that a ``posterior.nc`` holds.

        Raises
        ------
        InputError
            If the file is absent or holds no such draws.
        """
        from xarray import open_datatree  # imported here, since it takes a second that commands without samples save

        remedy = "Name the posterior.nc that bayesid identify wrote"
        if not file.is_file():
            raise InputError("there is no such file", file=file, remedy=remedy)
        try:
            data = open_datatree(file)
            inertial = data["posterior"]["inertial"]
            names = tuple(str(name) for name in inertial.coords["body"].values)
            values = np.array(inertial.transpose("chain", "draw", "body", "parameter").values, dtype=float)
            data.close()
        except (OSError, ValueError, KeyError, AttributeError) as error:
            raise InputError("it contains no draws of inertial parameters", file=file, remedy=remedy) from error
        return cls(names, values.reshape(-1, len(names), 10))

    def of_bodies(self, names: Sequence[str]) -> InertialDraws:
        """Return the draws of the named bodies, in the order of ``names``."""
        for name in names:
            if name not in self.names:
                raise InputError(
                    f"it contains no body {name!r}",
                    remedy=f"It contains {', '.join(self.names)}; omit {name!r}, or identify it first",
                )
        return InertialDraws(tuple(names), self.values[:, [self.names.index(name) for name in names]])

    def changed(self, change: BodyChange, rng: np.random.Generator) -> InertialDraws:
        """Return the draws after a mass-property change, whose uncertain mass is drawn for each of them.

        Parameters
        ----------
        change : BodyChange
        rng : numpy.random.Generator

        Raises
        ------
        InputError
            If a draw does not remain a physical body, or the body is not among the draws.
        """
        self.of_bodies([change.body])
        index = self.names.index(change.body)
        mass = change.mass + change.mass_sigma * rng.normal(size=len(self.values))
        values = self.values.copy()
        values[:, index] += (mass / change.mass)[:, None] * change.vector
        # 1e-12 is the rounding error of a body without extent
        relative = _pseudo(values[:, index]) / np.abs(_pseudo(self.values[:, index])).max(axis=(1, 2), keepdims=True)
        bad = int((np.linalg.eigvalsh(relative)[:, 0] <= 1e-12).sum())
        if bad:
            raise InputError(
                f"{change.body} is no longer a physical body in {bad} of {len(values)} draws after the change by "
                f"{change.mass:g} kg",
                remedy="More is removed than exists: correct mass, com, inertia or mass_sigma of the change",
            )
        return InertialDraws(self.names, values)


@dataclass(frozen=True)
class JointPrior:
    """Correlated Gaussian prior in the log-Cholesky coordinates of B bodies about their centres.

    Parameters
    ----------
    names : (B,) tuple of str
        Names of the bodies.
    centres : (B,) tuple of InertialParameters
        Bodies at which all coordinates are zero.
    covariance : (10 B, 10 B) array
        Covariance of the coordinates.
    """

    names: tuple[str, ...]
    centres: tuple[InertialParameters, ...]
    covariance: Floats

    def bodies(self, nuisance: Sequence[str] = ()) -> tuple[BodyPrior, ...]:
        """Return the priors of the bodies for `Model.priors`, of which those named in ``nuisance`` are marginalised."""
        widths = np.sqrt(np.diag(self.covariance).reshape(-1, 10).mean(axis=1))
        return tuple(
            BodyPrior(name, centre, float(width), nuisance=name in nuisance)
            for name, centre, width in zip(self.names, self.centres, widths, strict=True)
        )

    def mixing(self, others: Sequence[BodyPrior] = ()) -> Mixing:
        """Return the factor for `Model.mixing`, with other, independent bodies after those of this prior."""
        count = len(self.covariance)
        factor = np.diag(np.concatenate([np.zeros(count), np.repeat([body.spread for body in others], 10)]))
        factor[:count, :count] = np.linalg.cholesky(self.covariance)
        return tuple(tuple(float(value) for value in row) for row in factor)


def joint_prior(draws: InertialDraws) -> JointPrior:
    """Return the joint prior with the mean and covariance of the draws in log-Cholesky coordinates.

    Raises
    ------
    InputError
        If there are too few draws.
    """
    count, bodies = draws.values.shape[:2]
    if count < DRAWS_PER_COORDINATE * 10 * bodies:
        raise InputError(
            f"{count} draws are too few for the covariance of {10 * bodies} coordinates",
            remedy=f"Identify with more samples; {DRAWS_PER_COORDINATE * 10 * bodies} or more are required",
        )
    centres, coordinates = zip(*(_centred(draws.values[:, index]) for index in range(bodies)), strict=True)
    covariance = np.atleast_2d(np.cov(np.concatenate(coordinates, axis=1).T))
    return JointPrior(draws.names, centres, covariance)


def _centred(vectors: Floats) -> tuple[InertialParameters, Floats]:
    """Return the body at the mean of its coordinates, and the coordinates of all draws relative to it."""
    bodies = _pseudo(vectors)
    centre = InertialParameters.from_vector(vectors.mean(axis=0))
    for _ in range(RECENTRED):
        coordinates = log_cholesky_coordinates(centre.pseudo_inertia, bodies)
        mean = coordinates.mean(axis=0)
        if (np.abs(mean) < 1e-9 * coordinates.std(axis=0)).all():
            break
        centre = InertialParameters.from_vector(np.asarray(log_cholesky_vector(centre, on_device(mean))))
    return centre, log_cholesky_coordinates(centre.pseudo_inertia, bodies)


def _pseudo(vectors: Floats) -> Floats:
    return np.einsum("np,pij->nij", vectors, BASIS)


def identified_robot(result: SampledResult) -> Robot:
    """Return the robot with the posterior mean of every unknown body, marginalised ones included.

    It is the mean of the ten linear parameters. Pseudo-inertias of physical bodies form a convex cone, so that their
    mean is a physical body too (Wensing, Kim & Slotine 2018). The motion depends on ratios of sums that are linear in
    these parameters: the combinations that the data leave undetermined form a straight ridge, on which the mean lies.
    """
    robot = result.posterior.model.robot
    for name, vectors in _draws(result).items():
        robot = robot.with_inertial(name, InertialParameters.from_vector(vectors.mean(axis=0)))
    return robot


def uncertainty(result: SampledResult) -> dict[str, Any]:
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


def write_identified(result: SampledResult, folder: Path) -> None:
    """Write ``identified.urdf`` and ``identified-uncertainty.json`` to a folder.

    Parameters
    ----------
    result : Identification
    folder : Path
    """
    identified_robot(result).write_urdf(folder / "identified.urdf")
    write_json(folder / "identified-uncertainty.json", uncertainty(result))


def _draws(result: SampledResult) -> dict[str, Floats]:
    """Return the draws of the linear parameters of every unknown body, shape (draws, 10)."""
    draws = InertialDraws.of(result)
    return {name: draws.values[:, index] for index, name in enumerate(draws.names)}
