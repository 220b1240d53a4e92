"""What a set of causes at its most probable scales leaves of the residual, and of further signatures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.diagnosis.evidence.gram import GaussianBlock, Gram
from bayesid.diagnosis.search.linearisation import Linearisation, amplitudes_at
from bayesid.inference.residual_view import rows_of

__all__ = ["LeftBeside"]


@dataclass(frozen=True)
class LeftBeside:
    """A linear model with a set of causes, beside which signatures that are in no bank are weighed.

    Attributes
    ----------
    residual : (N,) array
        Whitened, at the mode of the model's unknowns and the causes' amplitudes.
    basis : (N, m) array
        Such that the information on further columns ``T`` is ``T'T`` less the products of ``basis' T``.
    """

    residual: Floats
    basis: Floats

    @staticmethod
    def of(point: Linearisation, names: Sequence[str], forms: Mapping[str, int]) -> LeftBeside:
        """Return what a set of causes leaves.

        Parameters
        ----------
        point : Linearisation
        names : sequence of str
            Causes of the set, generic ones among them.
        forms : mapping of str to int
            Form of each.
        """
        evidence, fit = point.evidence, point.fit
        shift = -amplitudes_at(fit, evidence.gram)  # the fit may hold effects, which are no part of the set by that
        for name in names:
            if evidence.causes[name].fixed:
                shift[evidence.gram.groups[evidence.causes[name].groups[0].name]] += 1.0
        held, deviations = evidence.most_probable(names, forms)
        scale = np.zeros(len(shift))
        scale[held] = deviations
        place = np.full(len(shift), -1)
        place[held] = np.arange(len(held))
        residual, scaled = fit.residual.copy(), np.zeros((len(fit.residual), len(held)))
        first = dict.fromkeys(evidence.gram.groups, 0)
        for item in point.bank.signatures:
            columns = slice(first[item.name], first[item.name] + item.columns.shape[1])
            where, first[item.name] = evidence.gram.groups[item.name][columns], columns.stop
            chosen = place[where] >= 0
            if not (chosen.any() or shift[where].any()):
                continue
            own = slice(None) if item.recording is None else rows_of(fit.posterior, item.recording)
            residual[own] += item.columns @ shift[where]
            scaled[own, place[where][chosen]] = item.columns[:, chosen] * scale[where][chosen]
        whole = np.concatenate([fit.own, scaled], axis=1)
        block = GaussianBlock.of(whole.T @ whole)
        basis = block.share(whole.T).T
        pull = np.concatenate([fit.own_coordinates, np.zeros(len(held))])
        moved = basis.T @ residual + block.share(pull)
        return LeftBeside(residual - basis @ moved, basis)

    def gram(self, columns: Floats, name: str) -> Gram:
        """Return the Gram of one group of further columns (N, k) after the set has taken its share."""
        shared = self.basis.T @ columns
        matrix = columns.T @ columns - shared.T @ shared
        return Gram(matrix, columns.T @ self.residual, {name: np.arange(columns.shape[1])})
