"""Conversion of a study file into the objects that it describes: robot, model, manoeuvres and posterior."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from threadpoolctl import threadpool_limits

from bayesid._io.errors import InputError
from bayesid._io.progress import Progress, silent
from bayesid._io.store import file_key
from bayesid._math.threads import each_in_threads
from bayesid.app.schema import DesignSection, OtherSensor, RecordingSection, Study
from bayesid.app.schema.sensor_sections import FilteredSensor
from bayesid.app.study_to_conventions import recorded_as
from bayesid.app.study_to_encoders import encoder_noise, named_joint
from bayesid.app.user_files import run_user_file
from bayesid.design.criteria import Criterion, named_criteria
from bayesid.diagnosis.evidence.cause_sets import CausePrior
from bayesid.inference.conventions import refuse_conventions
from bayesid.inference.posterior import Posterior
from bayesid.inference.posterior_as_prior import InertialDraws, JointPrior, joint_prior
from bayesid.recording.convention import ConventionError
from bayesid.recording.joint_motion import MeasuredMotion
from bayesid.recording.plausibility import refuse_impossible_joints, unwrapped
from bayesid.recording.recording import JOINT_FAMILIES, WHEEL_SPEED, Recording
from bayesid.recording.wheel_motion import check_wheels
from bayesid.robot.body_prior import BodyPrior, Mixing
from bayesid.robot.robot import Load, Robot
from bayesid.robot.robot_size import RobotSize
from bayesid.robot.wheel import Wheel
from bayesid.simulation.effects import Effect, SensorBias, create, known_effects
from bayesid.simulation.effects.effect_parameters import PhysicalBound
from bayesid.simulation.joint_torques import TorqueSensor
from bayesid.simulation.model import RATE_SIGMA, Manoeuvre, Model, spread_links
from bayesid.simulation.orbit import Orbit
from bayesid.simulation.own_effects import check_own_effect
from bayesid.simulation.sensors import Filter, Noise, Sensor, SensorKind, White

if TYPE_CHECKING:
    from bayesid.diagnosis.loop_review import DiagnosisReview

__all__ = [
    "cause_prior",
    "criteria_of",
    "load_manoeuvres",
    "load_model",
    "load_posterior",
    "load_robot",
    "loop_review",
    "stated_bounds",
]

# distance of a sensor from the base's origin, in radii of the base, beyond which its unit must be wrong
FARTHEST = 10.0
CHANGE_SEED = 0  # seed of the draws of an uncertain mass-property change, so that a study always has the same prior


def load_posterior(
    study: Study | str | Path,
    window: int | None = None,
    progress: Progress = silent,
    executor: Executor | None = None,
) -> Posterior:
    """Read all files that a study names, and return its posterior.

    Parameters
    ----------
    study : Study or path
        Path of a study file, or the study that was read from it.
    window : int, optional
        Number of earlier blocks on which the whitening conditions each sample, by default the smallest that is
        accurate.
    progress : Progress, optional
        Receiver of the share of the recordings that is read.
    executor : concurrent.futures.Executor, optional
        As for `load_manoeuvres`.

    Raises
    ------
    InputError
        If a file is absent or a rule is broken; the message names file, place, value and remedy.
    """
    study = Study.of(study)
    model = load_model(study)
    manoeuvres = load_manoeuvres(study, model.robot, progress, executor)
    try:
        refuse_conventions(model, manoeuvres)
    except ConventionError as error:
        raise error.within(file=study.file) from None
    return Posterior.of(model, manoeuvres, window=window)


def load_robot(study: Study) -> Robot:
    """Return the robot with its loads; bodies with a prior in the study have the inertial parameters of its centre."""
    return _load_robot(study)[0]


def _load_robot(study: Study) -> tuple[Robot, JointPrior | None]:
    """Return the robot, and the joint prior from an earlier posterior if the study names one."""
    _refuse_absent(study.robot.urdf, study, "robot.urdf")
    robot = Robot.from_urdf(study.robot.urdf, nearest_physical=study.robot.nearest_physical)
    place = None
    try:
        for load in study.robot.loads:
            robot = robot.with_load(Load(load.name, load.link, load.parameters))
        for wheel in study.robot.wheels:
            robot = robot.with_wheel(Wheel(wheel.name, wheel.axis, wheel.inertia, wheel.position))
        place = "unknowns.bodies"
        for name in study.unknowns.bodies:
            robot.link(name)
            if name in study.unknowns.prior:
                robot = robot.with_inertial(name, study.unknowns.prior[name].parameters)
    except InputError as error:
        raise InputError(error.problem, file=study.file, place=error.place or place, remedy=error.remedy) from None
    carried = _carried(study, robot)
    for name, centre in zip(carried.names, carried.centres, strict=True) if carried else ():
        robot = robot.with_inertial(name, centre)
    return robot, carried


def _refuse_absent(file: Path, study: Study, place: str) -> None:
    if not file.is_file():
        raise InputError(f"there is no such file: {file}", file=study.file, place=place, remedy="Correct the path")


def _carried(study: Study, robot: Robot) -> JointPrior | None:
    """Return the joint prior from an earlier posterior, None where the study names no posterior.

    Further bodies of that posterior are included if the robot has them, because they were not known exactly and are
    correlated with the others.
    """
    section = study.unknowns
    if section.posterior is None:
        return None
    draws = InertialDraws.read(section.posterior)
    rest = [name for name in draws.names if name in robot.links and name not in section.bodies]
    try:
        draws, rng = draws.of_bodies([*section.bodies, *rest]), np.random.default_rng(CHANGE_SEED)
        for change in section.changes:
            draws = draws.changed(change.change, rng)
        return joint_prior(draws)
    except InputError as error:
        raise error.within(file=section.posterior) from None


def load_model(study: Study | str | Path) -> Model:
    """Return the model of a study, or of its file, after running its plugins."""
    study = Study.of(study)
    for plugin in study.model.plugins:
        run_user_file(Path(plugin), "model.plugins", "Correct the path of the plugin")
    robot, carried = _load_robot(study)
    try:
        priors, mixing = _priors(study, robot, carried)
        model = Model(
            robot=robot,
            sensors=_sensors(study),
            priors=priors,
            orbit=_orbit(study),
            effects=_effects(study),
            rate_sigma=_rate_sigma(study),
            mixing=mixing,
            torque=_torque(study, robot),
        )
        if study.model.noise:
            from bayesid.app.study_to_noise import with_stated_noise

            model = with_stated_noise(study, model)
        _check_levers(model)
        if study.design is not None:
            criteria_of(study.design)
        for effect in model.effects:
            check_own_effect(effect, robot, model.sensors)
    except InputError as error:
        raise error.within(file=study.file) from None
    return model


def criteria_of(section: DesignSection) -> tuple[Criterion, ...]:
    """Return the criteria by which a study designs; the plugins with those of a user's own must have run."""
    return named_criteria(section.criteria, section.rivals, section.options)


def _check_levers(model: Model) -> None:
    """Raise if a sensor lies so far from the base that its position is hardly in metres."""
    radius = RobotSize.of(model.robot).radius
    for sensor in model.sensors:
        distance = float(np.linalg.norm(sensor.position))
        if distance > FARTHEST * max(radius, 1.0):
            raise InputError(
                f"the sensor is {distance:.4g} m from the origin of the base, whose radius is {radius:.3g} m",
                place=f"sensors.{sensor.kind.value}.position",
                remedy="Give it in metres, in base axes",
            )


def _priors(study: Study, robot: Robot, carried: JointPrior | None) -> tuple[tuple[BodyPrior, ...], Mixing | None]:
    """Return the priors of the identified and then of the marginalised bodies, and the mixing of their joint prior."""
    section, spread = study.unknowns, study.robot.link_spread
    if carried is None:
        identified = [BodyPrior(name, robot.link(name).inertial, section.spread_of(name)) for name in section.bodies]
        return (*identified, *spread_links(robot, spread, section.bodies)), None
    known = carried.bodies([name for name in carried.names if name not in section.bodies])
    links = spread_links(robot, spread, carried.names)
    return (*known, *links), carried.mixing(links)


@threadpool_limits.wrap(limits=1)  # sums of several threads are slower here, and rounded by chance
def load_manoeuvres(
    study: Study | str | Path, robot: Robot, progress: Progress = silent, executor: Executor | None = None
) -> list[Manoeuvre]:
    """Read all recordings of a study, and return them as manoeuvres with smoothed joint motion.

    Parameters
    ----------
    study : Study or path
        Path of a study file, or the study that was read from it.
    robot : Robot
    progress : Progress, optional
        Receiver of the share that is read.
    executor : concurrent.futures.Executor, optional
        Executor whose workers read one recording each, instead of threads of this process; they find the files at the
        same paths.
    """
    study = Study.of(study)
    if not study.recordings:
        raise InputError("no [[recordings]]", file=study.file, remedy="Name at least one recording")
    _check_latitudes(study)
    manoeuvres: list[Manoeuvre] = []
    count = len(study.recordings)
    progress(0.0, "reading the recordings and smoothing the joints' motion")
    for manoeuvre in each_in_threads(partial(_load_manoeuvre, study, robot), study.recordings, executor):
        manoeuvres.append(manoeuvre)
        progress(len(manoeuvres) / count, f"recording {len(manoeuvres)} of {count} read, joint motion smoothed")
    _refuse_copies(study, manoeuvres)
    if not study.model.noise:
        return manoeuvres
    from bayesid.app.study_to_noise import without_stated_faults

    return without_stated_faults(study, load_model(study), manoeuvres)


def _refuse_copies(study: Study, manoeuvres: Sequence[Manoeuvre]) -> None:
    """Raise if two files hold the same readings of sensors; plans to simulate hold joint motion alone."""
    seen: dict[str, Path] = {}
    for number, (section, manoeuvre) in enumerate(zip(study.recordings, manoeuvres, strict=True), start=1):
        if {name.partition(".")[0] for name in manoeuvre.recording.channels} <= {"time", *JOINT_FAMILIES, WHEEL_SPEED}:
            continue
        if (same := seen.setdefault(file_key(section.file), section.file)) != section.file:
            problem = f"'{section.file.name}' has the same content as '{same.name}'"
            remedy = "Remove one: the same data would be counted twice"
            raise InputError(problem, file=study.file, place=f"recordings #{number}.file", remedy=remedy)


def _check_latitudes(study: Study) -> None:
    """Refuse recordings that do not say where on the orbit they were made if an effect of the model depends on it."""
    orbit, known = _orbit(study), known_effects()
    names = [label.partition(":")[0] for label in study.model.effects]
    placed = [name for name in names if name in known and known[name].uses_latitude(orbit)]
    for number, section in enumerate(study.recordings, start=1):
        if placed and section.argument_of_latitude is None:
            raise InputError(
                f"the key is missing, and {placed[0]!r} depends on the orbital position of the recording",
                file=study.file,
                place=f"recordings #{number}.argument_of_latitude",
                remedy="Give the argument of latitude at time 0 [rad], or omit the effect",
            )


def _load_manoeuvre(study: Study, robot: Robot, section: RecordingSection) -> Manoeuvre:
    """Read one recording of a study, and return it as a manoeuvre with smoothed joint motion."""
    number = study.recordings.index(section) + 1
    _refuse_absent(section.file, study, f"recordings #{number}.file")
    recording = unwrapped(Recording.read(section.file, recorded_as(study, section, robot)), robot)
    check_wheels(recording, robot.wheels)
    refuse_impossible_joints(recording, robot)  # before they are smoothed; what the base reads is weighed first
    for name in section.start:
        named_joint(name, robot, f"recordings #{number}.start.{name}", study.file)
    blocks = study.telemetry.blocks_per_second
    noise = encoder_noise(study, robot)
    motion = MeasuredMotion.from_recording(recording, robot, sigma=noise, start=section.start, blocks_per_second=blocks)
    return Manoeuvre(
        recording=recording,
        motion=motion,
        attitude=np.array(section.attitude),
        attitude_sigma=section.attitude_sigma,
        argument_of_latitude=section.argument_of_latitude or 0.0,
        blocks_per_second=blocks,
    )


def _orbit(study: Study) -> Orbit | None:
    if study.orbit is None:
        return None
    return Orbit(
        radius=study.orbit.radius,
        eccentricity=study.orbit.eccentricity,
        inclination=study.orbit.inclination,
        argument_of_perigee=study.orbit.argument_of_perigee,
        sun=study.orbit.sun,
    )


def _sensors(study: Study) -> tuple[Sensor, ...]:
    given = study.sensors
    sections = {SensorKind.RATE: given.rate, SensorKind.ACCEL: given.accel, SensorKind.ATTITUDE: given.attitude}
    sensors = [_sensor(kind, section.noise, section) for kind, section in sections.items() if section is not None]
    return (*sensors, *(_other_sensor(name, section) for name, section in given.other.items()))


def _sensor(kind: SensorKind, noise: Noise, section: FilteredSensor) -> Sensor:
    placed = section.model_dump(include={"mounting", "position"})
    return Sensor(kind, noise, **placed, filter=Filter(section.low_pass, section.decimate))


def _other_sensor(name: str, section: OtherSensor) -> Sensor:
    """Return a sensor of a kind that a plugin has registered."""
    place = f"sensors.other.{name}"
    try:
        kind = SensorKind.of(name)
    except InputError as error:
        raise error.within(place=place) from None
    sigma = section.sigma if isinstance(section.sigma, tuple) else (section.sigma,) * kind.size
    if len(sigma) != kind.size:
        remedy = f"Give one number, or one for each of {', '.join(kind.axes)}"
        raise InputError(f"got {len(sigma)} numbers for {kind.size} columns", place=f"{place}.sigma", remedy=remedy)
    return _sensor(kind, White(sigma), section)


def _torque(study: Study, robot: Robot) -> TorqueSensor | None:
    section = study.sensors.torque
    if section is None:
        return None
    given = section.sigma
    sigma = dict(given) if isinstance(given, Mapping) else {joint.name: given for joint in robot.joints}
    return TorqueSensor(tuple(sigma), tuple(sigma.values()))


def _effect(label: str, place: str) -> Effect:
    """Return the effect of a label; a verdict may also name what a study states elsewhere."""
    if label == "initial-rate":
        raise InputError(f"{label!r} is not an effect", place=place, remedy='Set initial_rate = "unknown" instead')
    try:
        return create(label)
    except InputError as error:
        from bayesid.diagnosis.noise import noise_faults  # here, since only a wrong label needs it

        if fault := noise_faults().get(label):
            keys = ", ".join(f"{quantity.name} = ..." for quantity in fault.quantities)
            remedy = f'State it under [model.noise] as "{label}" = {{ {keys} }}'
            raise InputError(f"{label!r} is a noise fault", place=place, remedy=remedy) from None
        raise error.within(place=place) from None


def _effects(study: Study) -> tuple[Effect, ...]:
    # a sensor with a bias_sigma in the study has a bias in the model, whether the effects name it or not
    biases: dict[str, Effect] = {
        kind.name: kind(section.bias_sigma)
        for section, kind in (
            (study.sensors.rate, SensorBias.of(SensorKind.RATE)),
            (study.sensors.accel, SensorBias.of(SensorKind.ACCEL)),
        )
        if section is not None and section.bias_sigma is not None
    }
    effects = [
        biases.pop(label) if label in biases else _effect(label, f"model.effects #{number}")
        for number, label in enumerate(study.model.effects, start=1)
    ]
    effects += biases.values()
    known = [effect.label for effect in effects]
    for label in study.model.priors:
        if label not in known:
            problem = f"prior of an effect that is not in the model: {label!r}"
            raise InputError(problem, place="model.priors", remedy=f"Effects in the model: {', '.join(known)}")
    return tuple(_with_prior(effect, study.model.priors.get(effect.label, {})) for effect in effects)


def _with_prior(effect: Effect, sigma: Mapping[str, float]) -> Effect:
    """Return the effect with other prior standard deviations of the parameters that ``sigma`` names."""
    keys = [parameter.name for parameter in effect.parameters]
    for key in sigma:
        if key not in keys:
            problem = f"effect {effect.label!r} has no parameter {key!r}"
            raise InputError(problem, place="model.priors", remedy=f"Parameters: {', '.join(keys)}")
    changed = copy.copy(effect)
    changed.parameters = tuple(p._replace(sigma=float(sigma.get(p.name, p.sigma))) for p in effect.parameters)
    return changed


def _rate_sigma(study: Study) -> float:
    if study.model.initial_rate == "zero":
        return 0.0
    return study.model.initial_rate_sigma or RATE_SIGMA


def stated_bounds(study: Study) -> dict[str, list[PhysicalBound]]:
    """Return the largest sizes that the study states, by the candidates' labels."""
    return {
        label: [PhysicalBound(unit, size, "Stated in the study.") for unit, size in sizes.items()]
        for label, sizes in study.diagnosis.bounds.items()
    }


def cause_prior(study: Study) -> CausePrior:
    """Return the study's prior of the number of causes, and of something generic."""
    return CausePrior(study.diagnosis.one_more_cause, study.diagnosis.outside_catalogue)


def loop_review(study: Study) -> DiagnosisReview:
    """Return the diagnosis of what a loop has flown, with what the study says of causes."""
    from bayesid.diagnosis.loop_review import DiagnosisReview

    stated = study.design is not None and "argument_of_latitude" in study.design.model_fields_set
    first = study.recordings[0].argument_of_latitude if study.recordings else None
    return DiagnosisReview(stated_bounds(study), cause_prior(study), stated or first is not None)
