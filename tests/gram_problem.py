"""Small linear problems whose evidence can be written out densely."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from bayesid.diagnosis.evidence.gram import Gram

__all__ = ["LinearProblem"]


@dataclass
class LinearProblem:
    """Residuals ``data + X z + S a`` with unknowns ``z`` of unit prior; with the true ones they are white noise."""

    fitted: np.ndarray
    columns: dict[str, np.ndarray]
    data: np.ndarray = field(default_factory=lambda: np.zeros(0))

    @staticmethod
    def random(rng: np.random.Generator, sizes: dict[str, int], samples: int = 30, unknowns: int = 4) -> LinearProblem:
        fitted = rng.normal(size=(samples, unknowns))
        columns = {name: rng.normal(size=(samples, size)) + 0.5 * fitted[:, :1] for name, size in sizes.items()}
        return LinearProblem(fitted, columns)

    def observed(self, rng: np.random.Generator, amplitudes: dict[str, np.ndarray] | None = None) -> LinearProblem:
        """Data with unknowns and noise drawn, and given amplitudes."""
        data = rng.normal(size=len(self.fitted)) - self.fitted @ rng.normal(size=self.fitted.shape[1])
        for name, a in (amplitudes or {}).items():
            data = data - self.columns[name] @ a
        return LinearProblem(self.fitted, self.columns, data)

    @property
    def mode(self) -> np.ndarray:
        """Unknowns at the mode."""
        n = self.fitted.shape[1]
        return -np.linalg.solve(self.fitted.T @ self.fitted + np.eye(n), self.fitted.T @ self.data)

    def gram(self) -> Gram:
        """Gram at the mode."""
        return Gram.of(self.columns, self.data + self.fitted @ self.mode, self.fitted)

    def log_density(self, variances: dict[str, np.ndarray]) -> float:
        """Dense log density of the data, with some amplitudes normal with the given variances."""
        covariance = np.eye(len(self.data)) + self.fitted @ self.fitted.T
        for name, own in variances.items():
            covariance = covariance + (self.columns[name] * own) @ self.columns[name].T
        log_det = np.linalg.slogdet(covariance)[1]
        return float(-0.5 * log_det - 0.5 * self.data @ np.linalg.solve(covariance, self.data))
