"""What kinds of causes do in Gram space and at the start of a fit, on small problems without a simulation."""

from __future__ import annotations

from itertools import combinations
from types import SimpleNamespace

import numpy as np
import pytest

from bayesid.diagnosis.candidates import instant_cause, vibration_cause
from bayesid.diagnosis.candidates.instant_cause import InstantCause
from bayesid.diagnosis.candidates.linear_cause import LinearCause
from bayesid.diagnosis.candidates.vibration_cause import DAMPING, FREQUENCIES, VibrationCause
from bayesid.diagnosis.evidence.gram import Gram
from bayesid.diagnosis.evidence.scales import AmplitudeGroup
from bayesid.simulation.effects import create


def test_cells_of_the_grid_cover_all_frequencies_once():
    edges = [vibration_cause._edges(cell) for cell in range(len(FREQUENCIES))]
    for (low, high), (other, _), frequency in zip(edges, edges[1:], FREQUENCIES, strict=False):
        assert low < np.log(frequency) < high == pytest.approx(other)
    scan = vibration_cause._scan(3)
    steps = np.diff(scan)
    assert steps == pytest.approx(steps[0])
    assert steps[0] <= vibration_cause.RESONANCE
    assert edges[3][0] == pytest.approx(scan[0] - 0.5 * steps[0])


def test_tones_tried_share_the_prior_of_the_cells_that_were_scanned():
    scan = vibration_cause._scan(3)
    tones = {(float(np.exp(log)), DAMPING) for log in scan}
    tones |= {(float(np.exp(scan[2] + 0.003)), DAMPING), (float(np.exp(scan[2] + 0.001)), 0.003)}
    shares = vibration_cause._shares(scan, dict.fromkeys(tones))
    assert sum(shares.values()) == pytest.approx(1.0, abs=1e-5)
    assert min(shares.values()) > 0.0
    untouched = [shares[float(np.exp(log)), DAMPING] for log in scan[4:]]
    assert untouched == pytest.approx([1.0 / len(scan)] * len(untouched))
    assert shares[float(np.exp(scan[2] + 0.001)), 0.003] == pytest.approx(0.5 / len(scan))  # alone at its damping


def test_instants_about_one_stay_within_the_recording_and_hold_it():
    found = instant_cause._around(1.0, 2.0, 30.0)
    assert found[0] == 0.0
    assert 1.0 in found
    assert found == sorted(set(found))
    assert instant_cause._around(None, 2.0, 30.0) == []


def test_the_same_amplitudes_in_two_recordings_are_weighed_by_the_sum_of_their_information():
    gram = Gram(np.diag([4.0, 4.0]), np.array([-6.0, -6.0]), {"0,0": np.array([0]), "1,0": np.array([1])})
    group = AmplitudeGroup("step", 10.0)
    single = instant_cause._weighed(gram, group, [0, None], [1, 1])
    both = instant_cause._weighed(gram, group, [0, 0], [1, 1])
    assert instant_cause._weighed(gram, group, [None, None], [1, 1]) == 0.0
    assert both > single > 0.0
    assert instant_cause._weighed(gram, group, [0, 0], [5, 7]) == pytest.approx(both - np.log(35.0))


def test_all_choices_of_instants_share_their_part_of_the_prior():
    samples = [3, 4, 2]
    each = [
        instant_cause._share(chosen, len(samples)) * np.prod(chosen)
        for count in (1, 2, 3)
        for chosen in combinations(samples, count)
    ]
    assert sum(each) == pytest.approx(instant_cause.SHARE)


def test_a_time_that_may_be_anywhere_has_the_deviation_of_a_uniform_one():
    times = np.arange(10.0, 17.0, 0.5)
    mean, sd = instant_cause._mean_and_sd(np.full(len(times), 1.0 / len(times)), times, 0.5)
    assert mean == pytest.approx(times.mean())
    assert sd == pytest.approx(0.5 * len(times) / np.sqrt(12.0))


class Point(SimpleNamespace):
    """Means of amplitudes in place of a linear model."""

    def mean_amplitudes(self, label, names):
        return self.means


def test_a_linear_fit_starts_at_the_mean_amplitudes_in_prior_deviations():
    effect = create("wheel-momentum")
    (start,) = LinearCause().starts(effect, Point(means=np.array([0.5, -1.0, 2.0])), [effect.label])
    assert start == pytest.approx([0.5, -1.0, 2.0])  # the priors are 1 N m s
    (start,) = InstantCause().starts(create("mass-shift"), Point(means=np.arange(9.0)), ["mass-shift"])
    assert start == pytest.approx(np.arange(9.0))


def test_a_vibration_starts_at_its_tone_where_the_base_does_not_yield():
    effect = create("flexible-appendage")
    coupling = np.array([0.0, 0.0, 0.0, 3.0, 0.0, 0.0])
    entries = np.array([coupling[i] * coupling[j] for i, j in vibration_cause.PAIRS])
    vibration = SimpleNamespace(compliance=np.zeros((1, 1, 6, 6)))
    point = Point(means=entries, fit=SimpleNamespace(operating=SimpleNamespace(vibration=vibration)))
    point.most_probable_form = lambda label, names: SimpleNamespace(tone=(0.3, 0.02))
    (start,) = VibrationCause().starts(effect, point, [effect.label])
    values = [parameter.value(np.asarray(z)) for parameter, z in zip(effect.parameters, start, strict=True)]
    assert values[:2] == pytest.approx([0.3, 0.02])
    assert np.abs(values[2:]) == pytest.approx(coupling, abs=1e-12)
