"""Update of the knowledge by a flown manoeuvre: identification, and the posterior as prior of the next manoeuvre."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.design.design_problem import Known
from bayesid.inference.body_quantities import BODY_QUANTITIES, BodyDraws, quantity
from bayesid.inference.identification import Identification, identify
from bayesid.inference.mode import maximise
from bayesid.inference.posterior import Posterior
from bayesid.inference.posterior_as_prior import InertialDraws, joint_prior
from bayesid.inference.posterior_file import write_draws, write_netcdf
from bayesid.inference.unknowns import Unknowns
from bayesid.robot.inertial_parameters import BASIS, mass_com_inertia
from bayesid.robot.log_cholesky import log_cholesky_coordinates
from bayesid.simulation.model import Model

__all__ = [
    "Identifier",
    "Laplace",
    "Sampled",
    "bodies_of_draws",
    "describe_bodies",
    "known_of",
    "updated_model",
    "worst_relative_sd",
]


class Identifier(Protocol):
    """Method of the identification inside the loop."""

    def identify(self, posterior: Posterior, seed: int, file: Path) -> dict[str, Any]:
        """Write draws to a file that `InertialDraws.read` reads, and return the entry of the fit for loop.json.

        Parameters
        ----------
        posterior : Posterior
            Posterior of all recordings so far.
        seed : int
            Seed of all random numbers.
        file : Path
            File of the draws.
        """
        ...


@dataclass(frozen=True)
class Sampled:
    """Identification by emcee, as in ``bayesid identify``; an interrupted run continues from its samples.

    Parameters
    ----------
    effective_samples : float
        Number of effective samples at which emcee stops.
    max_steps : int
        Largest number of steps.
    """

    effective_samples: float = 2000.0
    max_steps: int = 3000

    def identify(self, posterior: Posterior, seed: int, file: Path) -> dict[str, Any]:
        """Write draws as the ``posterior.nc`` of ``bayesid identify``, and return the entry of the fit."""
        samples = file.with_suffix(".samples.h5")
        result: Identification = identify(
            posterior, seed, effective_samples=self.effective_samples, max_steps=self.max_steps, file=samples
        )
        write_netcdf(result, file, np.random.default_rng(seed))
        samples.unlink(missing_ok=True)
        return {
            "method": "emcee",
            "chi2": result.optimum.chi2,
            "samples": posterior.samples,
            "pareto_k": result.evidence.pareto_k,
            "disagreements": list(result.disagreements),
        }


@dataclass(frozen=True)
class Laplace:
    """Identification by the normal approximation about the mode.

    It takes seconds, and is accurate where the data determine every body sharply.

    Parameters
    ----------
    draws : int
        Number of draws to write. The next step's prior is made of them: 4,000 lose up to 5 % of some widths there.
    """

    draws: int = 40_000

    def identify(self, posterior: Posterior, seed: int, file: Path) -> dict[str, Any]:
        """Write draws of the bodies alone, and return the entry of the fit."""
        starts, normal = np.random.SeedSequence(seed).spawn(2)
        refined, optimum = maximise(posterior, np.random.default_rng(starts))
        noise = np.random.default_rng(normal).normal(size=(self.draws, posterior.size))
        z = optimum.z + noise @ np.linalg.cholesky(optimum.covariance).T
        names = [prior.name for prior in posterior.model.priors]
        values = np.asarray(refined.unknowns.values_of(z).inertial).reshape(1, self.draws, len(names), 10)
        write_draws(names, values, file)
        return {"method": "laplace", "chi2": optimum.chi2, "samples": posterior.samples, "disagreements": []}


def updated_model(model: Model, draws: InertialDraws) -> Model:
    """Return the model with draws of all its uncertain bodies as their joint prior.

    Parameters
    ----------
    model : Model
        Model of the step.
    draws : InertialDraws
        Draws of all its uncertain bodies.
    """
    names = [prior.name for prior in model.priors]
    prior = joint_prior(draws.of_bodies(names))
    robot = model.robot
    for name, centre in zip(prior.names, prior.centres, strict=True):
        robot = robot.with_inertial(name, centre)
    nuisance = [body.name for body in model.priors if body.nuisance]
    return replace(model, robot=robot, priors=prior.bodies(nuisance), mixing=prior.mixing())


def known_of(unknowns: Unknowns, draws: InertialDraws) -> Known:
    """Return the normal distribution of a plan's coordinates that fits draws of all uncertain bodies.

    Parameters
    ----------
    unknowns : Unknowns
        Unknowns of the plan.
    draws : InertialDraws
        Draws of all its uncertain bodies.
    """
    values = draws.of_bodies([body.name for body in unknowns.bodies]).values
    parts = [
        log_cholesky_coordinates(body.centre.pseudo_inertia, np.einsum("np,pij->nij", values[:, index], BASIS))
        for index, body in enumerate(unknowns.bodies)
    ]
    z = np.linalg.solve(unknowns.widths, np.concatenate(parts, axis=1).T)
    centre, precision, count = np.zeros(unknowns.size), np.eye(unknowns.size), len(z)
    centre[:count], precision[:count, :count] = z.mean(axis=1), np.linalg.inv(np.cov(z))
    return Known(centre, precision)


def bodies_of_draws(model: Model, draws: InertialDraws) -> dict[str, BodyDraws]:
    """Return the draws of the reported quantities, by the name of the body to identify.

    Parameters
    ----------
    model : Model
        Model that names the bodies to identify.
    draws : InertialDraws
        Draws that contain these bodies.
    """
    names = [prior.name for prior in model.bodies]
    values = draws.of_bodies(names).values
    return {name: BodyDraws(name, mass_com_inertia(values[:, index])) for index, name in enumerate(names)}


def worst_relative_sd(bodies: Mapping[str, BodyDraws]) -> float:
    """Return the largest standard deviation of a mass or a principal moment of inertia, relative to its mean."""
    if not bodies:
        raise InputError("nothing is unknown", place="unknowns.bodies", remedy="Name a body to identify")
    return max(float(np.max(_relative_sd(body.values))) for body in bodies.values())


def _relative_sd(values: Floats) -> Floats:
    """Return the relative standard deviations (4,) of mass and principal moments of inertia, from draws (n, 10)."""
    xx, yy, zz, xy, xz, yz = values[:, 4:].T
    tensors = np.stack([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]).transpose(2, 0, 1)
    positive = np.column_stack([values[:, 0], np.linalg.eigvalsh(tensors)])
    return positive.std(axis=0, ddof=1) / positive.mean(axis=0)


def describe_bodies(bodies: Mapping[str, BodyDraws]) -> dict[str, Any]:
    """Return mean and standard deviation of every quantity as a JSON object, by body and name."""
    return {
        name: {
            key: quantity(mean, sd, unit)
            for (key, unit), mean, sd in zip(BODY_QUANTITIES.items(), body.mean, body.sd, strict=True)
        }
        for name, body in bodies.items()
    }
