"""The catalogue of effects as text: of each its explanation, its parameters with their priors, and what it needs."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

from bayesid._io.errors import InputError
from bayesid.diagnosis.candidates.initial_rate import LARGEST
from bayesid.diagnosis.noise import noise_faults
from bayesid.diagnosis.noise.noise_fault import NoiseFault
from bayesid.report.numbers import format_number, format_text, format_unit
from bayesid.robot.body_prior import BodyPrior
from bayesid.robot.robot import Robot
from bayesid.robot.wheel import Wheel
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import Parameter, Prior
from bayesid.simulation.effects.register import known_effects
from bayesid.simulation.joint_torques import TorqueSensor
from bayesid.simulation.model import RATE_SIGMA, Model
from bayesid.simulation.orbit import Orbit
from bayesid.simulation.sensors import Sensor, SensorKind, White

__all__ = ["CatalogueEntry", "catalogue", "entry_of", "example_model"]

WIDTH = 100  # width of the text in characters
EXAMPLE = "ets7"  # robot of the package for which sizes are given where there is no study

FAULT_OF_NOISE = "A diagnosis detects it in the residual and estimates its size; a study states it under [model.noise]."


@dataclass(frozen=True)
class CatalogueEntry:
    """Description of one effect in the catalogue.

    Attributes
    ----------
    name : str
        Name as in study files, with LINK, JOINT, WHEEL or AXIS where a place follows.
    summary, separated_by : str
        What the effect is, and what distinguishes it from others.
    parameters : tuple of str
        Parameters with units and priors.
    sizes : tuple of str
        Largest plausible sizes, with reasons; up to these a diagnosis takes every power of ten as equally probable.
    needs : tuple of str
        What a study must contain for the effect to exist or to be visible.
    names : tuple of str
        Names of the parameters, and of the quantities as which they are reported.
    """

    name: str
    summary: str
    separated_by: str = ""
    parameters: tuple[str, ...] = ()
    sizes: tuple[str, ...] = ()
    needs: tuple[str, ...] = ()
    names: tuple[str, ...] = ()

    def __str__(self) -> str:
        blocks = [
            ("", self.summary),
            ("", self.separated_by),
            *(("Parameter: ", line) for line in self.parameters),
            *(("Largest size ", line) for line in self.sizes),
            ("Needs: ", "; ".join(self.needs) or "nothing beyond a recording of the base"),
        ]
        return "\n".join([self.name, *(_indented(head, format_text(text)) for head, text in blocks if text)])


def catalogue(model: Model | None = None) -> list[CatalogueEntry]:
    """Return what is known of every effect, with sizes for a model's robot and orbit, or else for an example."""
    chosen = example_model() if model is None else model
    effects = [_entry(kind, chosen) for kind in known_effects().values()]
    return [*effects, *_entries_of_noise()]


def entry_of(name: str, entries: Sequence[CatalogueEntry]) -> CatalogueEntry:
    """Return the entry of an effect, whose name may have a place, such as ``payload:link6``.

    Raises
    ------
    InputError
        If there is no such effect.
    """
    known = {entry.name.partition(":")[0]: entry for entry in entries}
    key = name.partition(":")[0]
    if key not in known:
        raise InputError(f"unknown effect {name!r}", remedy=f"Choose from {', '.join(sorted(known))}")
    return known[key]


def example_model(*, torque: bool = False) -> Model:
    """Return a model in which effects can occur: ETS-VII in orbit with a wheel and all sensors, also of torques."""
    robot = Robot.shipped(EXAMPLE).with_wheel(Wheel("wheel1", (0.0, 0.0, 1.0), 0.1, (0.5, 0.0, 0.0)))
    joints = tuple(joint.name for joint in robot.joints)
    return Model(
        robot,
        tuple(Sensor(kind, White(1e-5)) for kind in SensorKind.known()),
        (BodyPrior(robot.base, robot.link(robot.base).inertial, 1.0),),
        Orbit(6.916e6, inclination=0.6, sun=(1.0, 0.0, 0.0)),
        torque=TorqueSensor(joints, (0.1,) * len(joints)) if torque else None,
    )


def _indented(head: str, text: str) -> str:
    return textwrap.fill(head + text, WIDTH, initial_indent="  ", subsequent_indent="    ")


def _entry(kind: type[Effect], model: Model) -> CatalogueEntry:
    examples = kind.instances(model) or kind.instances(_example_with(kind))
    effect = examples[0] if examples else None
    return CatalogueEntry(
        name=kind.name if effect is None else _name(effect, model.robot),
        summary=kind.summary or " ".join((kind.__doc__ or "").partition("\n\n")[0].split()),
        separated_by=kind.separated_by,
        parameters=() if effect is None else _parameters(effect),
        sizes=() if effect is None else _sizes(effect, model if kind.instances(model) else _example_with(kind)),
        needs=_needs(kind),
        names=() if effect is None else _known_by(effect),
    )


def _example_with(kind: type[Effect]) -> Model:
    """Return the example in which an effect occurs: some show only in torques, others are not carried into them."""
    plain = example_model()
    return plain if kind.instances(plain) else example_model(torque=True)


def _name(effect: Effect, robot: Robot) -> str:
    """Return the name of an effect with the sort of its place."""
    name, colon, place = effect.label.partition(":")
    if not colon:
        return name
    if place in robot.links:
        return f"{name}:LINK"
    if place in [wheel.name for wheel in robot.wheels]:
        return f"{name}:WHEEL"
    return f"{name}:JOINT" if place in [joint.name for joint in robot.joints] else f"{name}:AXIS"


def _parameters(effect: Effect) -> tuple[str, ...]:
    """Return the parameters in lines, one for those that share unit and prior."""
    if not effect.parameters:
        return ("none: physics determines its size",)
    groups = groupby(effect.parameters, key=lambda parameter: parameter[1:])
    lines = [_group(list(group)) for _, group in groups]
    if effect.per_recording:
        lines.append("with separate values in every recording")
    if [quantity.name for quantity in effect.quantities] != [parameter.name for parameter in effect.parameters]:
        alike = groupby(effect.quantities, key=lambda quantity: quantity.unit)
        parts = [f"{_names([quantity.name for quantity in group])} [{_unit(unit)}]" for unit, group in alike]
        lines.append(f"reported as {', '.join(parts)}")
    return tuple(lines)


def _known_by(effect: Effect) -> tuple[str, ...]:
    reported = (quantity.name for quantity in effect.quantities)
    return tuple(dict.fromkeys([*(parameter.name for parameter in effect.parameters), *reported]))


def _group(group: Sequence[Parameter]) -> str:
    return f"{_names([parameter.name for parameter in group])} [{_unit(group[0].unit)}]: {_prior(group[0])}"


def _names(names: Sequence[str]) -> str:
    return ", ".join(names) if len(names) <= 10 else f"{names[0]} to {names[-1]}"


def _unit(unit: str) -> str:
    return format_unit(unit) or "1"


def _prior(parameter: Parameter) -> str:
    mean, sigma = parameter.mean, parameter.sigma
    if parameter.prior is Prior.LOG_NORMAL:
        return f"log-normal, median {format_number(mean)}, standard deviation of the logarithm {format_number(sigma)}"
    if parameter.prior is Prior.UNIFORM:
        return f"uniform from {format_number(mean - sigma)} to {format_number(mean + sigma)}"
    return f"normal, mean {format_number(mean)}, standard deviation {format_number(sigma)}"


def _sizes(effect: Effect, model: Model) -> tuple[str, ...]:
    place = effect.label.partition(":")[2]
    where = f"{place} of {model.robot.name}" if place else model.robot.name
    amplitudes: dict[str, list[str]] = {}
    for quantity in effect.amplitude_quantities:
        amplitudes.setdefault(quantity.unit, []).append(quantity.name)
    return tuple(
        f"of {_names(amplitudes[bound.unit])} for {where}: "
        f"{f'{format_number(bound.largest)} {format_unit(bound.unit)}'.rstrip()}. {bound.reason}"
        for bound in effect.physical_bounds(model)
    )


def _without(kind: SensorKind) -> Callable[[Model], Model]:
    return lambda model: replace(model, sensors=tuple(sensor for sensor in model.sensors if sensor.kind != kind))


def _in_orbit(change: Callable[[Orbit], Orbit]) -> Callable[[Model], Model]:
    return lambda model: replace(model, orbit=model.orbit and change(model.orbit))


TAKEN_AWAY: dict[str, Callable[[Model], Model]] = {
    "[[robot.wheels]]": lambda model: replace(model, robot=replace(model.robot, wheels=())),
    "[orbit]": lambda model: replace(model, orbit=None),
    "inclination in [orbit]": _in_orbit(lambda orbit: replace(orbit, inclination=None)),
    "sun in [orbit]": _in_orbit(lambda orbit: replace(orbit, sun=None)),
    "[sensors.torque]": lambda model: replace(model, torque=None),
}
"""Parts of a study, and how a model loses them."""


def _needs(kind: type[Effect]) -> tuple[str, ...]:
    """Return the parts of a study without which the effect does not occur, found by taking each away."""
    whole = _example_with(kind)
    if not kind.instances(whole):
        return ("explicit arguments, since it has no default instance in the example",)
    sensors = {f"[{sensor.kind.section}]": _without(sensor.kind) for sensor in whole.sensors}
    taken = {**TAKEN_AWAY, **sensors}
    needs = [part for part, take in taken.items() if not kind.instances(take(whole))]
    if kind.needs_latitude:
        needs.append("argument_of_latitude in every recording")
    return tuple(needs)


def _entries_of_noise() -> list[CatalogueEntry]:
    """Return the entries of what a diagnosis names and no effect describes: faults of noise, a turning start."""
    start = CatalogueEntry(
        name="initial-rate",
        summary="The base was already turning when the recording began; the model assumes that it starts from rest.",
        parameters=(
            f"x, y, z [rad/s]: normal, mean 0, standard deviation initial_rate_sigma, by default {RATE_SIGMA:g}",
            "with separate values in every recording",
        ),
        sizes=(f"of x, y, z for any robot: {LARGEST:g} rad/s. A base that turns faster is visibly not at rest.",),
        needs=('initial_rate = "zero" in [model]',),
    )
    faults = {fault.entry: fault for fault in noise_faults().values()}
    kinds = [type(fault) for fault in faults.values()]
    alike = sorted(faults.items(), key=lambda item: kinds.index(type(item[1])))  # faults of one kind together
    return [
        start,
        *(
            CatalogueEntry(name, fault.summary, FAULT_OF_NOISE, (fault.parameters,), needs=(_needs_of_noise(fault),))
            for name, fault in alike
        ),
    ]


def _needs_of_noise(fault: NoiseFault) -> str:
    sensor = fault.entry.removesuffix("-noise")
    return f"[sensors.{sensor}]" if sensor in {kind.value for kind in SensorKind.known()} else fault.needs
