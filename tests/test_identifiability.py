"""Practical identifiability against closed forms, brute force and MuJoCo."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg as sla
from conftest import ENCODER, ORBIT, PLANAR, POINT, SIGMA, STEP

from bayesid.identifiability.advice import NotEvaluated, Swung, candidates
from bayesid.identifiability.directions import Direction, describe, directions, subject
from bayesid.identifiability.hypothetical_experiment import Experiment, InformationPredictor
from bayesid.identifiability.local_knowledge import Knowledge
from bayesid.identifiability.parameter_table import Draws, Method, quantity_of, shape_errors, weighted_quantile
from bayesid.identifiability.practical_identifiability import covers_all
from bayesid.identifiability.profile_interval import Target, profile
from bayesid.inference import maximise
from bayesid.inference.body_quantities import Contraction, ContractionVerdict, compare, linearise
from bayesid.inference.noise_changes import relinearised
from bayesid.inference.posterior import Posterior
from bayesid.recording.joint_motion import MeasuredMotion
from bayesid.recording.recording import Recording
from bayesid.robot.body_prior import BodyPrior
from bayesid.robot.robot import Robot
from bayesid.simulation.effects import GravityGradient
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.orbit import Orbit
from bayesid.simulation.sensors import Sensor, SensorKind, White
from studies.truth import mujoco as mj

KEYS = ("mass", "com.x", "com.y", "com.z", *(f"inertia.{pair}" for pair in ("xx", "yy", "zz", "xy", "xz", "yz")))


def masses(measured: np.ndarray, sigma: float, prior_sd: np.ndarray) -> Knowledge:
    """Two masses of which one combination was measured."""
    slope = np.diag(prior_sd)
    jacobian = np.concatenate([(measured @ slope / sigma)[None], np.eye(2)])
    return Knowledge(("a.mass", "b.mass"), np.array([50.0, 20.0]), slope, jacobian)


# ---- directions ----


def test_directions_of_a_measured_sum_are_those_of_the_closed_form() -> None:
    sigma, wide = 0.1, 2.0
    known = masses(np.array([1.0, 1.0]), sigma, np.array([wide, wide]))
    worst, best = directions(known)
    assert worst.sd == pytest.approx(worst.prior_sd, rel=1e-12)  # the difference: nothing was learnt
    np.testing.assert_allclose(worst.weights * wide, [1.0, -1.0], rtol=1e-12)
    np.testing.assert_allclose(worst.displacement, wide / np.sqrt(2.0) * np.array([1.0, -1.0]), rtol=1e-12)
    ratio = 1.0 / np.sqrt(1.0 + 2.0 * wide**2 / sigma**2)  # of the sum
    assert best.sd / best.prior_sd == pytest.approx(ratio, rel=1e-12)
    np.testing.assert_allclose(best.displacement, ratio * wide / np.sqrt(2.0) * np.ones(2), rtol=1e-9)
    assert known.conditional_sd[0] == pytest.approx(1.0 / np.sqrt(1.0 / wide**2 + 1.0 / sigma**2))
    assert known.correlation[0, 1] == pytest.approx(-1.0, abs=5e-3)
    assert [item.verdict for item in (worst, best)] == [ContractionVerdict.NOT, ContractionVerdict.CONTRACTED]


def test_directions_solve_the_generalised_eigenproblem_and_add_up_to_the_covariance() -> None:
    rng = np.random.default_rng(0)
    names = tuple(f"a.{key}" for key in KEYS)
    slope = np.concatenate([rng.normal(size=(10, 10)), np.zeros((10, 4))], axis=1)  # four nuisance coordinates
    data = rng.normal(size=(30, 14)) * np.geomspace(1.0, 1e3, 14)
    known = Knowledge(names, rng.normal(size=10), slope, np.concatenate([data, np.eye(14)]))
    found = directions(known)
    covariance = slope @ np.linalg.inv(data.T @ data + np.eye(14)) @ slope.T
    np.testing.assert_allclose(known.covariance, covariance, rtol=1e-6, atol=1e-9 * np.abs(covariance).max())
    values = sla.eigh(covariance, slope @ slope.T, eigvals_only=True)
    np.testing.assert_allclose([(item.sd / item.prior_sd) ** 2 for item in found], values[::-1], rtol=1e-6)
    for item in found:
        assert item.sd == pytest.approx(np.sqrt(item.weights @ known.covariance @ item.weights), rel=1e-9)
        assert item.prior_sd == pytest.approx(np.linalg.norm(item.weights @ slope), rel=1e-9)
        assert item.weights @ item.displacement == pytest.approx(item.sd, rel=1e-9)
        assert np.abs(item.weights * known.prior_sd).max() == pytest.approx(1.0)
    total = sum(np.outer(item.displacement, item.displacement) for item in found)
    np.testing.assert_allclose(total, known.covariance, rtol=1e-9, atol=1e-12 * np.abs(covariance).max())


def test_untold_directions_are_turned_to_the_scale_and_to_single_quantities() -> None:
    """Only the ratio of two bodies' masses is measured: of twenty directions nineteen are the prior's."""
    names = tuple(f"{body}.{key}" for body in "ab" for key in KEYS)
    slope, values = np.eye(20), np.zeros(20)
    values[[0, 10]] = 1.0
    row = np.zeros((1, 20))
    row[0, 0], row[0, 10] = 100.0, -100.0
    found = directions(Knowledge(names, values, slope, np.concatenate([row, np.eye(20)])))
    np.testing.assert_allclose(np.abs(found[0].displacement[[0, 10]]), np.sqrt(0.5), rtol=1e-9)
    assert subject(found[0], values, np.ones(20)) == "all masses and inertias in proportion (the scale)"
    for item in found[1:19]:  # each moves one quantity alone
        assert np.sort(np.abs(item.displacement))[-1] == pytest.approx(1.0, abs=1e-6)
    assert found[-1].verdict is ContractionVerdict.CONTRACTED


# ---- words ----


def direction(names: tuple[str, ...], displacement: list[float], ratio: float) -> Direction:
    moved = np.array(displacement)
    return Direction(names, moved / (moved @ moved), moved, 1.0 / ratio, 1.0)


@pytest.mark.parametrize(
    ("displacement", "ratio", "words"),
    [
        ([60.0, 0.0, 2.0, 5.0, 0.0, 0.5], 1.0, "all masses and inertias in proportion (the scale): not learnt"),
        ([60.0, 0.0, 2.0, 0.0, 0.0, 0.0], 0.01, "mass and inertia of base in proportion: learnt, 1 %"),
        ([6.0, 0.0, 0.0, -0.5, 0.0, 0.0], 0.95, "mass of base against mass of arm: cannot be distinguished, 95 %"),
        ([0.0, 0.1, 0.5, 0.0, 0.0, 0.0], 0.7, "centre of mass x of base with inertia yy of base: weakly learnt, 70 %"),
        ([0.0, 0.0, 0.0, 0.1, 0.1, 0.0], 1e-3, "centre of mass x of arm: learnt, 0.1 %"),
    ],
)
def test_words_follow_the_numbers(displacement: list[float], ratio: float, words: str) -> None:
    names = tuple(f"{body}.{key}" for body in ("base", "arm") for key in ("mass", "com.x", "inertia.yy"))
    values, prior_sd = np.array([60.0, 0.3, 2.0, 5.0, 0.2, 0.5]), np.array([60.0, 0.2, 2.0, 5.0, 0.1, 0.5])
    said = describe(direction(names, displacement, ratio), values, prior_sd)
    assert said.startswith(words), said


def test_what_is_learnt_is_judged_by_the_central_range() -> None:
    """Two log-normal quantities: one as in the prior, whose sd hardly exists, and one four times as narrow."""
    rng = np.random.default_rng(1)
    prior, same, narrow = np.exp(2.0 * rng.normal(size=(3, 40000)))
    found = compare(("a", "b"), np.stack([prior, prior], axis=1), np.stack([same, narrow / 4.0], axis=1))
    assert found["a"].shrinkage == pytest.approx(0.0, abs=0.05)
    assert found["b"].shrinkage == pytest.approx(0.75, abs=0.02)
    assert [item.verdict for item in found.values()] == [ContractionVerdict.NOT, ContractionVerdict.CONTRACTED]
    assert Contraction(1.0, 0.2).to_dict() == {"prior_sd": 1.0, "shrinkage": 0.2, "verdict": "weakly"}


# ---- draws and profiles ----


def test_weighted_quantiles_and_shapes_of_a_skewed_quantity() -> None:
    rng = np.random.default_rng(2)
    z = 1.5 * rng.normal(size=20000)
    weights = np.exp(-0.5 * z**2 + 0.5 * (z / 1.5) ** 2)  # importance weights of the standard normal distribution
    values = np.stack([3.0 + 0.1 * z, np.exp(0.8 * z)], axis=1)
    weights /= weights.sum()
    np.testing.assert_allclose(weighted_quantile(values, weights, 0.84), [3.0995, np.exp(0.7956)], rtol=0.02)
    known = Knowledge(("a", "b"), np.array([3.0, 1.0]), np.diag([0.1, 0.8]), np.eye(2))
    errors = shape_errors(Draws(Method.IMPORTANCE, values, weights, True, 0.0), known)
    assert errors[0] < 0.05
    assert errors[1] == pytest.approx((np.exp(0.8 * 1.96) - 1.0) / 0.8 - 1.96, rel=0.05)


def bent(z: np.ndarray) -> np.ndarray:
    """Residuals with a curved ridge."""
    x, y = z
    return np.array([(y - x**2 + 0.2) / 0.05, (x + 0.3 * y - 0.5) / 0.8, x, y])


def bent_slope(z: np.ndarray) -> np.ndarray:
    return np.array([[-2.0 * z[0] / 0.05, 1.0 / 0.05], [1.0 / 0.8, 0.3 / 0.8], [1.0, 0.0], [0.0, 1.0]])


def test_a_profile_is_that_of_brute_force() -> None:
    """Of x + y^2: for every value a fine line search over y, x following."""
    from scipy.optimize import least_squares

    mode = least_squares(bent, [0.3, 0.0], bent_slope, xtol=1e-14, ftol=1e-14, gtol=1e-14).x
    slope = bent_slope(mode)
    target = Target(lambda z: float(z[0] + z[1] ** 2), lambda z: np.array([1.0, 2.0 * z[1]]))
    found = profile(bent, bent_slope, mode, np.linalg.inv(slope.T @ slope), target)
    values = np.linspace(found.values[0], found.values[-1], 801)
    y = np.linspace(-1.5, 3.0, 20001)
    cost = np.array([0.5 * (bent(np.stack([v - y**2, y])) ** 2).sum(axis=0).min() for v in values])
    loss = 2.0 * (cost - 0.5 * (bent(mode) ** 2).sum())
    for root in (1.0, 1.959963984540054):
        inside = values[loss <= root**2]
        low, high = found.interval(root)
        assert low == pytest.approx(inside[0], abs=0.01)
        assert high == pytest.approx(inside[-1], abs=0.01)
    ends = found.interval(1.959963984540054)
    middle = target.value(mode)
    assert abs((ends[1] - middle) / (middle - ends[0]) - 1.0) > 0.2  # it is not symmetric: the check can fail


def test_a_profile_of_a_linear_problem_is_the_normal_interval() -> None:
    rng = np.random.default_rng(3)
    matrix, data = rng.normal(size=(12, 4)), rng.normal(size=12)
    covariance = np.linalg.inv(matrix.T @ matrix)
    mode, along = covariance @ matrix.T @ data, rng.normal(size=4)
    target = Target(lambda z: float(along @ z), lambda z: along)
    found = profile(lambda z: matrix @ z - data, lambda z: matrix, mode, covariance, target)
    sd = float(np.sqrt(along @ covariance @ along))
    for root in (1.0, 1.959963984540054):
        np.testing.assert_allclose(found.interval(root), along @ mode + sd * root * np.array([-1.0, 1.0]), rtol=1e-4)
    assert found.interval(5.0) == (None, None)


# ---- experiments ----


@pytest.mark.usefixtures("slow")
def test_a_prediction_without_change_is_the_posterior_itself(planar_case) -> None:
    posterior = planar_case.posterior
    z = np.random.default_rng(4).normal(size=posterior.size) * 0.1
    there = relinearised(posterior, z)
    predictor = InformationPredictor(posterior.model, posterior.manoeuvres, z, posterior.step)
    predicted, own = predictor.knowledge(predictor.flown), Knowledge.at(there, z)
    np.testing.assert_allclose(predicted.sd, own.sd, rtol=0.02)  # whitening windows may differ
    options = {item.name: item for item in candidates(posterior.model)}
    assert {"better-rate", "better-accel", "add-attitude", "known-mass:base_link", "thrust", "twice"} <= set(options)
    experiment = options["known-mass:base_link"].change(predictor.flown)
    weighed = predictor.knowledge(experiment)
    variance = 1.0 / (1.0 / predicted.sd[0] ** 2 + 1.0 / (0.01 * predicted.values[0]) ** 2)
    assert weighed.sd[0] == pytest.approx(np.sqrt(variance), rel=1e-6)
    twice = predictor.knowledge(options["twice"].change(predictor.flown))
    assert np.all(twice.sd <= predicted.sd)
    # initial rates are unknown anew, but nothing is learnt less than from half the noise
    assert np.all(twice.sd >= predicted.sd / np.sqrt(2.0) * (1.0 - 1e-9))
    for name in ("better-rate", "better-accel", "add-attitude"):
        known = predictor.knowledge(options[name].change(predictor.flown))
        assert np.all(known.sd <= predicted.sd * 1.001), name
    gradient = quantity_of(there, 0).gradient(z)
    np.testing.assert_allclose(gradient, linearise(there, z).slope[0])


def test_an_added_swing_is_a_motion_within_the_joint_range() -> None:
    robot, samples = Robot.from_urdf(PLANAR), np.arange(0.0, 40.01, 0.5)
    joints = {f"position.joint{number}": 0.3 * np.sin(0.1 * number * samples) for number in (1, 2)}
    recording = Recording("planar", None, samples, joints)
    manoeuvre = Manoeuvre(recording, MeasuredMotion.from_recording(recording, robot, sigma={0: ENCODER}))
    model = Model(robot, (Sensor(SensorKind.RATE, White(SIGMA)),), ())
    flown = Experiment((manoeuvre,), model.sensors)
    swing = next(item for item in candidates(model) if item.name == "swing:joint2")
    changed = swing.change(flown).manoeuvres[0].motion
    assert isinstance(changed, Swung)
    time, h = np.linspace(1.0, 39.0, 77), 1e-4
    before, after = changed.evaluate(time - h), changed.evaluate(time + h)
    state = changed.evaluate(time)
    np.testing.assert_allclose((after.position - before.position) / (2.0 * h), state.velocity, atol=1e-6)
    np.testing.assert_allclose((after.velocity - before.velocity) / (2.0 * h), state.acceleration, atol=1e-6)
    np.testing.assert_array_equal(state.position[:, 0], manoeuvre.motion.evaluate(time).position[:, 0])
    narrow = Robot.from_string(PLANAR.read_text().replace('upper="2.8"', 'upper="0.35"').replace("-2.8", "-0.35"))
    tight = next(item for item in candidates(Model(narrow, model.sensors, ())) if item.name == "swing:joint2")
    with pytest.raises(NotEvaluated, match="range"):
        tight.change(flown)


# ---- MuJoCo: motion alone never gives the scale ----


def recorded(truth: mj.Truth, robot: Robot, rng: np.random.Generator) -> Manoeuvre:
    """A manoeuvre recorded by MuJoCo, with noise."""
    channels = {}
    for index in range(2):
        channels[f"position.joint{index + 1}"] = truth.position[:, index] + ENCODER * rng.normal(size=len(truth.times))
    for family, values in (("rate", truth.rate), ("accel", truth.accel)):
        for index, axis in enumerate("xyz"):
            channels[f"{family}.{axis}"] = values[:, index] + SIGMA * rng.normal(size=len(values))
    for family, values in (("base_force", truth.force), ("base_torque", truth.external_torque)):
        if np.any(values):
            channels |= {f"{family}.{axis}": values[:, index] for index, axis in enumerate("xyz")}
    recording = Recording("planar", None, truth.times, channels)
    return Manoeuvre(recording, MeasuredMotion.from_recording(recording, robot, sigma={0: ENCODER}))


def whole_robot(rng: np.random.Generator) -> Model:
    """Every body of the planar robot unknown, and guessed wrong by some 10 %."""
    robot = Robot.from_urdf(PLANAR)
    links = ("base_link", "link1", "link2")
    return Model(
        robot,
        (Sensor(SensorKind.RATE, White(SIGMA)), Sensor(SensorKind.ACCEL, White(SIGMA), position=POINT)),
        tuple(BodyPrior(name, robot.perturbed(name, 0.05, rng).link(name).inertial, 0.2) for name in links),
        Orbit(ORBIT.radius),
        (GravityGradient(),),
    )


def thrust_truth() -> mj.Truth:
    motion = mj.smooth_motion(2, 40.0, seed=11, amplitude=0.3, frequencies=(0.03, 0.05), ramp=20.0)
    pulses = [mj.Thrust(10.0, 14.0, force=(2.0, 0.0, 0.0)), mj.Thrust(20.0, 24.0, force=(0.0, 2.0, 0.0))]
    model = mj.TruthModel(PLANAR, orbit=ORBIT, accel_position=POINT, thrusts=pulses)
    return model.run(motion, np.arange(0.0, 40.01, 0.5), rate0=(0.01, -0.02, 0.015), step=0.1)


@pytest.mark.usefixtures("slow")
def test_motion_alone_leaves_the_scale_and_a_known_thrust_gives_it(planar_truth: mj.Truth) -> None:
    known, total, rng, like = {}, {}, np.random.default_rng(5), None
    model = whole_robot(rng)
    for name, truth in (("motion", planar_truth), ("thrust", thrust_truth())):
        like = Posterior.of(model, [recorded(truth, model.robot, rng)], step=STEP)
        posterior, optimum = maximise(like, np.random.default_rng(6))
        assert covers_all(posterior)
        noise = 4.0 * np.sqrt(2.0 * posterior.samples)
        assert posterior.samples - posterior.size - noise < optimum.chi2 < posterior.samples + noise
        known[name] = Knowledge.at(posterior, optimum.z)
        weights = np.array([item.endswith(".mass") for item in known[name].names], dtype=float)
        total[name] = (weights @ known[name].values, np.linalg.norm(weights @ known[name].factor))
    worst = directions(known["motion"])[0]
    assert worst.shrinkage == pytest.approx(0.0, abs=1e-6)
    said = describe(worst, known["motion"].values, known["motion"].prior_sd)
    assert said.startswith("all masses and inertias in proportion (the scale): not learnt")
    changes = worst.displacement / known["motion"].values
    scaled = [k for k, name in enumerate(worst.names) if name.split(".", 1)[1] in ("mass", "inertia.zz")]
    np.testing.assert_allclose(changes[scaled], changes[0], rtol=0.05)
    # the truth is 70 kg; with thrust it is found, without it is the prior's
    assert total["thrust"][1] < 0.02 * total["motion"][1]
    assert abs(total["thrust"][0] - 70.0) < 4.0 * total["thrust"][1]
    first = directions(known["thrust"])[0]
    assert not subject(first, known["thrust"].values, known["thrust"].prior_sd).startswith("all masses")
