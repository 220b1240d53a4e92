"""Results as a user has them: quantities by name, ArviZ's groups, an identified URDF, short forms."""

from __future__ import annotations

import numpy as np
import pytest

from bayesid import Identification, PosteriorDraws, Robot
from bayesid._io.short_form import ShortForm, Summary, format_probability, format_spread
from bayesid.inference.body_quantities import BODY_QUANTITIES, body_dict
from bayesid.inference.importance import Evidence
from bayesid.inference.mode import Optimum
from bayesid.inference.posterior_as_prior import InertialDraws
from bayesid.inference.posterior_file import write_netcdf
from bayesid.inference.sampler import chains_of
from bayesid.robot.inertial_parameters import mass_com_inertia

DRAWS = 400


@pytest.fixture(scope="module")
def result(planar_case) -> Identification:
    """Draws about the starting point, which nobody sampled."""
    posterior, rng = planar_case.posterior, np.random.default_rng(3)
    z = posterior.starting_point() + 0.01 * rng.normal(size=(DRAWS, posterior.size))
    optimum = Optimum(z.mean(axis=0), np.cov(z.T), 100.0, 50.0, 1, True)
    evidence = Evidence(-3.0, 0.1, 0.2, 400.0, 400, z.mean(axis=0), z.std(axis=0))
    return Identification(posterior, optimum, evidence, chains_of(posterior, PosteriorDraws(z), rng, 100.0), 1.0)


def test_quantities_have_names_units_and_moments(result):
    body = result.bodies["base_link"]
    columns = [body.mass, *body.com, *body.inertia]
    assert [quantity.unit for quantity in columns] == list(BODY_QUANTITIES.values())
    np.testing.assert_allclose([quantity.mean for quantity in columns], body.mean, rtol=1e-12)
    np.testing.assert_allclose([quantity.sd for quantity in columns], body.sd, rtol=1e-12)
    np.testing.assert_array_equal(body.inertia.xz.draws, body.values[:, 8])
    low, high = body.com.x.interval(0.5)
    assert np.mean((body.com.x.draws > low) & (body.com.x.draws < high)) == pytest.approx(0.5, abs=0.01)
    written = result.to_dict()["bodies"]["base_link"]
    assert written == body_dict(body)
    assert written["inertia"]["yy"] == {"mean": body.inertia.yy.mean, "sd": body.inertia.yy.sd, "unit": "kg m2"}


def test_the_identified_urdf_has_the_mean_of_the_linear_parameters(result, tmp_path):
    result.to_urdf(tmp_path / "identified.urdf")
    read, given = Robot.from_urdf(tmp_path / "identified.urdf"), result.posterior.model.robot
    inertial = np.asarray(result.posterior.unknowns.values_of(result.chains.flat).inertial)
    np.testing.assert_allclose(read.link("base_link").inertial.vector, inertial.mean(axis=0), rtol=1e-9, atol=1e-12)
    assert not np.allclose(read.link("base_link").inertial.vector, given.link("base_link").inertial.vector, rtol=1e-4)
    np.testing.assert_allclose(read.link("link1").inertial.vector, given.link("link1").inertial.vector, rtol=1e-9)


def test_the_data_tree_has_the_groups_of_arviz(result):
    tree = result.to_datatree(seed=1)
    groups = ("posterior", "prior", "sample_stats", "log_likelihood", "posterior_predictive", "observed_data")
    assert set(groups) <= set(tree.children)
    posterior, chains = tree["posterior"], result.chains
    assert dict(posterior["z"].sizes) == {"chain": 4, "draw": DRAWS // 4, "unknown": result.posterior.size}
    np.testing.assert_array_equal(posterior["base_link.mass"].values.ravel(), result.bodies["base_link"].mass.draws)
    np.testing.assert_allclose(tree["sample_stats"]["lp"].values, chains.log_density, rtol=1e-12)
    assert tree["prior"]["base_link.mass"].attrs["unit"] == posterior["base_link.mass"].attrs["unit"] == "kg"
    assert float(tree["prior"]["z"].std()) == pytest.approx(1.0, abs=0.03)
    assert tree["posterior_predictive"]["rate.planar"].dims[-1] == tree["observed_data"]["rate.planar"].dims[-1]


def test_a_file_of_draws_is_read_as_it_was_written(result, tmp_path):
    write_netcdf(result, tmp_path / "posterior.nc", np.random.default_rng(0))
    draws = InertialDraws.read(tmp_path / "posterior.nc").of_bodies(["base_link"]).values
    expected = result.bodies["base_link"]
    np.testing.assert_allclose(mass_com_inertia(draws[:, 0]), expected.values, rtol=1e-9, atol=1e-12)


def test_a_result_is_shown_by_a_few_lines(result):
    text, html = repr(result), result._repr_html_()
    assert text == str(result)
    assert len(text) < 3000
    mass = result.bodies["base_link"].mass
    assert any(line.startswith("base_link.mass ") and line.endswith(str(mass)) for line in text.splitlines())
    assert html.count("<tr>") == 1 + len(BODY_QUANTITIES)
    assert f"<td>base_link.mass</td><td>{mass}</td>" in html
    assert all(sentence in text for sentence in result.disagreements)


def test_what_a_model_is_made_of_is_shown_by_its_names_and_not_by_its_numbers(planar_case):
    posterior = planar_case.posterior
    manoeuvre = posterior.manoeuvres[0]
    model = posterior.model
    parts = {"posterior": posterior, "model": model, "robot": model.robot, "manoeuvre": manoeuvre}
    shown = {name: repr(part) for name, part in parts.items()}
    assert all(len(text) < 600 for text in shown.values()), shown
    assert f"{posterior.samples} samples, {posterior.size} unknowns." in shown["posterior"]
    assert "base base_link, joints joint1, joint2" in shown["robot"]
    assert f"{shown['robot']}\nSensors: " in shown["model"]
    assert "Bodies to identify: base_link." in shown["model"]
    assert shown["manoeuvre"] == repr(manoeuvre.recording)
    assert f"{len(manoeuvre.recording.time)} samples over" in shown["manoeuvre"]


def test_short_forms_are_safe_and_aligned():
    class Shown(ShortForm):
        def summary(self) -> Summary:
            return Summary(["a < b"], ("name", "value"), [("x & y", "1"), ("z", "22")])

    assert str(Shown()) == "a < b\nname   value\nx & y  1\nz      22"
    assert "<p>a &lt; b</p>" in Shown()._repr_html_()
    assert "<td>x &amp; y</td>" in Shown()._repr_html_()


@pytest.mark.parametrize(
    ("mean", "sd", "unit", "text"),
    [
        (553.0217, 0.1446, "kg", "553.02 ± 0.14 kg"),
        (-1.234e-7, 3.3e-9, "N m s", "-1.23e-07 ± 3.3e-09 N m s"),
        (12345.6, 234.0, "kg m2", "1.23e+04 ± 2.3e+02 kg m2"),
        (0.5, 0.02, "1", "0.500 ± 0.020"),
        (2.0, 0.0, "m", "2.000 ± 0.000 m"),
    ],
)
def test_a_mean_has_the_decimals_of_its_standard_deviation(mean, sd, unit, text):
    assert format_spread(mean, sd, unit) == text


def test_a_probability_is_never_rounded_to_certainty():
    assert [format_probability(p) for p in (0.0, 5e-4, 0.0304, 0.9994, 1.0)] == [
        *("< 0.001", "< 0.001", "0.030", "> 0.999", "> 0.999")
    ]
