"""What several test files need: joint motions given by a formula, and a small identification made by MuJoCo."""

from __future__ import annotations

import os
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import jax
import numpy as np
import pytest

from bayesid._math.kept_jit import forget_executables
from bayesid.app.compilation_cache import keep_compiled
from bayesid.inference.posterior import Posterior
from bayesid.recording.joint_motion import MeasuredMotion
from bayesid.recording.recording import Recording
from bayesid.robot.body_prior import BodyPrior
from bayesid.robot.inertial_parameters import InertialParameters
from bayesid.robot.joint_state import JointState
from bayesid.robot.robot import Robot
from bayesid.simulation.effects import GravityGradient
from bayesid.simulation.effects.register import _REGISTER
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.orbit import Orbit
from bayesid.simulation.sensors import Sensor, SensorKind, White
from studies.truth import mujoco as mj
from studies.truth.bodies import moving_joints

COMPILED = "BAYESID_TEST_COMPILED"
"""Names the folder in which the processes of one run share compiled functions."""

QUICKLY = "--xla_backend_optimization_level=0"
"""Option of XLA for all but the slow tests, whose time is mostly compilation: what is compiled runs a third as fast."""

LONGEST = ("test_catalogue.py", "test_rates.py")
"""The files of tests that take longest."""


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--slow", action="store_true", help="run only the tests that are otherwise left out")
    parser.addoption("--catalogue", action="store_true", help="run all tests, and hide every cause of the catalogue")


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "slow: left to ``pytest --slow``, as tests with the fixture of that name")
    given = os.environ.get("XLA_FLAGS", "")
    if not (config.getoption("--slow") or config.getoption("--catalogue") or QUICKLY in given):
        os.environ["XLA_FLAGS"] = f"{QUICKLY} {given}"
    jax.config.update("jax_enable_x64", True)  # for what the tests themselves compute with JAX
    _take_one_core()
    if COMPILED not in os.environ:
        folder = tempfile.TemporaryDirectory()
        os.environ[COMPILED] = folder.name
        config.add_cleanup(folder.cleanup)
    keep_compiled(Path(os.environ[COMPILED]))


def _take_one_core() -> None:
    """Keep this process to a core of its own where there is one for each.

    Their threads would otherwise wait for each other, which costs a fifth of the time. What runs in threads is tested
    on all cores in test_threads.py.
    """
    worker, count = os.environ.get("PYTEST_XDIST_WORKER", ""), os.environ.get("PYTEST_XDIST_WORKER_COUNT", "")
    if worker and hasattr(os, "sched_setaffinity"):
        cores = sorted(os.sched_getaffinity(0))
        if len(cores) == int(count):
            os.sched_setaffinity(0, {cores[int(worker.removeprefix("gw"))]})


@pytest.fixture(scope="session")
def slow() -> None:
    """Leave a test to ``pytest --slow``."""


def _is_slow(item: pytest.Item) -> bool:
    return "slow" in getattr(item, "fixturenames", ()) or item.get_closest_marker("slow") is not None


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Deselect the slow tests, or all others; the longest files begin, then those with the fewest tests.

    Those hold the longest tests. Were they the last, one of the two processes would wait for the other at the end.
    """
    if config.getoption("--catalogue"):
        return
    wanted = bool(config.getoption("--slow"))
    left_out = [item for item in items if _is_slow(item) != wanted]
    config.hook.pytest_deselected(items=left_out)
    chosen = [item for item in items if _is_slow(item) == wanted]
    counts = Counter(item.path for item in chosen)
    items[:] = sorted(chosen, key=lambda item: (item.path.name not in LONGEST, counts[item.path]))


ROOT = Path(__file__).resolve().parents[1]
PLANAR = ROOT / "bayesid" / "robot" / "models" / "planar.urdf"

SIGMA = 1e-5
"""Of the small case's rate [rad/s] and accelerometer [m/s2]."""
ENCODER = 1e-6
STEP = 0.5
"""Its integration error is some 3e-3 of a sample's standard deviation."""
POINT = (0.1, -0.15, 0.3)
ORBIT = mj.Orbit(6.878e6)


@pytest.fixture(autouse=True, scope="module")
def _forget_compiled() -> Iterator[None]:
    """Compiled functions of past files would fill the memory; those on disk stay."""
    yield
    forget_executables()


@pytest.fixture(autouse=True, scope="module")
def _forget_effects() -> Iterator[None]:
    """Effects that a file registered do not reach the next one."""
    before = dict(_REGISTER)
    yield
    _REGISTER.clear()
    _REGISTER.update(before)


class FormulaMotion:
    """A motion of the test generators (one time, joints in the URDF's order) as the package wants it."""

    def __init__(self, formula: mj.Motion, urdf: Path, robot: Robot) -> None:
        names = moving_joints(urdf)
        self.formula, self.order = formula, [names.index(joint.name) for joint in robot.joints]

    def evaluate(self, time: np.ndarray) -> JointState:
        if not self.order:
            return JointState(*np.zeros((3, len(time), 0)))
        return JointState(*np.array([self.formula(float(t)) for t in time]).transpose(1, 0, 2)[:, :, self.order])


@pytest.fixture(scope="session")
def formula_motion() -> type[FormulaMotion]:
    return FormulaMotion


@pytest.fixture(scope="session")
def planar_truth() -> mj.Truth:
    """The planar robot in orbit for 40 s, tumbling slowly so that every moment of inertia shows; noise-free."""
    motion = mj.smooth_motion(2, 40.0, seed=11, amplitude=0.3, frequencies=(0.03, 0.05), ramp=20.0)
    model = mj.TruthModel(PLANAR, orbit=ORBIT, accel_position=POINT)
    return model.run(motion, np.arange(0.0, 40.01, 0.5), rate0=(0.01, -0.02, 0.015), step=0.1)


@pytest.fixture(scope="session")
def noisy(planar_truth: mj.Truth) -> Callable[..., Recording]:
    """Recording of the small case with fresh noise."""

    def make(rng: np.random.Generator) -> Recording:
        truth, channels = planar_truth, {}
        for index in range(2):
            error = ENCODER * rng.normal(size=len(truth.times))
            channels[f"position.joint{index + 1}"] = truth.position[:, index] + error
        for family, values in (("rate", truth.rate), ("accel", truth.accel)):
            for index, axis in enumerate("xyz"):
                channels[f"{family}.{axis}"] = values[:, index] + SIGMA * rng.normal(size=len(values))
        return Recording("planar", None, truth.times, channels)

    return make


@pytest.fixture(scope="session")
def planar_posterior(noisy: Callable[..., Recording]) -> Callable[..., Posterior]:
    """Posterior of the small case; its guess of the base is wrong by about 20 % and its arm is right."""

    def make(rng: np.random.Generator, *, spread: float = 0.3, guess: float = 0.1, **options) -> Posterior:
        robot = Robot.from_urdf(PLANAR).perturbed("base_link", guess, np.random.default_rng(1))
        recording = noisy(rng)
        motion = MeasuredMotion.from_recording(recording, robot, sigma={0: ENCODER})
        model = Model(
            robot,
            (Sensor(SensorKind.RATE, White(SIGMA)), Sensor(SensorKind.ACCEL, White(SIGMA), position=POINT)),
            (BodyPrior("base_link", robot.link("base_link").inertial, spread),),
            Orbit(ORBIT.radius),
            (GravityGradient(),),
        )
        return Posterior.of(model, [Manoeuvre(recording, motion)], **options)

    return make


@pytest.fixture(scope="session")
def planar_case(planar_posterior: Callable[..., Posterior]) -> SimpleNamespace:
    """One posterior of the small case, compiled once, and the true base."""
    truth: InertialParameters = Robot.from_urdf(PLANAR).link("base_link").inertial
    return SimpleNamespace(posterior=planar_posterior(np.random.default_rng(2), step=STEP), truth=truth)
