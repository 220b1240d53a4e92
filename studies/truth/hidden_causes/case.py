"""Cases: studies that hide something, and the answer.

With strength 1 most causes change the sensors by 20 to 60 standard deviations that neither the base body nor the
initial rates can imitate; that number grows in proportion to the strength.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from studies.truth.hidden_causes.sensor_faults import EncoderOffset, TurnedStarSensor, VectorFault, WrongClock
from studies.truth.motions import Manoeuvres
from studies.truth.mujoco.study import Hidden, Study, write_study
from studies.truth.numerics import Array
from studies.truth.orbit import Orbit
from studies.truth.readings import Truth
from studies.truth.recordings import Distortion, Sensors, Table

__all__ = ["Build", "Case", "Generator", "Options", "circumstances", "direction", "in_turn", "merge"]

Generator = np.random.Generator

Options = dict[str, Any]
"""Keywords of `studies.truth.mujoco.write_study`."""

Build = Callable[[Generator, float], Options]
"""Source of random numbers and strength -> keywords that hide one thing."""


@dataclass(frozen=True)
class Case:
    """A study that can be written, and the answer.

    Parameters
    ----------
    name : str
    causes : tuple of str
        The contract's names for what is hidden; empty for nulls and for outside effects.
    status : str
        "effect", "adequate" or "unknown" (outside the catalogue).
    builds : tuple of callable
        (draw, strength) -> keywords of `write_study`, one for each thing hidden.
    urdf : path
    fixed : dict
        Further keywords.
    accept : tuple of str
        Names that are as right as one of the causes, since they change the model alike; outside the catalogue, causes
        that come as close as unknown.
    frame : str, optional
        Axes in which an outside wrench is fixed; "orbit" are those of each recording's start.
    """

    name: str
    causes: tuple[str, ...]
    status: str
    builds: tuple[Build, ...]
    urdf: Path
    fixed: Options
    accept: tuple[str, ...] = ()
    frame: str | None = None

    def write(self, folder: str | Path, seed: int, strength: float = 1.0) -> Study:
        """Write the study; circumstances, motions and noise follow from the seed and do not depend on the strength."""
        return _write(self.urdf, self._causes(seed, strength), self.fixed, folder, seed)

    def make(self, folder: str | Path, seed: int, strength: float = 1.0) -> Path:
        """Write the study and return its file."""
        return self.write(folder, seed, strength).file

    def amplitudes(self, seed: int, strength: float = 1.0) -> dict[str, Array]:
        """Magnitudes of what is hidden, by cause, for causes that are a vector or a number."""
        true: dict[str, Array] = {}
        for options in self._causes(seed, strength):
            hidden = options.get("hidden", Hidden())
            if hidden.rotor is not None:
                true["wheel-momentum"] = np.asarray(hidden.rotor.momentum)
            for mover in hidden.movers:
                true["mass-shift"] = mover.moments
            fault = options.get("distort")
            if isinstance(fault, VectorFault):
                sizes = {key: np.asarray(value) for key, value in vars(fault).items() if key != "sensor"}
                true |= {f"{fault.sensor}-{key}": value for key, value in sizes.items() if value.any()}
            if isinstance(fault, EncoderOffset):
                true[f"encoder-offset:{fault.joint}"] = np.array([fault.offset])
            if isinstance(fault, WrongClock):
                true[f"{fault.sensor}-clock"] = np.array([fault.rate])
            if isinstance(fault, TurnedStarSensor):
                true["attitude-misalignment"] = np.asarray(fault.vector)
            for key, value in options.get("sensors", {}).items():
                name = key.removesuffix("_delay").replace("encoder", "joint")
                true[f"{name}-latency"] = np.array([value])
        return true

    def torque(self, seed: int, strength: float, truth: Truth) -> Array:
        """Torque of hidden fields along a motion, base axes, (n, 3) [N m]."""
        fields = [field for options in self._causes(seed, strength) for field in options["hidden"].fields]
        turns = Rotation.from_quat(truth.attitude).as_matrix()
        rows = zip(truth.times, turns, truth.rate, strict=True)
        return np.array([sum((field(*row)[1] for field in fields), np.zeros(3)) for row in rows])

    def _causes(self, seed: int, strength: float) -> list[Options]:
        return [build(np.random.default_rng([seed, 2 + i]), strength) for i, build in enumerate(self.builds)]


def direction(draw: Generator, size: float = 1.0) -> Array:
    """Random vector of given length, no component near zero."""
    vector = draw.choice([-1.0, 1.0], 3) * draw.uniform(0.5, 1.0, 3)
    return size * vector / np.linalg.norm(vector)


def _triple(vector: Array) -> tuple[float, float, float]:
    x, y, z = vector.tolist()
    return x, y, z


def circumstances(draw: Generator, count: int = 3) -> Options:
    """Orbit, places on it, manoeuvres and sensors of a study, drawn at random; they do not depend on what is hidden."""
    sun = _triple(direction(draw))
    orbit = Orbit(radius=float(draw.uniform(6.75e6, 7.1e6)), inclination=float(draw.uniform(0.6, 1.6)), sun=sun)
    return {
        "orbit": orbit,
        "latitudes": draw.uniform(0.0, 2.0 * np.pi, count).tolist(),
        "manoeuvres": Manoeuvres(count=count, duration=float(draw.choice([140.0, 150.0, 160.0]))),
        "sensors": Sensors(accel_position=_triple(np.round(direction(draw, 0.4), 3))),
        "step": 0.25,
    }


def merge(first: Options, second: Options) -> Options:
    """Keywords of two causes joined; what both hide in the robot or in the sensors acts together."""
    merged = {**first, **second}
    if "hidden" in first and "hidden" in second:
        mine, other, nothing = vars(first["hidden"]), vars(second["hidden"]), vars(Hidden())
        merged["hidden"] = Hidden(**{k: other[k] if other[k] != nothing[k] else mine[k] for k in mine})
    if "distort" in first and "distort" in second:
        merged["distort"] = in_turn(first["distort"], second["distort"])
    if "spoil" in first and "spoil" in second:
        raise ValueError("two causes spoil samples of one study: give them a common cause")
    if "declared" in first and "declared" in second:
        merged["declared"] = {**first["declared"], **second["declared"]}
    if "step" in first and "step" in second:
        merged["step"] = min(first["step"], second["step"])
    return merged


def in_turn(*distortions: Distortion) -> Distortion:
    """Distortion that applies the given ones one after the other."""

    def both(table: Table, truth: Truth) -> None:
        for distortion in distortions:
            distortion(table, truth)

    return both


def _write(urdf: Path, builds: Sequence[Options], fixed: Options, folder: str | Path, seed: int) -> Study:
    """Write the study in which all builds act together."""
    options = circumstances(np.random.default_rng([seed, 1]))
    causes: Options = {}
    for build in builds:
        causes = merge(causes, build)
    for changes in (fixed, causes):
        for key, value in changes.items():
            # a mapping changes some fields of what the circumstances are
            options[key] = replace(options[key], **value) if isinstance(value, dict) and key in options else value
    # the study may declare its sensors otherwise than they are
    declared = options.pop("declared", None)
    if declared is not None:
        options["declared"] = replace(options["sensors"], **declared)
    if "declared_offset" in options:
        options["declared_accel_position"] = np.add(options["sensors"].accel_position, options.pop("declared_offset"))
    return write_study(folder, urdf, np.random.default_rng(seed), title="Free-flyer", **options)
