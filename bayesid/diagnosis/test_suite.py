"""The tests that decide whether a fit leaves nothing but noise: all candidates, disturbances, residual, variance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bayesid._math.arrays import Floats
from bayesid.diagnosis.fit_starts import start_coordinates
from bayesid.diagnosis.noise_tests import noise_tests
from bayesid.diagnosis.omnibus_tests import omnibus, variance_tests, vibrations
from bayesid.diagnosis.perturbed_fit import Engine, Fit
from bayesid.diagnosis.score_tests import Calibration, Score, score
from bayesid.simulation.effects.effect import Effect

__all__ = ["SuiteOutcome", "TestSuite"]

FALSE_ALARM = 0.01
"""Family-wise probability of an alarm where there is only noise."""


@dataclass(frozen=True)
class SuiteOutcome:
    """What the tests say of one fit.

    Attributes
    ----------
    scores : dict of str to Score
    log_p : dict of str to float
        Logarithms of all local p-values, tests of the noise included.
    p_value : float
        Family-wise, of the most significant.
    worst : str
        Which one that is.
    """

    scores: dict[str, Score]
    log_p: dict[str, float]
    p_value: float
    worst: str

    @property
    def adequate(self) -> bool:
        """Whether nothing but the declared noise is left."""
        return self.p_value >= FALSE_ALARM


class TestSuite:
    """Tests whose columns are computed once, about one fit, and applied to the residual of any other.

    A column need not be exact for its test to be valid: only what the fit has taken must be known, and that is the
    tested fit's own.
    """

    def __init__(self, engine: Engine, fit: Fit, effects: Sequence[Effect], seed: int) -> None:
        self.engine, self.seed = engine, seed
        data = engine.data_of(fit)
        self.effects: dict[str, Floats] = {}
        for effect in effects:
            if effect.modes_count:
                continue
            linear = effect.in_amplitudes()
            start = start_coordinates(linear, len(engine.posterior.manoeuvres))
            self.effects[effect.label] = engine.columns(linear, start, fit.operating, fit.z, data)
        self.vibrations = vibrations(engine, fit)
        self.others = omnibus(engine, fit)
        self.others |= {f"vibration at {f:g} Hz": columns for f, columns in self.vibrations.items()}
        outcome_scores = self._scores(fit)
        self.calibration = Calibration(list(outcome_scores.values()), fit, len(self._noise(fit)), seed)

    def outcome(self, fit: Fit) -> SuiteOutcome:
        """Test a fit."""
        scores = self._scores(fit)
        log_p = {name: item.log_p for name, item in scores.items()} | self._noise(fit)
        worst = min(log_p, key=lambda name: log_p[name])
        return SuiteOutcome(scores, log_p, self.calibration.adjusted(log_p[worst]), worst)

    def _scores(self, fit: Fit) -> dict[str, Score]:
        present = {effect.label for effect in fit.effects}
        columns = {name: value for name, value in self.effects.items() if name not in present} | self.others
        return {name: score(name, value, fit) for name, value in columns.items()}

    def _noise(self, fit: Fit) -> dict[str, float]:
        return variance_tests(self.engine, fit) | noise_tests(self.engine.posterior, fit)
