"""The generator of hidden studies keeps the laws of physics, and its faults have the contract's signs."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from studies.truth import hidden_causes
from studies.truth import mujoco as mj
from studies.truth.bodies import SERVICER3, SERVICER4, join, link_body
from studies.truth.hidden_causes import causes as hide
from studies.truth.hidden_causes.causes import merge

REST = (np.zeros(3), np.zeros(3), np.zeros(3))
CATALOGUE = {
    *("gravity-gradient", "initial-rate", "wheel-momentum", "aerodynamic-drag", "solar-pressure", "magnetic-dipole"),
    *("thruster-leak", "rotational-drag", "flexible-appendage", "fuel-slosh", "payload", "link-inertia"),
    *("joint-flexibility", "rate-bias", "rate-drift", "rate-scale", "rate-misalignment", "accel-bias", "accel-drift"),
    *("accel-scale", "accel-misalignment", "accel-position", "rate-latency", "accel-latency", "joint-latency"),
    *("encoder-offset", "rate-noise", "accel-noise", "coloured-noise", "outliers", "quantisation"),
    *("encoder-noise", "rate-clock", "accel-clock", "attitude-misalignment", "wheel-history", "mass-shift"),
}


def momentum(model: mj.TruthModel) -> tuple[np.ndarray, float]:
    """Angular momentum about the centre of mass and kinetic energy of the state that was read last."""
    mujoco.mj_subtreeVel(model.model, model.data)
    mass = np.zeros((model.model.nv, model.model.nv))
    mujoco.mj_fullM(model.model, model.data, mass)
    return model.data.subtree_angmom[1].copy(), 0.5 * model.data.qvel @ mass @ model.data.qvel


def still(time: float) -> tuple[np.ndarray, ...]:
    return REST


def with_and_without(folder: Path, name: str) -> tuple[pd.DataFrame, pd.DataFrame, dict]:
    """First recordings of a case at strength 1 and at (almost) none: their noise is the same."""
    make = next(c.make for c in hidden_causes.CASES if c.name == name)
    files = make(folder / "with", 3), make(folder / "without", 3, 1e-9)
    tables = [pd.read_csv(file.with_name("manoeuvre-1.csv")) for file in files]
    return *tables, tomllib.loads(files[0].read_text())


def test_hidden_springs_and_movers_keep_the_angular_momentum() -> None:
    model = mj.TruthModel(
        SERVICER3,
        appendages=[
            mj.slosh(12.0, [0.4, 0.2, -0.5], 0.2),
            mj.panel(8.0, (2.0, 0.7), [0.0, 0.8, 0.1], [1.0, 0.0, 0.3], 0.3),
        ],
        movers=[mj.Mover(mj.Body(3.0, np.array([0.2, 0.1, 0.4]), 0.01 * np.eye(3)), (0.0, 1.0, 1.0), 0.4, 8.0)],
        flexible=[mj.Flexibility("joint2", 0.5)],
    )
    motion = mj.smooth_motion(3, 20.0, 5, amplitude=0.8, frequencies=(0.1, 0.2), ramp=6.0)
    found = []
    for end in (0.0, 8.9, 14.0, 20.0):
        model.run(motion, [end], rate0=(0.02, -0.03, 0.01), step=0.05)
        found.append(momentum(model)[0])
    assert np.ptp(np.linalg.norm(found, axis=1)) < 1e-6 * np.linalg.norm(found[0])
    np.testing.assert_allclose(found, np.tile(found[0], (4, 1)), atol=2e-6 * np.linalg.norm(found[0]))


def test_leak_does_its_work() -> None:
    force, torque = np.array([0.3, -0.2, 0.4]), np.array([0.1, 0.2, -0.15])
    model = mj.TruthModel(SERVICER3, fields=[mj.leak(force, torque)])
    times = np.arange(0.0, 20.001, 0.05)
    truth = model.run(still, times, rate0=(0.01, 0.02, -0.03), step=0.1)
    end = momentum(model)[1]
    model.run(still, [0.0], rate0=(0.01, 0.02, -0.03))
    start = momentum(model)[1]
    # the accelerometer sits at the base's origin, where the force acts
    axes = Rotation.from_quat(truth.attitude)
    accel = axes.apply(truth.accel)
    middle = np.diff(times)[:, None] * 0.5 * (accel[1:] + accel[:-1])
    velocity = np.vstack([np.zeros(3), np.cumsum(middle, axis=0)])
    power = (axes.apply(force) * velocity).sum(1) + truth.rate @ torque
    assert np.trapezoid(power, times) == pytest.approx(end - start, rel=1e-4)


def test_brake_takes_energy_and_pulses_add_their_impulse() -> None:
    model = mj.TruthModel(SERVICER3, fields=[mj.braking([2.0, 2.0, 2.0])])
    energies = []
    for end in (0.0, 10.0):
        model.run(still, [end], rate0=(0.02, 0.01, 0.03))
        energies.append(momentum(model)[1])
    assert energies[1] < energies[0]
    model = mj.TruthModel(SERVICER3, fields=[mj.pulses([0.0, 0.0, 1e-6], every=20.0, length=4.0, start=7.0)])
    model.run(still, [40.0], step=0.25)
    np.testing.assert_allclose(momentum(model)[0], [0.0, 0.0, 8e-6], atol=1e-10)


def test_drag_and_magnetic_torque_point_as_they_should() -> None:
    orbit = mj.Orbit(7e6, argument_of_latitude=0.5 * np.pi, inclination=0.5 * np.pi, sun=(0.0, 1.0, 0.0))
    # over the pole of a polar orbit: zenith is north, the field points down with twice its size on the equator
    size = mj.EARTH_FIELD * (mj.EARTH_RADIUS / 7e6) ** 3
    np.testing.assert_allclose(orbit.magnetic_field(0.0), [-2.0 * size, 0.0, 0.0], atol=1e-12)
    # a quarter of an orbit past the node the direction "along-orbit" of the node is the zenith
    force, torque = mj.sunlight(orbit, 2.0, [0.0, 0.0, 1.0])(0.0, np.eye(3), np.zeros(3))
    np.testing.assert_allclose(force, [-2.0, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(torque, [0.0, -2.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(mj.drag(orbit, 1.0, np.zeros(3))(0.0, np.eye(3), np.zeros(3))[0], [0, -1, 0], atol=1e-12)
    eccentric = mj.Orbit(8e6, 0.1, 0.7, 1.3)
    at = [mj.MU ** (1 / 3) * gradient ** (-1 / 3) * up for up, gradient in map(eccentric.zenith, (99.99, 100.01))]
    ahead = at[1] - at[0]
    np.testing.assert_allclose(eccentric.heading(100.0), ahead / np.linalg.norm(ahead), atol=1e-7)


def test_soft_joint_swings_at_its_frequency() -> None:
    """With the base all but immovable a kicked joint rings as its parameters say."""
    model = mj.TruthModel(SERVICER3, flexible=[mj.Flexibility("joint3", 0.5, damping=0.0)])
    model.model.body_mass[1], model.model.body_inertia[1] = 1e9, 1e9
    state = np.zeros(model.model.nq + model.model.nv)
    state[3], deflection = 1.0, 1e-3
    spring = model._spring_v[0]
    state[1 + spring] = deflection
    found = []
    for _ in range(40):
        state = model._step(still, 0.0, state, 0.025)
        found.append(state[1 + spring])
    np.testing.assert_allclose(found, deflection * np.cos(np.pi * 0.025 * np.arange(1, 41)), atol=2e-6)


def test_positive_latency_shows_the_past(tmp_path: Path) -> None:
    def table(**delays: float) -> pd.DataFrame:
        sensors = mj.Sensors(rate_sigma=0.0, accel_sigma=0.0, encoder_sigma=0.0, **delays)
        plan = mj.Manoeuvres(count=1, duration=50.0)
        mj.write_study(tmp_path, SERVICER3, np.random.default_rng(1), sensors=sensors, manoeuvres=plan, step=0.25)
        return pd.read_csv(tmp_path / "manoeuvre-1.csv")

    plain = table()
    for channel, key in (("rate", "rate_delay"), ("accel", "accel_delay"), ("position", "encoder_delay")):
        late = table(**{key: 0.5})
        columns = [name for name in plain if name.startswith(channel)]
        # half a second is one sample: the late column is the plain one a row earlier
        np.testing.assert_allclose(late[columns].to_numpy()[1:], plain[columns].to_numpy()[:-1], atol=1e-10)
        others = [name for name in plain if name not in columns]
        np.testing.assert_allclose(late[others], plain[others], atol=1e-10)


def test_payload_is_in_the_truth_only(tmp_path: Path) -> None:
    link = link_body(SERVICER4, "link4")
    added = mj.Body(2.0, np.array([0.1, 0.0, 0.2]), 0.01 * np.eye(3))
    plain, loaded = mj.TruthModel(SERVICER4), mj.TruthModel(SERVICER4, changed={"link4": mj.join(link, added)})
    assert loaded.model.body_mass.sum() - plain.model.body_mass.sum() == pytest.approx(2.0)
    options = {"guess_spread": 0.0, "manoeuvres": mj.Manoeuvres(count=1, duration=40.0), "step": 0.5}
    parts = mj.Hidden(changed={"link4": mj.join(link, added)})
    mj.write_study(tmp_path, SERVICER4, np.random.default_rng(1), hidden=parts, **options)
    assert mj.TruthModel(tmp_path / "robot.urdf").model.body_mass.sum() == pytest.approx(plain.model.body_mass.sum())
    with pytest.raises(ValueError, match="no link"):
        mj.TruthModel(SERVICER4, changed={"link9": added})


def test_faults_have_the_contract_signs() -> None:
    truth = mj.Truth(np.array([0.0, 2.0]), *([None] * 9))
    table = {"rate.x": np.array([1.0, 1.0]), "rate.y": np.zeros(2), "rate.z": np.zeros(2)}
    fault = hidden_causes.VectorFault(
        "rate", [0.0, 0.0, 5.0], [0.0, 0.0, 1.0], [1.0, 1.0, 0.0], [0.0, 0.0, 0.5 * np.pi]
    )
    fault(table, truth)
    np.testing.assert_allclose(np.transpose([table[f"rate.{a}"] for a in "xyz"]), [[0, 2, 5], [0, 2, 7]], atol=1e-12)
    table = {"position.joint1": np.zeros(2)}
    hidden_causes.EncoderOffset("joint1", 0.1)(table, truth)
    np.testing.assert_allclose(table["position.joint1"], 0.1)


def test_faults_after_the_noise_have_their_statistics() -> None:
    times, generator = np.arange(0.0, 20000.0, 0.5), np.random.default_rng(1)

    def error(fault: mj.Spoiling) -> np.ndarray:
        table = {f"rate.{axis}": np.zeros(len(times)) for axis in "xyz"}
        fault(table, times, generator)
        return np.stack(list(table.values()))

    coloured = error(hidden_causes.ColouredNoise("rate", 2.0, 4.0))
    assert coloured.std() == pytest.approx(2.0, rel=0.05)
    assert (coloured[:, :-8] * coloured[:, 8:]).mean() / coloured.var() == pytest.approx(np.exp(-1.0), abs=0.05)
    wild = error(hidden_causes.Outliers("rate", 0.02, 1e-3))
    assert (wild != 0.0).mean() == pytest.approx(0.02, rel=0.1)
    assert np.abs(wild[wild != 0.0]).min() > 0.01
    assert np.abs(wild).max() < 0.02


def test_causes_change_the_data_and_not_the_study(tmp_path: Path) -> None:
    with_bias, without, study = with_and_without(tmp_path, "accel-bias")
    change = with_bias.filter(like="accel.") - without.filter(like="accel.")
    assert np.linalg.norm(change.mean()) == pytest.approx(8e-6, rel=1e-3)
    assert change.std().max() < 1e-12
    assert study["model"]["effects"] == ["gravity-gradient"]
    assert "bias" not in str(study)


def test_table_covers_the_catalogue() -> None:
    hidden_names = {
        name.split(":")[0] for case in hidden_causes.CASES if case.status == "effect" for name in case.causes
    }
    assert hidden_names == CATALOGUE
    assert len({case.name for case in hidden_causes.CASES}) == len(hidden_causes.CASES)
    statuses = [case.status for case in hidden_causes.CASES]
    assert statuses.count("unknown") >= 4
    assert statuses.count("adequate") >= 6
    assert sum(len(case.causes) == 2 for case in hidden_causes.CASES) >= 3


def test_two_understated_noises_are_both_declared() -> None:
    """What one cause declares does not take away what the other does."""
    case = next(case for case in hidden_causes.CASES if case.name == "rate-noise, accel-noise")
    first, second = (build(np.random.default_rng(0), 1.0) for build in case.builds)
    both = merge(first, second)["declared"]
    assert both == {**first["declared"], **second["declared"]}
    assert len(both) == 2


def test_two_causes_cannot_spoil_the_same_samples() -> None:
    spoilt = hide.outliers("rate", np.random.default_rng(0), 1.0)
    with pytest.raises(ValueError, match="common cause"):
        merge(spoilt, spoilt)


def test_a_mass_that_jumps_has_a_start_in_each_recording_and_changes_the_moments_of_the_base() -> None:
    """Moments about the base's origin, of the base joined with the body before and after it has moved."""
    mover = mj.Mover(
        mj.Body(2.0, np.array([0.3, -0.1, 0.2]), 0.01 * np.eye(3)), (0.0, 0.6, 0.8), 0.5, 1.0, 0.1, (3.0, 7.0)
    )
    assert [mover.in_recording(index).start for index in (0, 1)] == [3.0, 7.0]
    assert mover.in_recording(1).motion(7.1)[0] == 0.5
    base = link_body(SERVICER3, "base_link")
    moved = replace(mover, body=mover.body._replace(com=mover.body.com + np.array([0.0, 0.3, 0.4])))
    change = [joined_moments(base, item.body) for item in (mover, moved)]
    np.testing.assert_allclose(mover.moments, change[1] - change[0], atol=1e-12)


def joined_moments(base: mj.Body, part: mj.Body) -> np.ndarray:
    """First moments and second moments xx, yy, zz, xy, xz, yz of two bodies joined, from their rotational inertia."""
    whole = join(base, part)
    about = whole.inertia + whole.mass * (whole.com @ whole.com * np.eye(3) - np.outer(whole.com, whole.com))
    second = 0.5 * np.trace(about) * np.eye(3) - about
    return np.concatenate([whole.mass * whole.com, second[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]])
