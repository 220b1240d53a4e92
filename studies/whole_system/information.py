"""What a manoeuvre and its sensors teach beyond the drawings: the information about the truth, linearised.

One Jacobian per manoeuvre, with all sensors, serves every question. The whitening conditions every sensor on those
before it, so that later ones may be left out exactly; a body is known exactly where its columns are left out; another
prior rescales them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cached_property

import numpy as np

from bayesid import Manoeuvre, Posterior, Robot
from bayesid._math.arrays import Floats
from bayesid.identifiability.local_knowledge import Knowledge
from bayesid.inference.noise_changes import with_manoeuvres
from bayesid.robot.inertial_parameters import PARAMETERS
from studies.whole_system.setting import bodies, model_of, spreads

__all__ = ["Information", "Known", "Sensors", "informed"]


class Sensors(Enum):
    """Sensors in use, each with its title and the number of columns of the whitened residual that they fill."""

    RATE = ("star sensor's rate", 3)
    MOTION = ("rate and accelerometer", 6)
    TORQUES = ("rate, accelerometer, joint torques", None)


@dataclass(frozen=True)
class Known:
    """Knowledge of the bodies after a manoeuvre, in coordinates whose prior is standard normal."""

    robot: Robot  # robot about which the posterior was linearised
    names: tuple[str, ...]  # names of the unknown bodies, whose ten coordinates each come first
    widths: Mapping[str, float]  # width of every body's prior
    covariance: Floats  # (n, n): posterior covariance of the coordinates

    def mass(self, *members: str) -> tuple[float, float]:
        """Return the relative standard deviation of the sum of some bodies' masses, prior and posterior."""
        slope = np.zeros(len(self.covariance))
        total = sum(self.robot.link(name).inertial.mass for name in members)
        for index, name in enumerate(self.names):
            if name in members:  # the mass goes with the square of the scale exp(alpha)
                slope[PARAMETERS * index] = 2.0 * self.widths[name] * self.robot.link(name).inertial.mass / total
        return float(np.linalg.norm(slope)), float(np.sqrt(slope @ self.covariance @ slope))

    def shrinkage(self, name: str) -> Floats:
        """Return one minus the ratio of posterior to prior width of the ten coordinates of a body, shape (10,)."""
        first = PARAMETERS * self.names.index(name)
        return 1.0 - np.sqrt(np.diag(self.covariance)[first : first + PARAMETERS])

    @cached_property
    def directions(self) -> Floats:
        """Ratios of posterior to prior width along the independent directions of the coordinates, ascending."""
        count = PARAMETERS * len(self.names)
        return np.sqrt(np.clip(np.linalg.eigvalsh(self.covariance[:count, :count]), 0.0, None))

    @property
    def contraction(self) -> int:
        """Number of directions that the data narrowed to less than half of the prior."""
        return int((self.directions < 0.5).sum())


@dataclass(frozen=True)
class Information:
    """Information of a manoeuvre with all sensors."""

    robot: Robot  # true robot, about which the posterior was linearised
    jacobian: Floats  # (rows, columns, n): Jacobian of the whitened residuals

    def knowledge(
        self, sensors: Sensors, *, known: Sequence[str] = (), widths: Mapping[str, float] | None = None
    ) -> Known:
        """Return the knowledge after the manoeuvre.

        Parameters
        ----------
        sensors : Sensors
            Sensors in use.
        known : sequence of str
            Names of bodies that are taken as exactly known.
        widths : mapping of str to float, optional
            Widths of the bodies' priors in place of those of the drawings.
        """
        designed = spreads(self.robot)
        wanted = designed if widths is None else widths
        names = bodies(self.robot)
        size = self.jacobian.shape[-1]
        scale = np.ones(size)
        scale[: PARAMETERS * len(names)] = np.repeat([wanted[name] / designed[name] for name in names], PARAMETERS)
        rows = self.jacobian[:, : sensors.value[1]].reshape(-1, size) * scale
        exact = [PARAMETERS * i + k for i, name in enumerate(names) if name in known for k in range(PARAMETERS)]
        after = Knowledge((), np.zeros(0), np.zeros((0, size)), np.concatenate([rows, np.eye(size)])).fixing(exact)
        return Known(self.robot, tuple(name for name in names if name not in known), wanted, after.coordinates)


def informed(truth: Robot, manoeuvres: Mapping[str, Manoeuvre]) -> dict[str, Information]:
    """Linearise each manoeuvre of the true robot about the truth."""
    linearised: dict[str, Information] = {}
    like = Posterior.of(model_of(truth, torques=True), [next(iter(manoeuvres.values()))])
    for name, manoeuvre in manoeuvres.items():
        posterior = with_manoeuvres(like, [manoeuvre])  # shares what is compiled
        jacobian = posterior.jacobian(posterior.starting_point())[: -posterior.size]
        linearised[name] = Information(truth, jacobian.reshape(-1, posterior.residual_shape[2], posterior.size))
    return linearised
