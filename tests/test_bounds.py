"""Largest plausible sizes of all effects: stated for everything, as physics says, and above what the truths hide."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from bayesid._io.errors import InputError
from bayesid.robot.inertial_parameters import InertialParameters
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import kinematics
from bayesid.robot.log_cholesky import relative_coordinates
from bayesid.robot.robot import Load, Robot
from bayesid.robot.robot_size import RobotSize, beyond_joint, half_edges, link_radius
from bayesid.robot.wheel import Wheel
from bayesid.simulation.effects import Effect, Parameter, PhysicalBound, Prior, bounds_by_label, create, known_effects
from bayesid.simulation.effects.environment_effects import SURGE, largest_density
from bayesid.simulation.joint_torques import TorqueSensor
from bayesid.simulation.model import Model
from bayesid.simulation.orbit import EARTH_RADIUS, Orbit
from bayesid.simulation.sensors import Sensor, SensorKind, White
from studies.truth import hidden_causes
from studies.truth import mujoco as mj
from studies.truth.bodies import BRANCHED, SERVICER3, SERVICER4, link_body
from studies.truth.hidden_causes.catalogue import Case, circumstances
from studies.truth.hidden_causes.causes import merge
from studies.truth.mujoco.parts import Appendage

SENSORS = (
    Sensor(SensorKind.RATE, White(1e-5)),
    Sensor(SensorKind.ACCEL, White(1e-5)),
    Sensor(SensorKind.ATTITUDE, White(1e-5)),
)
ROBOTS = {
    "ets7": Robot.shipped("ets7"),
    "planar": Robot.shipped("planar"),
    **{file.stem: Robot.from_urdf(file) for file in (SERVICER3, SERVICER4, BRANCHED)},
}
ROBOTS = {name: robot.with_wheel(Wheel("wheel1", (0.0, 0.0, 1.0), 0.01)) for name, robot in ROBOTS.items()}
ETS7 = ROBOTS["ets7"]


def at(altitude: float, robot: Robot = ETS7, **options: float) -> Model:
    """The robot on an orbit of this altitude [km] that has all effects of the environment."""
    orbit = Orbit(EARTH_RADIUS + 1e3 * altitude, inclination=0.6, sun=(0.6, 0.0, 0.8), **options)
    return Model(robot, SENSORS, (), orbit)


def with_torque(model: Model) -> Model:
    joints = tuple(joint.name for joint in model.robot.joints)
    return replace(model, torque=TorqueSensor(joints, (0.01,) * len(joints)))


def every_effect(model: Model) -> list[Effect]:
    """All shipped effects at all places, with torque sensors those that show in them alone."""
    kinds = [kind for kind in known_effects().values() if kind.__module__.startswith("bayesid.")]
    return [effect for kind in kinds for effect in kind.instances(model) or kind.instances(with_torque(model))]


def sizes(label: str, model: Model) -> dict[str, float]:
    """The bounds of one effect by their units."""
    effect = create(label).attach(model.robot)
    return {bound.unit: bound.largest for bound in effect.physical_bounds(model)}


def scaled(robot: Robot, mass: float = 1.0, length: float = 1.0) -> Robot:
    """The robot with all masses and all lengths multiplied; a large one has no edges at the limit of steel."""
    text = robot.to_urdf()
    for pattern, factor in (
        (r'xyz="([^"]*)"(?=[^>]*rpy)', length),
        (r'(?<=mass )value="([^"]*)"', mass),
        *((f'{key}="([^"]*)"', mass * length**2) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")),
    ):

        def larger(found: re.Match[str], factor: float = factor) -> str:
            values = " ".join(repr(factor * float(word)) for word in found[1].split())
            return found[0].replace(f'"{found[1]}"', f'"{values}"')

        text = re.sub(pattern, larger, text)
    return Robot.from_string(text)


# every effect ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ROBOTS)
def test_every_effect_has_one_bound_for_each_unit_of_its_amplitudes(name):
    model = at(550.0, ROBOTS[name])
    effects = every_effect(model)
    assert {effect.name for effect in effects} == {
        name for name, kind in known_effects().items() if kind.__module__.startswith("bayesid.")
    }
    for effect in effects:
        bounds = effect.physical_bounds(model)
        assert tuple(bound.unit for bound in bounds) == effect.amplitude_units, effect.label
        assert bounds or effect.name == "gravity-gradient", effect.label
        for bound in bounds:
            assert 0.0 < bound.largest < np.inf, effect.label
            assert re.fullmatch(r"[A-Z].{20,}[^.]\.", bound.reason), bound.reason
            assert "prior" not in bound.reason, f"{effect.label} states nothing physical"


def test_the_linear_form_of_an_effect_has_the_same_bounds():
    model = at(550.0)
    attached = [effect.attach(model.robot) for effect in every_effect(model)]
    linear = [(effect, effect.in_amplitudes()) for effect in attached]
    changed = [(effect, form) for effect, form in linear if form is not effect]
    names = {"aerodynamic-drag", "solar-pressure", "joint-flexibility", "payload", "wheel-inertia"}
    assert {effect.name for effect, _ in changed} == names
    for effect, form in changed:
        assert form.physical_bounds(model) == effect.physical_bounds(model)


class Breeze(Effect):
    """An effect that says nothing of its size, with a shape and two kinds of amplitudes."""

    name = "breeze"
    parameters = (
        Parameter("force", "N", 0.1),
        Parameter("other", "N", 0.2),
        Parameter("moment", "N m", 1.0, 4.0, Prior.LOG_NORMAL),
        Parameter("frequency", "Hz", 1.0, 2.0, Prior.LOG_NORMAL),
    )
    absent = np.array([0.0, 0.0, 0.0, 2.0])


def test_without_a_physical_bound_the_prior_is_taken_and_said():
    force, moment = Breeze().physical_bounds(at(550.0))
    assert (force.unit, moment.unit) == ("N", "N m") == Breeze().amplitude_units
    assert force.largest == pytest.approx(0.6)
    assert moment.largest == pytest.approx(4.0 * np.exp(3.0))
    assert "prior" in force.reason


def test_a_user_may_know_better():
    model = at(550.0)
    effects = [create("thruster-leak"), create("rate-bias")]
    better = PhysicalBound("N", 1e-4, "The valves were measured before the launch.")
    bounds = bounds_by_label(effects, model, {"thruster-leak": [better]})
    assert bounds["thruster-leak"] == (better, effects[0].physical_bounds(model)[1])
    assert bounds["rate-bias"] == effects[1].physical_bounds(model)
    with pytest.raises(InputError, match="is not among the effects"):
        bounds_by_label(effects, model, {"accel-bias": [better]})
    with pytest.raises(InputError, match="stated in 'N'"):
        bounds_by_label(effects, model, {"rate-bias": [better]})


@pytest.mark.parametrize("largest", [0.0, -1.0, np.inf, np.nan])
def test_a_bound_is_a_positive_number(largest):
    with pytest.raises(InputError, match="not a positive number"):
        PhysicalBound("N", largest, "Because.")


def test_a_bound_has_a_reason():
    with pytest.raises(InputError, match="no reason"):
        PhysicalBound("N", 1.0, "")


def test_drag_without_an_orbit_is_refused():
    with pytest.raises(InputError, match="only in orbit"):
        create("aerodynamic-drag").physical_bounds(Model(ETS7, SENSORS, ()))


# the atmosphere -------------------------------------------------------------------------------------------------------

VALLADO = {200.0: 2.789e-10, 400.0: 3.725e-12, 600.0: 1.454e-13, 800.0: 1.170e-14}
"""Densities [kg/m3] at altitudes [km] of Vallado 2013, table 8-4, which has the solar cycle averaged."""


@pytest.mark.parametrize("altitude", VALLADO)
def test_air_at_solar_maximum_is_one_to_five_times_as_dense_as_published_for_the_mean(altitude):
    ratio = largest_density(1e3 * altitude) / SURGE / VALLADO[altitude]
    assert 1.0 < ratio < 5.0


def test_the_solar_cycle_matters_more_the_higher_the_orbit():
    ratios = [largest_density(1e3 * altitude) / density for altitude, density in VALLADO.items()]
    assert ratios == sorted(ratios)


def test_air_is_thinner_the_higher_and_never_gone():
    density = np.array([largest_density(1e3 * altitude) for altitude in (*range(100, 3000, 10), 36000, 1000000)])
    assert (np.diff(np.log(density)) < 0.0).all()
    assert density[-1] > 0.0
    steps = -np.diff(np.log(density[:-2]))
    assert (steps[10:] < 0.6).all()  # from 200 km on, ten kilometres never make more than a factor of two
    assert steps[140] == pytest.approx(steps[139], rel=0.05)  # from the table to the isothermal atmosphere above it


def test_below_the_table_the_air_of_100_km_is_taken():
    assert largest_density(0.0) == largest_density(1e5)


# drag and light -------------------------------------------------------------------------------------------------------


def test_drag_of_ets7_at_400_km_is_plausible():
    """A body of 2.2 m x 2.1 m and panels of some 20 m2 at Vallado's mean density: 6 mN (ETS-VII's area is assumed)."""
    ordinary = 0.5 * 2.2 * 3.725e-12 * 7669.0**2 * 25.0
    assert ordinary == pytest.approx(6.0e-3, rel=0.02)
    bound = sizes("aerodynamic-drag", at(400.0))
    assert 3.0 < bound["N"] / ordinary < 30.0  # solar maximum, a storm, and more area
    assert 1.0 < bound["N m"] / bound["N"] < 6.0  # a lever within the spacecraft


def test_drag_falls_with_the_air_and_the_speed():
    low, high = (sizes("aerodynamic-drag", at(altitude)) for altitude in (400.0, 700.0))
    speed = (EARTH_RADIUS + 400e3) / (EARTH_RADIUS + 700e3)
    wanted = largest_density(700e3) / largest_density(400e3) * speed
    for unit in ("N", "N m"):
        assert high[unit] / low[unit] == pytest.approx(wanted)
    assert sizes("solar-pressure", at(400.0)) == sizes("solar-pressure", at(700.0))


def test_drag_on_an_eccentric_orbit_is_that_of_its_perigee():
    eccentric = at(0.0, eccentricity=0.0)
    perigee = EARTH_RADIUS + 400e3
    orbit = Orbit(perigee / 0.9, 0.1)
    assert orbit.perigee_altitude == pytest.approx(400e3)
    ratio = sizes("aerodynamic-drag", replace(eccentric, orbit=orbit))["N"] / sizes("aerodynamic-drag", at(400.0))["N"]
    assert ratio == pytest.approx(1.1)  # the square of the speed, by the vis-viva equation


def test_the_speed_at_the_perigee_is_that_of_the_orbit_s_state():
    orbit = Orbit(7.5e6, 0.08)
    zenith = orbit.state(np.array([0.0, 1e-3])).zenith  # at the perigee
    angle = np.arctan2(zenith[1, 1], zenith[1, 0])
    radius = orbit.perigee_altitude + EARTH_RADIUS
    assert angle / 1e-3 * radius == pytest.approx(orbit.perigee_speed, rel=1e-6)


# size and mass --------------------------------------------------------------------------------------------------------

POWERS = {  # effect -> unit -> powers of mass and of length; panels' area goes with mass
    "magnetic-dipole": {"A m2": (1, 0)},
    "thruster-leak": {"N": (1, 0), "N m": (1, 1)},
    "rotational-drag": {"N m s": (1, 2)},
    "wheel-momentum": {"N m s": (1, 1)},
    "wheel-history:z": {"N m s": (1, 1), "N m": (1, 1)},
    "flexible-appendage": {"sqrt(kg)": (0.5, 0), "sqrt(kg) m": (0.5, 1)},
    "fuel-slosh": {"kg": (1, 0)},
    "mass-shift": {"kg m": (1, 1), "kg m2": (1, 2)},
    "payload:link6": {"kg": (1, 0), "kg m": (1, 1), "kg m2": (1, 2)},
    "link-inertia:link2": {"1": (0, 0)},
    "joint-friction:joint3": {"N m": (1, 2), "N m s": (1, 2)},
    "torque-bias:joint3": {"N m": (1, 2)},
    "accel-position": {"m": (0, 1)},
    "rate-bias": {"rad/s": (0, 0)},
    "thruster-pulses": {"N": (1, 0), "N m": (1, 1)},
    "kicks": {"N m s": (1, 2)},
    "thermal-snap": {"N m s": (1, 2)},
    "rate-bias-jump": {"rad/s": (0, 0)},
    "accel-bias-jump": {"m/s2": (0, 0)},
    "encoder-offset:joint1": {"rad": (0, 0)},
}


@pytest.mark.parametrize("label", POWERS)
def test_bounds_grow_with_mass_and_size_as_physics_says(label):
    small, heavy, large = (sizes(label, at(550.0, scaled(ETS7, *by))) for by in ((1.0, 10.0), (3.0, 10.0), (1.0, 20.0)))
    for unit, (mass, length) in POWERS[label].items():
        assert heavy[unit] == pytest.approx(small[unit] * 3.0**mass, rel=1e-6)
        assert large[unit] == pytest.approx(small[unit] * 2.0**length, rel=1e-6)


def test_force_and_torque_of_light_grow_with_area():
    small, heavy, large = (RobotSize.of(scaled(ETS7, *by)) for by in ((1.0, 10.0), (3.0, 10.0), (1.0, 20.0)))
    panels = 0.02 * ETS7.mass
    assert large.area - panels == pytest.approx(4.0 * (small.area - panels))
    assert heavy.area - small.area == pytest.approx(2.0 * panels)
    size, light = RobotSize.of(ETS7), sizes("solar-pressure", at(550.0))
    assert light["N"] == pytest.approx(2.0 * 4.56e-6 * size.area)
    assert light["N m"] == pytest.approx(2.0 * 4.56e-6 * size.area_moment)


def test_the_box_of_a_box_is_that_box():
    edges, mass = np.array([3.0, 2.0, 0.5]), 40.0
    tensor = mass / 12.0 * np.diag([4.25, 9.25, 13.0])
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    body = InertialParameters(mass, [1.0, 2.0, 3.0], turn @ tensor @ turn.T)
    np.testing.assert_allclose(half_edges(body), edges / 2.0)


def test_a_body_without_extent_is_a_cube_of_steel():
    body = InertialParameters(7.8, np.zeros(3), np.zeros((3, 3)))
    np.testing.assert_allclose(half_edges(body), 0.05)
    assert (half_edges(InertialParameters(0.0, np.zeros(3), np.zeros((3, 3)))) == 0.0).all()


@pytest.mark.parametrize("name", ROBOTS)
def test_no_posture_takes_a_body_beyond_the_stated_inertia(name):
    """The inertia of what a joint carries, about its axis, in random postures by Pinocchio, links as their boxes."""
    robot = ROBOTS[name]
    rng = np.random.default_rng(3)
    lower = [-0.9 if joint.kind == "prismatic" else -np.pi for joint in robot.joints]
    position = rng.uniform(lower, np.negative(lower), size=(200, len(robot.joints)))
    pose = kinematics(robot, JointState(position, 0.0 * position, 0.0 * position)).pose
    for joint in range(len(robot.joints)):
        mass, inertia = beyond_joint(robot, joint)
        total, found = 0.0, np.zeros(len(pose))
        for link in robot.links.values():
            parents, above = [], link.joint
            while above >= 0:
                parents.append(above)
                above = robot.model.parents[above + 2] - 2
            if joint not in parents:
                continue
            second = np.diag([*(half_edges(link.inertial) ** 2 / 3.0)]).sum() * link.inertial.mass
            com = pose[:, link.joint] @ link.placement @ np.array([*link.inertial.com, 1.0])
            found += second + link.inertial.mass * np.square(com[:, :3] - pose[:, joint, :3, 3]).sum(axis=1)
            total += link.inertial.mass
        assert mass == pytest.approx(max(total, 1e-3))
        assert (found < inertia * (1.0 + 1e-9)).all()
        assert found.max() > 0.2 * inertia


def test_torques_of_a_slide_are_forces():
    model = with_torque(Model(Robot.from_string(BRANCHED.read_text()), SENSORS, ()))
    for name, units in (("joint-friction", ("N", "N s/m")), ("torque-bias", ("N",))):
        effect = create(f"{name}:slide").attach(model.robot)
        assert tuple(item.unit for item in effect.parameters) == units
        assert tuple(bound.unit for bound in effect.physical_bounds(model)) == units
        assert effect.attach(model.robot).parameters == effect.parameters
        hinge = create(f"{name}:{model.robot.joints[0].name}").attach(model.robot)
        assert hinge.parameters[0].unit == "N m"


def test_a_slide_is_extended_to_its_limit():
    short, long = (Robot.from_string(BRANCHED.read_text().replace('upper="1"', f'upper="{x}"')) for x in (1, 5))
    slide = short.joint_index("slide")
    assert beyond_joint(long, slide) == beyond_joint(short, slide)
    assert RobotSize.of(long).area_moment > RobotSize.of(short).area_moment


def test_what_hangs_on_a_link_counts_to_its_extent():
    assert link_radius(ETS7, "link6") >= 0.53  # the tip
    assert link_radius(ETS7, "link2") >= 0.87  # joint 3
    load = Load("target", "link6", InertialParameters(400.0, [0.0, 0.0, 2.0], 70.0 * np.eye(3)))
    bare, loaded = RobotSize.of(ETS7), RobotSize.of(ETS7.with_load(load))
    assert loaded.mass == bare.mass + 400.0
    assert loaded.area > bare.area + 0.02 * 400.0
    assert loaded.radius == bare.radius
    joint = len(ETS7.joints) - 1
    assert beyond_joint(ETS7.with_load(load), joint).inertia > 100.0 * beyond_joint(ETS7, joint).inertia


def test_a_joint_that_carries_nothing_keeps_bounds_above_zero():
    text = (
        '<robot name="r"><link name="b"><inertial><mass value="5"/><inertia ixx="1" iyy="1" izz="1"/></inertial></link>'
    )
    text += '<link name="e"/><joint name="j" type="revolute"><parent link="b"/><child link="e"/><axis xyz="0 0 1"/>'
    text += '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'
    robot = Robot.from_string(text)
    assert all(size > 0.0 for size in sizes("joint-friction:j", Model(robot, SENSORS, ())).values())


# what the truths hide -------------------------------------------------------------------------------------------------


def largest_of(*vectors: Sequence[float]) -> float:
    return float(max(np.abs(np.ravel(vector)).max() for vector in vectors))


def vibration(part: Appendage, label: str) -> dict[str, float]:
    """Coupling of one unit of a hinged panel's modal speed, or the mass that sloshes."""
    if label == "fuel-slosh":
        return {"kg": part.body.mass}
    hinge, arm = np.asarray(part.hinges[0]), part.body.com - np.asarray(part.anchor)
    speed = np.cross(hinge, arm)
    inertia = hinge @ part.body.inertia_about(np.asarray(part.anchor)) @ hinge
    angular = part.body.inertia @ hinge + part.body.mass * np.cross(part.body.com, speed)
    linear = part.body.mass * speed
    return {"sqrt(kg)": largest_of(linear) / np.sqrt(inertia), "sqrt(kg) m": largest_of(angular) / np.sqrt(inertia)}


def pushed(field: mj.Field) -> dict[str, float]:
    """Force and torque about the base origin of a field at time 0, base at rest in orbit axes."""
    force, torque = field(0.0, np.eye(3), np.zeros(3))
    return {"N": largest_of(force), "N m": largest_of(torque)}


def hidden_sizes(case: Case, seed: int) -> dict[str, dict[str, float]]:
    """Sizes by unit of what a case of one or more causes hides at strength 1, by its contract's name."""
    found: dict[str, dict[str, float]] = {}
    options: dict = {}
    for index, build in enumerate(case.builds):
        options = merge(options, build(np.random.default_rng([seed, 2 + index]), 1.0))
    hidden = options.get("hidden", mj.Hidden())
    for name in case.causes:
        kind, _, place = name.partition(":")
        if kind in ("aerodynamic-drag", "solar-pressure"):
            field = hidden.environment[0]
            force, cp = field.keywords["force"], field.keywords["cp"]
            found[name] = {"N": force, "N m": force * largest_of(cp)}
        elif kind == "magnetic-dipole":
            found[name] = {"A m2": largest_of(hidden.environment[0].keywords["moment"])}
        elif kind == "thruster-leak":
            found[name] = pushed(hidden.fields[0])
        elif kind == "rotational-drag":
            found[name] = {"N m s": largest_of(hidden.fields[0](0.0, np.eye(3), np.ones(3))[1])}
        elif kind in ("flexible-appendage", "fuel-slosh"):
            found[name] = vibration(hidden.appendages[0], kind)
        elif kind in ("payload", "link-inertia"):
            true, told = (
                InertialParameters(b.mass, b.com, b.inertia)
                for b in (hidden.changed[place], link_body(case.urdf, place))
            )
            change = np.abs(true.vector - told.vector)
            moments = {"kg": change[0], "kg m": largest_of(change[1:4]), "kg m2": largest_of(change[4:])}
            found[name] = moments if kind == "payload" else {"1": largest_of(relative_coordinates(told, true))}
        elif kind == "joint-flexibility":
            omega, damping = 2.0 * np.pi * hidden.flexible[0].frequency, hidden.flexible[0].damping
            found[name] = {"s2": omega**-2, "s3": 2.0 * damping * omega**-3}
        elif kind == "wheel-history":
            wheel = hidden.fields[0]
            torques = np.diff(wheel.momentum) / np.diff(wheel.times)
            found[name] = {"N m s": largest_of(wheel.momentum), "N m": largest_of(torques)}
        elif kind == "accel-position":
            found[name] = {"m": largest_of(options["declared_offset"])}
    for name, vector in case.amplitudes(seed).items():
        if name in case.causes:
            units = [quantity.unit for quantity in create(name).amplitude_quantities]
            found[name] = {
                unit: largest_of([value for value, own in zip(vector, units, strict=True) if own == unit])
                for unit in units
            }
    return found


NO_AMPLITUDES = {"gravity-gradient", "initial-rate", "rate-noise", "accel-noise", "coloured-noise", "outliers"} | {
    "quantisation",
    "encoder-noise",
}
"""Names of the contract that are no effect with amplitudes: physics without a size, initial values, and noise."""

CASES = [
    case
    for case in hidden_causes.CASES
    if case.status == "effect" and not {cause.partition(":")[0] for cause in case.causes} & NO_AMPLITUDES
]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_what_the_truths_hide_is_plausible(case):
    """In twenty drawn circumstances, among them orbits of 370 to 720 km.

    Light, and drag on the highest of these orbits, come to nine tenths of their bounds, and with half the area of solar
    panels, which is assumed, both would be above: these truths are as strong as such spacecraft allow. All others stay
    below 0.4 of their bounds.
    """
    robot = Robot.from_urdf(case.urdf)
    for seed in range(20):
        orbit = circumstances(np.random.default_rng([seed, 1]))["orbit"]
        model = Model(robot, SENSORS, (), Orbit(orbit.radius, inclination=orbit.inclination, sun=orbit.sun))
        hidden = hidden_sizes(case, seed)
        assert hidden.keys() == set(case.causes)
        for name, true in hidden.items():
            bounds = sizes(name, model)
            assert true.keys() == bounds.keys()
            for unit, size in true.items():
                most = 1.0 if name in ("aerodynamic-drag", "solar-pressure") else 0.4
                assert size < most * bounds[unit], f"{name}: {size:.3g} {unit} in the truth, {bounds[unit]:.3g} at most"


def test_every_effect_of_the_catalogue_is_among_them():
    """All shipped effects but torque sensors, gravity without a size, and wheels, which have truths of their own."""
    shown = {cause.partition(":")[0] for case in CASES for cause in case.causes}
    shipped = {name for name, kind in known_effects().items() if kind.__module__.startswith("bayesid.")}
    wheels = {"wheel-inertia", "wheel-tilt", "wheel-latency", "wheel-imbalance"}  # tests/test_wheel_faults.py
    wheels |= {"joint-backlash"}  # tests/test_displaced_motion.py
    events = {"thruster-pulses", "kicks", "thermal-snap", "rate-bias-jump", "accel-bias-jump"}  # hidden by test_events
    assert shipped - shown == {"gravity-gradient", "joint-friction", "torque-bias"} | wheels | events
