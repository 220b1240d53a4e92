"""A satellite of reaction wheels without an arm, slewed in MuJoCo, and studies written from its slews."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from studies.truth.bodies import Body, read_urdf, write_urdf, wrong_guess
from studies.truth.mujoco.model import TruthModel
from studies.truth.mujoco.parts import DrivenWheel
from studies.truth.numerics import Array
from studies.truth.recordings import Table, Truth, by_axis, write_csv

URDF = """<?xml version="1.0"?>
<robot name="satellite">
  <link name="base_link">
    <inertial>
      <origin xyz="0.02 -0.01 0.03"/>
      <mass value="24.0"/>
      <inertia ixx="0.62" ixy="0.02" ixz="-0.03" iyy="0.74" iyz="0.01" izz="0.51"/>
    </inertial>
  </link>
</robot>
"""

TILT = 54.7  # of the axes of a pyramid of four wheels, whose momenta are alike in all directions [degrees]


class Mounted(NamedTuple):
    """A wheel as a study declares it; axis in base axes, inertia [kg m2], position [m]."""

    name: str
    axis: tuple[float, float, float]
    inertia: float
    position: tuple[float, float, float]


def pyramid(inertia: float = 1.2e-3, reach: float = 0.12) -> list[Mounted]:
    """Return four wheels on the edges of a pyramid."""
    wheels = []
    for number, angle in enumerate(np.radians([45.0, 135.0, 225.0, 315.0]), start=1):
        across, up = np.sin(np.radians(TILT)), np.cos(np.radians(TILT))
        axis = (float(across * np.cos(angle)), float(across * np.sin(angle)), float(up))
        position = (float(reach * np.cos(angle)), float(reach * np.sin(angle)), -0.08)
        wheels.append(Mounted(f"wheel{number}", axis, inertia, position))
    return wheels


@dataclass(frozen=True)
class Fault:
    """What a study has wrong of one wheel.

    The true inertia is the declared one times `inertia`; the axis is turned by `tilt` [rad] about the first two base
    axes; the speed stamped t is that of t - `delay` [s], times `scale`. `static` [kg m] and `dynamic` [kg m2] are
    imbalances in a direction across the axis.
    """

    inertia: float = 1.0
    tilt: tuple[float, float] = (0.0, 0.0)
    delay: float = 0.0
    scale: float = 1.0
    static: float = 0.0
    dynamic: float = 0.0


@dataclass(frozen=True)
class Course:
    """Speed of a wheel: a mean and cosines; angle, speed and acceleration at any time."""

    mean: float
    size: Array
    omega: Array
    phase: Array

    def __call__(self, time: float) -> tuple[float, float, float]:
        """Return them at a time [s]."""
        angle = self.omega * time + self.phase
        return (
            self.mean * time + float((self.size / self.omega * np.sin(angle)).sum()),
            self.mean + float((self.size * np.cos(angle)).sum()),
            -float((self.size * self.omega * np.sin(angle)).sum()),
        )


@dataclass(frozen=True)
class Slews:
    """Recordings of a satellite whose wheels change speed about a mean [rad/s], both ways of turning."""

    count: int = 3
    duration: float = 60.0
    period: float = 0.5
    mean: float = 60.0
    size: float = 40.0
    frequencies: tuple[float, ...] = (0.02, 0.05)
    rate_sigma: float = 1e-5
    accel_sigma: float = 1e-5
    speed_sigma: float = 0.0
    accel_position: tuple[float, float, float] = (0.1, -0.05, 0.08)
    wheels: Sequence[Mounted] = field(default_factory=pyramid)
    step: float = 0.05

    def course(self, generator: np.random.Generator) -> Course:
        """Return the course of one wheel in one recording."""
        count = len(self.frequencies)
        omega = 2.0 * np.pi * np.array(self.frequencies) * generator.uniform(0.7, 1.3, count)
        size = self.size * generator.uniform(0.5, 1.0, count) / np.sqrt(count)
        mean = self.mean * generator.choice([-1.0, 1.0]) * generator.uniform(0.7, 1.3)
        return Course(float(mean), size, omega, generator.uniform(0.0, 2.0 * np.pi, count))


class SlewStudy(NamedTuple):
    """A written study: its file, the true base body and what truly happened in each recording."""

    file: Path
    base: Body
    truths: tuple[Truth, ...]


def off_axis(axis: Array) -> Array:
    """Return the direction across an axis in which imbalances lie at angle zero."""
    across = np.cross(axis, [0.3, -0.5, 0.8])
    return np.asarray(across / np.linalg.norm(across))


def driven(wheel: Mounted, fault: Fault, course: Callable[[float], tuple[float, float, float]]) -> DrivenWheel:
    """Return a wheel as it truly is."""
    true = Rotation.from_rotvec([*fault.tilt, 0.0]).as_matrix() @ np.array(wheel.axis)
    across = off_axis(true)
    x, y, z = true.tolist()
    return DrivenWheel(
        (x, y, z),
        fault.inertia * wheel.inertia,
        course,
        wheel.position,
        0.4,
        tuple(fault.static * across),
        tuple(fault.dynamic * np.cross(true, across)),
    )


def write_slews(
    folder: str | Path,
    generator: np.random.Generator,
    *,
    slews: Slews = Slews(),
    faults: dict[str, Fault] | None = None,
    guess_spread: float = 0.1,
    title: str = "Satellite of wheels",
) -> SlewStudy:
    """Write robot.urdf, slew-N.csv and study.toml into a folder.

    Parameters
    ----------
    folder : path
    generator : numpy.random.Generator; source of the courses, the initial values, the guess and the noise
    slews : Slews
    faults : dict, optional; what is wrong with wheels, by their names
    guess_spread : float; how wrong the base of the study's URDF is, see `wrong_guess`
    title : str
    """
    folder, faults = Path(folder), faults or {}
    folder.mkdir(parents=True, exist_ok=True)
    urdf = folder / "true.urdf"
    urdf.write_text(URDF, encoding="utf-8")
    times = np.round(slews.period * np.arange(round(slews.duration / slews.period) + 1), 9)
    truths, attitudes = [], []
    base = read_urdf(urdf).bodies["base_link"]
    for number in range(1, slews.count + 1):
        attitude = generator.standard_normal(4)
        attitudes.append(attitude / np.linalg.norm(attitude))
        courses = [slews.course(generator) for _ in slews.wheels]
        pairs = zip(slews.wheels, courses, strict=True)
        true = [driven(wheel, faults.get(wheel.name, Fault()), course) for wheel, course in pairs]
        model = TruthModel(urdf, wheels=true, accel_position=slews.accel_position)
        base = model.base
        rate = 2e-3 * generator.standard_normal(3)
        truth = model.run(still, times, rate0=rate, attitude0=attitudes[-1], step=slews.step)
        truths.append(truth)
        table: Table = {}
        for name, values, sigma in (("rate", truth.rate, slews.rate_sigma), ("accel", truth.accel, slews.accel_sigma)):
            table |= by_axis(name, "xyz", values + sigma * generator.standard_normal(values.shape))
        for wheel, course in zip(slews.wheels, courses, strict=True):
            fault = faults.get(wheel.name, Fault())
            speed = np.array([course(time - fault.delay)[1] for time in times])
            noise = slews.speed_sigma * generator.standard_normal(len(times))
            table[f"wheel_speed.{wheel.name}"] = fault.scale * speed + noise
        write_csv(folder / f"slew-{number}.csv", times, table)
    write_urdf(urdf, folder / "robot.urdf", wrong_guess(base, generator, guess_spread))
    urdf.unlink()
    file = folder / "study.toml"
    file.write_text(_study(title, slews, attitudes), encoding="utf-8")
    return SlewStudy(file, base, tuple(truths))


def still(time: float) -> tuple[Array, Array, Array]:
    """Motion of no joints."""
    return np.zeros(0), np.zeros(0), np.zeros(0)


def _study(title: str, slews: Slews, attitudes: Sequence[Array]) -> str:
    lines = [f'title = "{title}"', "[robot]", 'urdf = "robot.urdf"']
    for wheel in slews.wheels:
        lines += ["[[robot.wheels]]", f'name = "{wheel.name}"', f"axis = {list(wheel.axis)}"]
        lines += [f"inertia = {wheel.inertia}", f"position = {list(wheel.position)}"]
    lines += ["[sensors.rate]", f"sigma = {slews.rate_sigma}", "[sensors.accel]", f"sigma = {slews.accel_sigma}"]
    lines += [f"position = {list(slews.accel_position)}"]
    for number, attitude in enumerate(attitudes, start=1):
        lines += ["[[recordings]]", f'file = "slew-{number}.csv"', f"attitude = {attitude.tolist()}"]
    lines += ["[telemetry]", "blocks_per_second = 0", "[unknowns]", 'bodies = ["base_link"]', ""]
    return "\n".join(lines)
