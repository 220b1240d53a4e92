"""Refusal of recordings whose numbers cannot be in SI units, before anything is fitted.

Readings are compared with those that the joints' motion should cause with the robot as it is given. A factor that no
plausible error of the robot explains is refused. Some units are too near for that or look like others, and are refused
where the data contradict seconds or m/s2 and agree with the other unit:

- Times in milliseconds make all motion a thousand times slower, and what acts on the base meanwhile hides the joints'
  share. No reading then follows the prediction, and all do once times are divided by a thousand.
- Times in minutes make all motion sixty times faster, so that rates are sixty and accelerations 3600 times smaller than
  predicted. The readings of several sensors agree once times are multiplied by sixty, which no other slip brings about.
- Accelerations in g are 9.8 times too small, as those of a heavier base would be. But the acceleration that the base's
  turning adds at the accelerometer is known from the rates whatever the base weighs. Both units are fitted with
  noise that is a share of the readings, so that neither the declared noise nor a small cause that the model lacks
  decides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.inference.mode import fit
from bayesid.inference.posterior import Posterior
from bayesid.inference.predicted_readings import PredictedReadings, readings_at_start
from bayesid.recording.convention import Convention, ConventionError, in_one_line
from bayesid.recording.joint_motion import Motion
from bayesid.recording.plausibility import refuse_impossible_joints, refuse_impossible_motion
from bayesid.recording.recording import Recording
from bayesid.recording.units import STANDARD_GRAVITY, UNITS
from bayesid.robot.joint_state import JointState
from bayesid.simulation.model import Manoeuvre
from bayesid.simulation.sensors import SensorKind, White

__all__ = ["refuse_wrong_units"]

WRONG_UNIT = 15.0
"""Ratio of measured to predicted readings that no plausible error of the robot explains."""

FOLLOWING = 0.8
"""Correlation of measured with predicted readings from which on they follow the joints' motion."""

LOUD = 5.0
"""Root mean square of readings over their noise from which on they can be judged."""

TIMES = {"milliseconds": 1e-3, "minutes": 60.0}
"""Units of time that users give by mistake [s]."""

SHORT = {"milliseconds": "ms", "minutes": "min"}
"""Their names in a study."""

GRAVITY = STANDARD_GRAVITY

NEAR = 3.0
"""Factor by which the robot as given may miss the readings where a unit is named."""

ROUGH = 0.05
"""Noise over the root mean square of the readings in the fits of accelerations in m/s2 and in g."""

BETTER = 4.0
"""Chi-square of accelerations in m/s2 over that in g from which on they are in g; one would be no difference, and
MuJoCo's recordings give 20 to 24 in g, and 1/270 in m/s2."""


def refuse_wrong_units(posterior: Posterior) -> None:
    """Refuse recordings whose numbers cannot be in s, rad, rad/s, m/s2 or N m.

    Raises
    ------
    InputError
        If a joint leaves its limits, or the readings of a sensor are many times larger or smaller than predicted, or
        times are in milliseconds or minutes, or accelerations are in g.
    """
    for manoeuvre in posterior.manoeuvres:
        refuse_impossible_motion(manoeuvre.recording, posterior.model.robot)
    compared = _compared(posterior)
    for seen in compared:
        _refuse_times(posterior, seen)
    _refuse_gravities(posterior, compared)
    for manoeuvre, seen in zip(posterior.manoeuvres, compared, strict=True):
        for comparison in seen:
            _refuse_factor(manoeuvre.recording, comparison)


@dataclass(frozen=True)
class _Comparison:
    """Measured readings of one sensor and those that the model predicts at the same times.

    Attributes
    ----------
    index : int
        Number of the recording.
    kind : SensorKind or None
        Sensor of the base, None for a joint torque.
    column, unit : str
        Name and unit of the columns in error messages.
    mistaken : str
        Unit that users most often give instead.
    time : (n,) array
        Sample times [s].
    measured, expected : (n, axes) arrays
        Measured and predicted readings, without their parabola in time.
    sigma : float
        Standard deviation of the white noise.
    """

    index: int
    kind: SensorKind | None
    column: str
    unit: str
    mistaken: str
    time: Floats
    measured: Floats
    expected: Floats
    sigma: float

    @property
    def loud(self) -> bool:
        """Whether the readings stand out of the noise."""
        return float(np.sqrt((self.measured**2).mean())) > LOUD * self.sigma

    @property
    def factor(self) -> float:
        """Measured over predicted readings where they follow the prediction, else not a number."""
        energy, cross = float((self.expected**2).sum()), float((self.measured * self.expected).sum())
        size = float(np.sqrt(energy * (self.measured**2).sum()))
        return cross / energy if abs(cross) > FOLLOWING * size > 0.0 else np.nan


def _compared(posterior: Posterior) -> list[list[_Comparison]]:
    """Return the comparisons of every recording with what is predicted at the starting point."""
    predictions = readings_at_start(posterior)
    return [_comparisons(posterior, index, predicted) for index, predicted in enumerate(predictions)]


def _comparisons(posterior: Posterior, index: int, predicted: PredictedReadings) -> list[_Comparison]:
    comparisons = []
    for sensor in posterior.model.sensors:
        if sensor.kind.mounted:
            kind = sensor.kind
            time, measured = posterior.data.measured(index, kind)
            expected = predicted.channels[kind][np.searchsorted(predicted.time, time)]
            sigma = float(posterior.data.sigma(index, kind).max())
            readings = (time, _detrend(time, measured), _detrend(time, expected), sigma)
            comparisons.append(_Comparison(index, kind, f"{kind.value}.x|y|z", kind.unit, kind.slip, *readings))
    if (torque := posterior.model.torque) is not None:
        time, measured = posterior.data.torques(index)
        expected = predicted.torque[np.searchsorted(predicted.time, time)]
        kinds = {joint.name: joint.kind for joint in posterior.model.robot.joints}
        for k, (joint, sigma) in enumerate(zip(torque.joints, torque.sigma, strict=True)):
            one = slice(k, k + 1)
            unit = "N" if kinds[joint] == "prismatic" else "N m"
            readings = (time, _detrend(time, measured[:, one]), _detrend(time, expected[:, one]), sigma)
            mistaken = "mN m or at the motor before the gear"
            comparisons.append(_Comparison(index, None, f"torque.{joint}", unit, mistaken, *readings))
    return comparisons


def _refuse_factor(recording: Recording, seen: _Comparison) -> None:
    if not seen.loud or np.isnan(seen.factor):
        return
    if abs(seen.factor) > WRONG_UNIT:
        raise ConventionError(
            _nearest_unit(seen),
            f"the readings follow the joints' motion but are {seen.factor:.3g} times what this robot can cause",
            file=recording.file or recording.name,
            place=f"column {seen.column}",
            remedy=f"Give them in {seen.unit}, not in {seen.mistaken}, or correct the robot",
        )
    if abs(seen.factor) < 1.0 / WRONG_UNIT:
        raise ConventionError(
            _nearest_unit(seen),
            f"the readings follow the joints' motion but are {1.0 / seen.factor:.3g} times smaller than what it causes",
            file=recording.file or recording.name,
            place=f"column {seen.column}",
            remedy=f"Give them in {seen.unit}, joint positions in radians and times in seconds, or correct the robot",
        )


def _nearest_unit(seen: _Comparison) -> list[Convention]:
    """Return the convention that readings are in the unit that is nearest to their factor, or in one of their own."""
    family = "" if seen.kind is None else seen.kind.value
    off = {
        unit: abs(np.log(abs(seen.factor) * factor)) for unit, factor in UNITS.get(family, {}).items() if factor != 1.0
    }
    unit = min(off, key=lambda name: off[name], default="")
    if not family:
        return []
    if not unit or off[unit] > np.log(NEAR):
        line = f"[sensors.{family}]\nscale = {1.0 / abs(seen.factor):.3g}"
        text = (
            f"The readings of {family} are in no standard unit, for example in counts. The factor is estimated from "
            "the robot model: use the value of the data sheet."
        )
        return [Convention(f"convention:unit:{family}", family, line, text)]
    line, text = f'[sensors.{family}]\nunit = "{unit}"', f"The readings of {family} are in {unit}."
    return [Convention(f"convention:unit:{family}", family, line, text)]


@dataclass(frozen=True)
class _OtherTimes:
    """Motion of joints with times in another unit [s]."""

    motion: Motion
    unit: float

    def evaluate(self, time: Floats) -> JointState:
        """Return the joint state at the times, shape (T,)."""
        state = self.motion.evaluate(np.asarray(time) / self.unit)
        return JointState(state.position, state.velocity / self.unit, state.acceleration / self.unit**2)


def _refuse_times(posterior: Posterior, seen: Sequence[_Comparison]) -> None:
    loud = [comparison for comparison in seen if comparison.kind is not None and comparison.loud]
    name = _suspected([comparison.factor for comparison in loud])
    if name is None:
        return
    unit, manoeuvre = TIMES[name], posterior.manoeuvres[loud[0].index]
    recording = manoeuvre.recording
    timed = Recording(recording.name, recording.file, unit * recording.time, recording.channels)
    other = replace(manoeuvre, recording=timed, motion=_OtherTimes(manoeuvre.motion, unit))
    try:
        refuse_impossible_joints(timed, posterior.model.robot)
        posterior = Posterior.of(posterior.model, [other], step=unit * posterior.step, window=0)
        again = {comparison.column: comparison.factor for comparison in _compared(posterior)[0]}
    except InputError:  # joints do not move as fast, or there is no motion in so short a time: seconds it is
        return
    if all(1.0 / WRONG_UNIT < again[comparison.column] < WRONG_UNIT for comparison in loud):
        line = f'[telemetry]\ntime_unit = "{SHORT[name]}"'
        text = f"The readings follow the joints' motion only if times are {name}."
        raise ConventionError(
            [Convention("convention:unit:time", "time", line, text)],
            f"the readings follow the joints' motion only if times are {name}",
            file=recording.file or recording.name,
            place="column time",
            remedy=f"Give times in seconds, or state it: {in_one_line(line)}",
        )


def _suspected(factors: Sequence[float]) -> str | None:
    """Return the unit of time that may explain measured over predicted readings, one of `TIMES`."""
    if factors and np.isnan(factors).all():
        return "milliseconds"
    # of one sensor alone other slips, such as joint positions in degrees, say the same
    return "minutes" if len(factors) > 1 and (np.abs(factors) < 1.0 / WRONG_UNIT).all() else None


def _refuse_gravities(posterior: Posterior, compared: Sequence[Sequence[_Comparison]]) -> None:
    felt, turning = (
        [comparison for seen in compared for comparison in seen if comparison.kind == kind]
        for kind in (SensorKind.ACCEL, SensorKind.RATE)
    )
    # nearer to 1/9.8 than to one, where rates are nearer to one; the fits, which take longer, are for these alone
    small = [comparison for comparison in felt if abs(comparison.factor) < GRAVITY**-0.5]
    right = [comparison for comparison in turning if GRAVITY**-0.5 < abs(comparison.factor) < GRAVITY**0.5]
    if not small or not right or len(right) < len(turning):
        return
    given, other = (_misfit(posterior, compared, unit) for unit in (1.0, GRAVITY))
    if given > max(1.0, BETTER * other):
        recording = posterior.manoeuvres[small[0].index].recording
        line, text = '[sensors.accel]\nunit = "g"', "The readings of accel are in g, not in m/s2."
        raise ConventionError(
            [Convention("convention:unit:accel", "accel", line, text)],
            "the accelerations agree with the rotation of the base only if they are in g",
            file=recording.file or recording.name,
            place=f"column {small[0].column}",
            remedy="Give them in m/s2, or correct the accelerometer's position, which may be ten times too far; or "
            f"state it: {in_one_line(line)}",
        )


def _misfit(posterior: Posterior, compared: Sequence[Sequence[_Comparison]], unit: float) -> float:
    """Return chi-square per sample of a fit to rough readings, with accelerations in a unit [m/s2]."""
    model = posterior.model
    loudness: dict[SensorKind, float] = {}
    for comparison in (comparison for seen in compared for comparison in seen):
        if comparison.kind is not None:
            size = float(np.sqrt((comparison.measured**2).mean()))
            loudness[comparison.kind] = max(loudness.get(comparison.kind, 0.0), size)
    sensors = tuple(
        replace(sensor, noise=White(ROUGH * (unit if sensor.kind == SensorKind.ACCEL else 1.0) * loudness[sensor.kind]))
        if sensor.kind in loudness
        else sensor
        for sensor in model.sensors
    )
    manoeuvres = [_in_unit(manoeuvre, unit) for manoeuvre in posterior.manoeuvres]
    rough = Posterior.of(replace(model, sensors=sensors), manoeuvres, step=posterior.step, window=0)
    return fit(rough, rough.starting_point()).chi2 / rough.samples


def _in_unit(manoeuvre: Manoeuvre, unit: float) -> Manoeuvre:
    recording = manoeuvre.recording
    channels = {
        name: values * unit if name in SensorKind.ACCEL.columns else values
        for name, values in recording.channels.items()
    }
    return replace(manoeuvre, recording=Recording(recording.name, recording.file, recording.time, channels))


def _detrend(time: Floats, values: Floats) -> Floats:
    basis = np.vander((time - time.mean()) / (np.ptp(time) + 1e-300), 3)
    return values - basis @ np.linalg.lstsq(basis, values, rcond=None)[0]
