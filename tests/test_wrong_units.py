"""Units that users mistake, in recordings of MuJoCo: refused where the data contradict them, and nowhere else."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bayesid import BodyPrior, InertialParameters, InputError, Model, Posterior, Recording
from bayesid.app.schema import Study
from bayesid.app.study_to_model import load_manoeuvres, load_model
from bayesid.inference.conventions import find_conventions
from bayesid.inference.wrong_units import refuse_wrong_units
from bayesid.simulation.model import Manoeuvre
from studies.faults.surroundings import SLIPS
from studies.truth.bodies import SERVICER3
from studies.truth.mujoco import Manoeuvres, write_study

STANDARD_GRAVITY = 9.80665

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("study")
    manoeuvres = Manoeuvres(count=1, duration=40.0)
    return write_study(folder, SERVICER3, np.random.default_rng(3), manoeuvres=manoeuvres).file


def posterior_of(file: Path, *, mass: float = 1.0, unit: float = 1.0) -> Posterior:
    """Return the posterior with the stated mass and inertia of the base and the accelerations multiplied."""
    loaded = Study.load(file)
    model = load_model(loaded)
    manoeuvres = [_scaled(manoeuvre, unit) for manoeuvre in load_manoeuvres(loaded, model.robot)]
    return Posterior.of(_heavier(model, mass), manoeuvres, step=2.0, window=0)


def _heavier(model: Model, factor: float) -> Model:
    (prior,) = model.priors
    stated = prior.centre
    body = InertialParameters(factor * stated.mass, stated.com, factor * stated.inertia)
    robot = model.robot.with_inertial(prior.name, body)
    return replace(model, robot=robot, priors=(BodyPrior(prior.name, body, prior.spread),))


def _scaled(manoeuvre: Manoeuvre, factor: float) -> Manoeuvre:
    recording = manoeuvre.recording
    channels = {
        name: values * factor if name.startswith("accel.") else values for name, values in recording.channels.items()
    }
    return replace(manoeuvre, recording=Recording(recording.name, recording.file, recording.time, channels))


@pytest.mark.parametrize("mass", [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0])
def test_a_base_that_is_stated_ten_times_too_heavy_or_light_is_no_wrong_unit(study: Path, mass: float) -> None:
    refuse_wrong_units(posterior_of(study, mass=mass))


@pytest.mark.parametrize("mass", [0.5, 1.0, 2.0])
def test_accelerations_in_g_are_refused_whatever_the_base_weighs(study: Path, mass: float) -> None:
    with pytest.raises(InputError, match=r"column accel\.x\|y\|z: .* only if they are in g\. Give them in m/s2"):
        refuse_wrong_units(posterior_of(study, mass=mass, unit=1.0 / STANDARD_GRAVITY))


@pytest.mark.parametrize(
    ("slip", "message"),
    [
        (
            "time in milliseconds",
            r"column 'time': the median interval between rows is 500 s.* in milliseconds it would be 0\.5 s",
        ),
        ("time in minutes", r"column time: .* only if times are minutes\. Give times in seconds"),
    ],
)
def test_the_column_in_another_unit_is_named(slip: str, message: str, study: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(study.parent, tmp_path / "study")
    SLIPS[slip](folder)
    loaded = Study.load(folder / study.name)
    model = load_model(loaded)
    with pytest.raises(InputError, match=message):
        refuse_wrong_units(Posterior.of(model, load_manoeuvres(loaded, model.robot), window=0))


def test_rates_in_arcseconds_are_named_before_anything_is_simulated(study: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(study.parent, tmp_path / "study")
    SLIPS["rate in arcseconds per second"](folder)
    loaded = Study.load(folder / study.name)
    model = load_model(loaded)
    manoeuvres = load_manoeuvres(loaded, model.robot)
    conventions = find_conventions(model, manoeuvres)
    assert [one.remedy for one in conventions] == ['[sensors.rate]\nunit = "arcsec/s"']
