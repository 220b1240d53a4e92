"""Periods and events in a residual: their false alarms and their power."""

import numpy as np
import pytest

from bayesid.diagnosis.noise.family_alarm import log_p_of_a_period, log_p_of_an_event


def _noise(rng: np.random.Generator, recordings: int = 3) -> list[tuple[np.ndarray, np.ndarray]]:
    """White residuals of sensors with gaps, (times, residuals) of each recording."""
    found = []
    for _ in range(recordings):
        time = np.arange(240) * 0.5 + rng.uniform(-0.1, 0.1, 240)
        kept = rng.uniform(size=240) > 0.2
        found.append((time[kept], rng.normal(size=(int(kept.sum()), 3))))
    return found


@pytest.mark.parametrize("test", ["period", "event"])
def test_white_noise_is_seldom_taken_for_a_course(test) -> None:
    """The p-value counts every trial of a frequency or stretch, so that it is too large rather than too small."""
    rng = np.random.default_rng(3)
    found = []
    for _ in range(200):
        pieces = _noise(rng)
        log_p = log_p_of_a_period(pieces) if test == "period" else log_p_of_an_event([own for _, own in pieces])
        found.append(np.exp(log_p))
    below = np.array([(np.array(found) <= level).mean() for level in (0.01, 0.05, 0.2)])
    most = np.array([0.01, 0.05, 0.2])
    assert (below <= most + 3.0 * np.sqrt(most * (1.0 - most) / 200)).all()
    assert below[-1] > 0.03  # it is no test that never fails


def test_a_period_of_no_cosine_of_the_grid_is_seen() -> None:
    """A wave with a phase of its own in every recording and axis, of 9 sd altogether."""
    rng = np.random.default_rng(4)
    seen = []
    for _ in range(20):
        pieces = _noise(rng)
        size = 9.0 / np.sqrt(0.5 * 9 * len(pieces[0][0]))
        seen.append(
            log_p_of_a_period(
                [
                    (time, own + size * np.sin(2.0 * np.pi * 0.0537 * time[:, None] + rng.uniform(0.0, 6.28, 3)))
                    for time, own in pieces
                ]
            )
        )
    assert np.mean(np.array(seen) < np.log(1e-3)) >= 0.9


def test_an_event_is_seen_where_it_is() -> None:
    """A shift of 20 samples about one axis, of 8 sd altogether."""
    rng = np.random.default_rng(5)
    seen = []
    for _ in range(20):
        residuals = [own for _, own in _noise(rng)]
        residuals[1][70:90] += 8.0 / np.sqrt(20.0) * np.array([0.6, 0.0, -0.8])
        seen.append(log_p_of_an_event(residuals))
    assert np.mean(np.array(seen) < np.log(1e-3)) >= 0.9


def test_one_sample_is_no_period() -> None:
    assert log_p_of_a_period([(np.arange(50.0), np.zeros((50, 3)))]) == 0.0
