"""Studies: what a complete file means, and one clear error for every way it can be wrong."""

import math
import pickle
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from bayesid._io.errors import InputError
from bayesid.app.schema import AccelSensor, AttitudeSensor, RateSensor, Study
from bayesid.app.study_to_model import load_manoeuvres, load_model, load_robot
from bayesid.recording.recording import Recording
from bayesid.robot.robot import Robot
from tests.conftest import PLANAR

EXAMPLES = Path(__file__).parents[2] / "shared" / "examples"

SHORTEST = """
[robot]
urdf = "robot.urdf"
[sensors.rate]
sigma = 1e-5
[unknowns]
bodies = []
"""

COMPLETE = """
title = "Everything"
[robot]
urdf = "models/robot.urdf"
link_spread = 0.05
[[robot.loads]]
name = "load"
link = "link6"
mass = 10
com = [0.1, 0.1, 0.1]
inertia = [10.0, 11.0, 12.0, 0.1, 0.2, 0.3]
[[robot.loads]]
name = "tool"
link = "link6"
mass = 1.0
com = [0, 0, 0]
inertia = [1, 1, 1, 0, 0, 0]
[orbit]
radius = 6.916e6
eccentricity = 0.01
inclination = 0.6
argument_of_perigee = 0.1
sun = [0.6, 0.0, 0.8]
[sensors.rate]
angle_random_walk = 1.0e-5
mounting = [0.0, 0.0, 0.70710678, 0.70710678]
bias_sigma = 1.0e-4
low_pass = 0.5
decimate = 2
[sensors.accel]
sigma = [1.0e-5, 2.0e-5, 3.0e-5]
position = [0.1, 0.2, 0.3]
bias_sigma = [1.0e-4, 1.0e-4, 2.0e-4]
[sensors.attitude]
arcsec = 2.0
[sensors.encoder]
sigma = 1.0e-6
velocity_sigma = {joint1 = 1.0e-5}
[[recordings]]
file = "manoeuvre-1.csv"
attitude = [0.0, 0.0, 0.0, 1.0]
attitude_sigma = 0.01
argument_of_latitude = 1.0
start = {joint1 = -0.3}
[[recordings]]
file = "../other/manoeuvre-2.parquet"
attitude = [0.5, 0.5, 0.5, 0.5]
[unknowns]
bodies = ["base_link", "load"]
spread = {load = 0.5}
[unknowns.prior.base_link]
mass = 2600.0
com = [0.0, 0.0, 1.5]
inertia = [5600.0, 3000.0, 7000.0, 0.0, 0.0, 0.0]
[model]
effects = ["gravity-gradient", "payload:link6"]
initial_rate = "unknown"
initial_rate_sigma = 1.0e-3
plugins = ["effects.py"]
[model.priors.wheel-momentum]
x = 0.5
[design]
duration = 120.0
tip_frame = "tool0"
joints = ["joint1", "joint2"]
[design.limits]
tip_speed = 0.05
tip_rate = 0.087
joint_speed = 0.1
base_rotation = 0.05
quiet_band = [0.1, 0.3]
"""


def write(folder: Path, text: str) -> Path:
    path = folder / "study.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture
def complete(tmp_path) -> Study:
    return Study.load(write(tmp_path, COMPLETE))


def test_a_complete_study(complete, tmp_path):
    assert complete.file == tmp_path / "study.toml"
    assert complete.title == "Everything"
    assert complete.robot.urdf == tmp_path / "models" / "robot.urdf"
    assert complete.recordings[1].file == tmp_path.parent / "other" / "manoeuvre-2.parquet"
    assert complete.model.plugins == (tmp_path / "effects.py",)
    load = complete.robot.loads[0].parameters
    np.testing.assert_array_equal(load.inertia, [[10.0, 0.1, 0.2], [0.1, 11.0, 0.3], [0.2, 0.3, 12.0]])
    assert (load.mass, complete.robot.loads[0].link) == (10.0, "link6")
    assert complete.unknowns.prior["base_link"].parameters.mass == 2600.0
    assert [complete.unknowns.spread_of(body) for body in complete.unknowns.bodies] == [1.0, 0.5]
    assert math.hypot(*complete.sensors.rate.mounting) == pytest.approx(1.0, abs=1e-15)
    assert complete.sensors.rate.bias_sigma == (1e-4, 1e-4, 1e-4)
    assert complete.sensors.accel.bias_sigma == (1e-4, 1e-4, 2e-4)
    encoder = complete.sensors.encoder
    assert encoder.sigma_of("position", "joint7") == 1e-6
    assert [encoder.sigma_of("velocity", joint) for joint in ("joint1", "joint2")] == [1e-5, None]
    assert encoder.sigma_of("acceleration", "joint1") is None
    assert complete.recordings[0].start == {"joint1": -0.3}
    assert complete.model.priors == {"wheel-momentum": {"x": 0.5}}
    assert complete.design.limits.quiet_band == (0.1, 0.3)


def test_the_shortest_study_has_the_documented_defaults(tmp_path):
    study = Study.load(write(tmp_path, SHORTEST))
    assert study.title == "study"
    assert study.orbit is None
    assert study.design is None
    assert study.recordings == study.robot.loads == study.model.effects == study.model.plugins == ()
    assert (study.robot.link_spread, study.unknowns.spread, study.model.initial_rate) == (0.0, 1.0, "unknown")
    assert study.sensors.rate.mounting == (0.0, 0.0, 0.0, 1.0)
    assert (study.sensors.rate.bias_sigma, study.sensors.rate.low_pass, study.sensors.rate.decimate) == (None, None, 1)
    assert study.sensors.encoder.sigma is None


def test_studies_are_frozen_and_pickle_with_their_file(complete):
    with pytest.raises(ValidationError, match="frozen"):
        complete.title = "other"
    copy = pickle.loads(pickle.dumps(complete))
    assert copy == complete
    assert copy.file == complete.file


def test_a_mapping_without_a_file_keeps_its_paths():
    data = {"robot": {"urdf": "r.urdf"}, "sensors": {"rate": {"sigma": 1e-5}}, "unknowns": {"bodies": []}}
    study = Study.from_mapping(data)
    assert study.robot.urdf == Path("r.urdf")
    assert study.file is None
    with pytest.raises(InputError, match=r"^robot.urdff: unknown key"):
        Study.from_mapping(data | {"robot": {"urdff": "r.urdf"}})


ARCSEC = math.radians(1.0 / 3600.0)


@pytest.mark.parametrize(
    ("sensor", "interval", "expected"),
    [
        (RateSensor(sigma=1e-5), 0.5, 1e-5),
        (RateSensor(sigma=[1e-5, 2e-5, 3e-5]), 0.5, [1e-5, 2e-5, 3e-5]),
        # the variance of a gyro's angle over T is arw^2 T, that of its mean rate arw^2 / T
        (RateSensor(angle_random_walk=1e-5), 0.25, 2e-5),
        (RateSensor(attitude_arcsec=2.0), 0.5, math.sqrt(2.0) * 2.0 * ARCSEC / 0.5),
        (AccelSensor(sigma=1e-5, position=[0, 0, 0]), 0.5, 1e-5),
        # one-sided density d over the band up to the Nyquist frequency 1 / 2T
        (AccelSensor(noise_density=1e-5, position=[0, 0, 0]), 0.125, 2e-5),
        (AttitudeSensor(sigma=1e-5), 0.5, 1e-5),
        (AttitudeSensor(arcsec=3.0), 0.5, 3.0 * ARCSEC),
    ],
)
def test_noise_per_sample(sensor, interval, expected):
    sigma = sensor.noise.sigma(interval)
    assert sigma.shape == (3,)
    np.testing.assert_allclose(sigma, np.broadcast_to(expected, 3), rtol=1e-12)


INERTIA = "inertia = [10.0, 11.0, 12.0, 0.1, 0.2, 0.3]"
RATE = "angle_random_walk = 1.0e-5"

WRONG = {
    # keys
    "key": (
        RATE,
        "sigmaa = 1e-5",
        "sensors.rate.sigmaa: unknown key 'sigmaa'. Did you mean 'sigma'? Allowed: sigma, angle_",
    ),
    "key at top": (
        "[robot]",
        "rob = 1\n[robot]",
        "rob: unknown key 'rob'. Did you mean 'robot'? Allowed: title, robot, ",
    ),
    "key in list": ('name = "load"', "nam = 'load'", "robot.loads #1.nam: unknown key 'nam'. Did you mean 'name'?"),
    "key unlike any": ("duration = 120.0", "zzz = 1", "design.zzz: unknown key 'zzz'. Allowed: duration, tip_frame, "),
    "private": ("[robot]", "_file = 'x'\n[robot]", "_file: unknown key '_file'"),
    "section": ("[design]", "[desing]", "desing: unknown key 'desing'. Did you mean 'design'?"),
    "missing": ('urdf = "models/robot.urdf"', "", "robot.urdf: the key is missing. Add urdf = ..."),
    "missing in list": ('file = "manoeuvre-1.csv"', "", "recordings #1.file: the key is missing"),
    "missing position": ("position = [0.1, 0.2, 0.3]", "", "sensors.accel.position: the key is missing"),
    "single table": ('[[recordings]]\nfile = "../', '[x]\nfile = "../', "x: unknown key 'x'"),
    # kinds of value
    "text for number": ("mass = 10\n", "mass = '10'\n", "robot.loads #1.mass: got '10'. Give a number"),
    "truth for number": ("mass = 10\n", "mass = true\n", "robot.loads #1.mass: got True. Give a number"),
    "nan": ("mass = 10\n", "mass = nan\n", "robot.loads #1.mass: got nan. Give a finite number"),
    "number for text": ('tip_frame = "tool0"', "tip_frame = 3", "design.tip_frame: got 3. Give text in quotes"),
    "number for path": ('"models/robot.urdf"', "3", "robot.urdf: got 3. Give "),
    "empty path": ('"models/robot.urdf"', "''", "robot.urdf: the path is empty"),
    "empty name": ('name = "load"', "name = ''", "robot.loads #1.name: got ''. Give a name"),
    "fraction": ("decimate = 2", "decimate = 2.0", "sensors.rate.decimate: got 2.0. Give a whole number"),
    "text for list": ('joints = ["joint1", "joint2"]', "joints = 'joint1'", "design.joints: got 'joint1'. Give a list"),
    "length": (
        "com = [0.1, 0.1, 0.1]",
        "com = [0.1, 0.1]",
        "robot.loads #1.com: got a list of 2. Give a list of 3 numbers",
    ),
    "element": ("com = [0.1, 0.1, 0.1]", "com = [0.1, 'b', 0.1]", "robot.loads #1.com #2: got 'b'. Give a number"),
    "axes": (
        "sigma = [1.0e-5, 2.0e-5, 3.0e-5]",
        "sigma = [1e-5]",
        "sensors.accel.sigma: got a list of 1. Give a number or a",
    ),
    "choice": ('"unknown"', '"banana"', "model.initial_rate: got 'banana'. Give 'unknown' or 'zero'"),
    "spread text": ("spread = {load = 0.5}", "spread = 'wide'", "unknowns.spread: got 'wide'. Give a number"),
    # ranges
    "sigma": ("sigma = 1.0e-6", "sigma = 0.0", "sensors.encoder.sigma: got 0.0. Give a value greater than 0"),
    "axis sigma": (
        "[1.0e-5, 2.0e-5, 3.0e-5]",
        "[1e-5, -1, 3e-5]",
        "sensors.accel.sigma #2: got -1. Give a value greater",
    ),
    "joint sigma": (
        "{joint1 = 1.0e-5}",
        "{joint1 = -1.0}",
        "sensors.encoder.velocity_sigma.joint1: got -1.0. Give a value",
    ),
    "mass": ("mass = 10\n", "mass = 0\n", "robot.loads #1.mass: got 0. Give a value greater than 0"),
    "decimate": (
        "decimate = 2",
        "decimate = 0",
        "sensors.rate.decimate: got 0. Give a value greater than or equal to 1",
    ),
    "eccentricity": (
        "= 0.01\ninclination",
        "= 1.0\ninclination",
        "orbit.eccentricity: got 1.0. Give a value less than 1",
    ),
    "perigee": (
        "eccentricity = 0.01",
        "eccentricity = 0.2",
        "orbit: the perigee, radius (1 - eccentricity) = 5.5328e+06 m",
    ),
    "band": ("[0.1, 0.3]", "[0.3, 0.1]", "design.limits.quiet_band: [0.3, 0.1] is not ascending"),
    # units
    "kilometres": ("6.916e6", "6916.0", "orbit.radius: 6916 m is inside the Earth. Metres, not kilometres?"),
    "millimetres": (
        "6.916e6",
        "6.916e9",
        "orbit.radius: 6.916e+09 m is not an orbit about the Earth. Metres, not millimetres?",
    ),
    "degrees": (
        "inclination = 0.6",
        "inclination = 35.0",
        "orbit.inclination: 35 is implausibly large, over 3.14159. Rad",
    ),
    "latitude": (
        "of_latitude = 1.0",
        "of_latitude = 90",
        "recordings #1.argument_of_latitude: 90 is implausibly large",
    ),
    "rate sigma": (
        RATE,
        "sigma = 2.0",
        "sensors.rate.sigma: 2 is implausibly large, over 0.1. rad/s, not arcsec/s or degrees",
    ),
    "walk": (
        RATE,
        "angle_random_walk = 0.05",
        "sensors.rate.angle_random_walk: 0.05 is implausibly large, over 0.01. rad/s",
    ),
    "arcsec": (
        RATE,
        "attitude_arcsec = 1e-5",
        "sensors.rate.attitude_arcsec: 1e-05 is implausibly small, below 0.001. arc",
    ),
    "accel sigma": (
        "3.0e-5]",
        "30.0]",
        "sensors.accel.sigma: 30 is implausibly large, over 1. m/s2, not milli-g or micro-g?",
    ),
    "attitude sigma": (
        "arcsec = 2.0",
        "sigma = 2.0",
        "sensors.attitude.sigma: 2 is implausibly large, over 0.1. Radians",
    ),
    "encoder": (
        "sigma = 1.0e-6",
        "sigma = {a = 1e-6, b = 1.0}",
        "sensors.encoder.sigma: 1 is implausibly large, over 0.1",
    ),
    "position": (
        "[0.1, 0.2, 0.3]",
        "[100, 200, 300]",
        "sensors.accel.position: 300 is implausibly large, over 100. Metres",
    ),
    "percent": (
        "link_spread = 0.05",
        "link_spread = 5",
        "robot.link_spread: 5 is implausibly large, over 1. A fraction",
    ),
    # directions
    "quaternion": (
        "[0.5, 0.5, 0.5, 0.5]",
        "[1, 1, 0, 0]",
        "recordings #2.attitude: the norm of [1.0, 1.0, 0.0, 0.0] is 1.41421",
    ),
    "mounting": (
        "0.70710678, 0.70710678]",
        "0.7, 0.7]",
        "sensors.rate.mounting: the norm of [0.0, 0.0, 0.7, 0.7] is 0.98994",
    ),
    "sun": (
        "[0.6, 0.0, 0.8]",
        "[1.0, 0.0, 1.0]",
        "orbit.sun: the norm of [1.0, 0.0, 1.0] is 1.41421, not 1. Give a unit vec",
    ),
    # bodies
    "triangle": (
        INERTIA,
        "inertia = [1, 1, 3, 0, 0, 0]",
        "robot.loads #1: the triangle inequality I1 + I2 >= I3 of the",
    ),
    "negative": (
        INERTIA,
        "inertia = [1, 1, 1, 2, 0, 0]",
        "robot.loads #1: principal moments >= 0 fails: the smallest is",
    ),
    "prior": ("[5600.0, 3000.0, 7000.0", "[1.0, 1.0, 7000.0", "unknowns.prior.base_link: the triangle inequality"),
    "plate": (
        INERTIA,
        "inertia = [1, 1, 2, 0, 0, 0]",
        "robot.loads #1 ('load'): the body is a point, a rod or a plate",
    ),
    "prior plate": (
        "[5600.0, 3000.0, 7000.0",
        "[1.0, 1.0, 2.0",
        "unknowns.prior.base_link: the body is a point, a rod or",
    ),
    # names
    "loads": ('name = "tool"', 'name = "load"', "robot.loads: 'load' appears twice. Name each once"),
    "bodies": ('["base_link", "load"]', '["base_link", "base_link"]', "unknowns.bodies: 'base_link' appears twice"),
    "effects": ('"payload:link6"]', '"gravity-gradient"]', "model.effects: 'gravity-gradient' appears twice"),
    "file twice": (
        "../other/manoeuvre-2.parquet",
        "./manoeuvre-1.csv",
        "recordings #2.file: 'manoeuvre-1.csv' is listed twice",
    ),
    "name twice": (
        "../other/manoeuvre-2.parquet",
        "../other/manoeuvre-1.parquet",
        "recordings #2.file: the name 'manoeuvre-1' is shared by two files, '",
    ),
    "spread of": (
        "{load = 0.5}",
        "{laod = 0.5}",
        "unknowns.spread: 'laod' is not among unknowns.bodies. Did you mean 'load'?",
    ),
    "prior of": (
        "prior.base_link",
        "prior.link3",
        "unknowns.prior: 'link3' is not among unknowns.bodies. Add it there or",
    ),
    # combinations
    "noise twice": (
        RATE,
        RATE + "\nsigma = 1e-5",
        "sensors.rate: sigma and angle_random_walk are given together. Give exactly one",
    ),
    "no noise": (
        RATE,
        "",
        "sensors.rate: the noise is not given. Give exactly one of sigma, angle_random_walk, attitude_arcsec",
    ),
    "no accel noise": (
        "sigma = [1.0e-5, 2.0e-5, 3.0e-5]",
        "",
        "sensors.accel: the noise is not given. Give exactly one of",
    ),
    "same twice": (
        RATE,
        "attitude_arcsec = 2.0",
        "sensors: a rate differenced from the attitude (rate.attitude_arcsec) is",
    ),
    "zero rate": ('= "unknown"', '= "zero"', "model: initial_rate_sigma contradicts initial_rate = 'zero'"),
    # syntax
    "syntax": ("link_spread = 0.05", "link_spread = ", "line 5, column 15: not valid TOML: Invalid value"),
    "key twice": ("link_spread = 0.05", "urdf = 'b'", "line 5, column 11: not valid TOML: Cannot overwrite a value"),
}


@pytest.mark.parametrize(("old", "new", "message"), WRONG.values(), ids=WRONG)
def test_a_wrong_study_is_named_with_place_value_and_remedy(tmp_path, old, new, message):
    assert COMPLETE.count(old) >= 1
    path = write(tmp_path, COMPLETE.replace(old, new, 1))
    with pytest.raises(InputError) as caught:
        Study.load(path)
    assert str(caught.value).startswith(f"{path}: {message}")
    assert caught.value.remedy
    assert "\n" not in str(caught.value)


WRONG_SHORT = {
    "no robot": ('[robot]\nurdf = "robot.urdf"', "", "robot: the section is missing. Add [robot]"),
    "no unknowns": ("[unknowns]\nbodies = []", "", "unknowns: the section is missing. Add [unknowns]"),
    "no bodies": ("bodies = []", "", "unknowns.bodies: the key is missing"),
    "no base sensor": (
        "[sensors.rate]",
        "[sensors.encoder]",
        "sensors: no sensor of the base is declared. Add at least one",
    ),
    "no table": ('[robot]\nurdf = "robot.urdf"', "robot = 3", "robot: got 3. Give a table"),
    "one bracket": (
        "[unknowns]",
        "[recordings]\nfile = 'a'\n[unknowns]",
        "recordings: got a single table. Write its header in",
    ),
    "two brackets": ("[robot]", "[[robot]]", "robot: got [{'urdf': 'robot.urdf'}]. Give a table"),
    "several": (
        "sigma = 1e-5",
        "sigma = 0\nsigmaa = 1\nlow_pass = -1",
        "sensors.rate.sigmaa: unknown key 'sigmaa'. Did you ",
    ),
}


@pytest.mark.parametrize(("old", "new", "message"), WRONG_SHORT.values(), ids=WRONG_SHORT)
def test_a_wrong_short_study(tmp_path, old, new, message):
    assert old in SHORTEST
    path = write(tmp_path, SHORTEST.replace(old, new, 1))
    with pytest.raises(InputError) as caught:
        Study.load(path)
    assert str(caught.value).startswith(f"{path}: {message}")


def test_the_first_of_several_errors_counts_the_others(tmp_path):
    text = SHORTEST.replace("sigma = 1e-5", "sigma = 0\nlow_pass = -1").replace("[]", "3")
    with pytest.raises(
        InputError, match=r"sensors.rate.sigma: got 0. .* greater than 0 \(2 more errors in this file\)"
    ):
        Study.load(write(tmp_path, text))


def test_a_byte_order_mark_is_no_part_of_the_text(tmp_path):
    text = SHORTEST
    marked = tmp_path / "marked.toml"
    marked.write_text(text, encoding="utf-8-sig")
    assert Study.load(marked).model_dump() == Study.load(write(tmp_path, text)).model_dump() | {"title": "marked"}


def test_the_key_that_names_an_absent_robot_or_link_is_said(tmp_path):
    with pytest.raises(InputError, match=r"study.toml: robot.urdf: there is no such file: .*robot.urdf"):
        load_robot(Study.load(write(tmp_path, COMPLETE)))
    text = f"robot = {{ urdf = '{PLANAR}' }}\nsensors.rate.sigma = 1e-5\nunknowns.bodies = ['bus']"
    with pytest.raises(InputError, match=r"study.toml: unknowns.bodies: no link or load named 'bus'. Choose one of"):
        load_robot(Study.load(write(tmp_path, text)))


def test_an_absent_and_a_binary_file(tmp_path):
    with pytest.raises(InputError, match=r"absent.toml: there is no such file. Give the path of a study"):
        Study.load(tmp_path / "absent.toml")
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="not a text file"):
        Study.load(tmp_path / "binary.toml")


@pytest.mark.skipif(not EXAMPLES.is_dir(), reason="the worked examples are not beside this checkout")
@pytest.mark.parametrize("case", ["nothing-hidden", "wheel-momentum", "accel-position"])
def test_the_examples_load(case):
    study = Study.load(EXAMPLES / case / "study.toml")
    assert study.title == f"Case {case}"
    assert study.robot.urdf.is_file()
    assert [recording.file.is_file() for recording in study.recordings] == [True] * 3
    np.testing.assert_array_equal(study.sensors.rate.noise.sigma(0.5), [1e-5] * 3)
    assert study.sensors.encoder.sigma_of("position", "joint1") == 1e-6


PLACED = {
    "eccentric": ({}, "'gravity-gradient' depends on the orbital position"),
    "dipole": (
        {"= 0.01\ninc": "= 0.0\ninc", '"gravity-gradient"': '"magnetic-dipole"'},
        "'magnetic-dipole' depends on the orbital position",
    ),
    "circular": ({"= 0.01\ninc": "= 0.0\ninc"}, "there is no such file"),
}


@pytest.mark.parametrize(("changes", "message"), PLACED.values(), ids=PLACED)
def test_the_place_on_the_orbit_is_required_where_an_effect_depends_on_it(tmp_path, changes, message):
    text = COMPLETE
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    study = Study.load(write(tmp_path, text))
    with pytest.raises(InputError, match=message) as caught:
        load_manoeuvres(study, Robot.from_urdf(PLANAR))
    asked = message != "there is no such file"
    assert caught.value.place == ("recordings #2.argument_of_latitude" if asked else "recordings #1.file")


MISNAMED = {
    "start": ("start = {jont1 = 0.1}", "recordings #1.start.jont1"),
    "position": ("[sensors.encoder]\nsigma = {joint1 = 1e-6, jont1 = 1e-6}", "sensors.encoder.sigma.jont1"),
    "velocity": ("[sensors.encoder]\nvelocity_sigma = {jont1 = 1e-6}", "sensors.encoder.velocity_sigma.jont1"),
}


@pytest.mark.parametrize(("text", "place"), MISNAMED.values(), ids=MISNAMED)
def test_a_joint_that_the_robot_lacks_is_named(tmp_path, text, place):
    time = np.arange(10.0)
    Recording("m", None, time, {f"position.joint{k}": 0.01 * time for k in (1, 2)}).write(tmp_path / "m.csv")
    recorded = f'{SHORTEST}[[recordings]]\nfile = "m.csv"\nattitude = [0, 0, 0, 1]\n'
    assert len(load_manoeuvres(Study.load(write(tmp_path, recorded)), Robot.from_urdf(PLANAR))) == 1
    file = write(tmp_path, recorded + text)
    with pytest.raises(InputError) as caught:
        load_manoeuvres(Study.load(file), Robot.from_urdf(PLANAR))
    assert str(caught.value) == f"{file}: {place}: the robot has no moving joint 'jont1'. Did you mean 'joint1'?"


@pytest.mark.parametrize(
    ("model", "sigma"),
    [
        ("", 3e-4),
        ('[model]\neffects = ["rate-bias"]', 3e-4),
        ('[model]\neffects = ["rate-bias"]\npriors = {rate-bias = {x = 5e-4, y = 5e-4, z = 5e-4}}', 5e-4),
    ],
)
def test_the_sigma_of_a_bias_holds_whether_the_effects_name_it_or_not(tmp_path, model, sigma):
    text = SHORTEST.replace("robot.urdf", str(PLANAR)).replace("sigma = 1e-5", "sigma = 1e-5\nbias_sigma = 3e-4")
    (bias,) = load_model(Study.load(write(tmp_path, text + model))).effects
    assert bias.label == "rate-bias"
    assert [parameter.sigma for parameter in bias.parameters] == [sigma] * 3
