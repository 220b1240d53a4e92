"""What a rigid body with its recorded wheel lacks, named from the data of a few throws, and what that gains."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesid import Model, Posterior, Recording
from bayesid._io.progress import Progress, silent
from bayesid._math.arrays import Floats
from bayesid.diagnosis import Diagnosis, candidates, diagnose
from bayesid.diagnosis.settings import DEFAULT_SETTINGS
from bayesid.inference.mode import fit
from bayesid.simulation.effects import Effect
from bayesid.simulation.effects.effect_parameters import PhysicalBound
from studies.throws.analysis import Tensor, object_moments, tensors, wheel_inertia
from studies.throws.data import CALIBRATION, Truth, regress
from studies.throws.model import (
    GSensitivity,
    GyroCross,
    Unexplained,
    WheelDelay,
    WheelImbalance,
    WheelTilt,
    manoeuvres,
    rigid,
    with_unexplained,
)
from studies.throws.raw import Timing

SPREAD = 0.1  # relative width of the body's prior about a linear regression on the throws

# an imbalance, cross-axis terms, tilt and drag may all be certain beside something unnamed: this device has them all
SETTINGS = replace(DEFAULT_SETTINGS, most_beside_unnamed=4)

_SCALE = (PhysicalBound("1", 0.03, "Data sheets of micromechanical sensors state scale factors to 3 % or better."),)
BOUNDS = {"rate-scale": _SCALE, "accel-scale": _SCALE}

# effects of the catalogue that a stiff body with gyro, accelerometer and one wheel can show in half a second
CATALOGUE = (
    "rotational-drag",
    "rate-scale",
    "rate-misalignment",
    "rate-latency",
    "accel-position",
    "accel-scale",
    "accel-misalignment",
    "wheel-history:x",
    "wheel-history:y",
    "wheel-history:z",
)


def device_candidates(model: Model, *, records_wheels: bool) -> list[Effect]:
    """Return what such a device may lack: effects of the catalogue, and those that its user wrote.

    Effects of the recorded wheel are candidates where it is recorded.
    """
    known = candidates(model, records_wheels=records_wheels, longest=Timing().duration)
    of_user = [GyroCross(), GSensitivity()]
    wheel = [WheelTilt(), WheelDelay(), WheelImbalance()] if records_wheels else []
    return [effect for effect in known if effect.label in CATALOGUE] + [
        e.attach(model.robot) for e in (*of_user, *wheel)
    ]


@dataclass(frozen=True)
class Lacking:
    """The diagnosis of some throws of one body."""

    body: str
    training: tuple[str, ...]
    unexplained: Unexplained
    diagnosis: Diagnosis
    body_found: Mapping[str, Tensor]  # of the rigid body and with the named causes, the device included

    @property
    def gain(self) -> Floats:
        """By how much better each throw is predicted from the others with the named causes, (throws,) [nats]."""
        before, after = self.diagnosis.gain.before.held_out, self.diagnosis.gain.after.held_out
        return np.zeros(len(self.training)) if before is None or after is None else after - before


def lacking(
    body: str,
    recordings: Sequence[Recording],
    mass: float,
    unexplained: Unexplained,
    training: int,
    seed: int,
    progress: Progress = silent,
) -> Lacking:
    """Diagnose the first throws of a body together.

    The present model contains the unexplained torque and force, another one in every throw: a candidate has to show
    what they cannot. All throws tell their size and the noise.
    """
    used = recordings[:training]
    plain = rigid(regress(used, mass), SPREAD, recordings)
    model = with_unexplained(plain, unexplained, Timing().duration)
    effects = device_candidates(model, records_wheels=True)
    diagnosis = diagnose(
        model, manoeuvres(model, used), seed, effects=effects, bounds=BOUNDS, settings=SETTINGS, progress=progress
    )
    posterior = Posterior.of(plain, manoeuvres(plain, used))
    found = {
        "rigid": tensors(posterior, fit(posterior, posterior.starting_point()).z[None, :10]),
        "extended": tensors(diagnosis.after.fit.posterior, diagnosis.after.fit.z[None, :10]),
    }
    return Lacking(body, tuple(recording.name for recording in used), unexplained, diagnosis, found)


def without_wheel(
    recordings: Sequence[Recording],
    mass: float,
    unexplained: Unexplained,
    training: int,
    seed: int,
    progress: Progress = silent,
) -> Diagnosis:
    """Take the wheel from the first throws of a body, and diagnose a body that is known to the prior's width.

    Without a wheel the motion does not tell the scale of the inertia, so that the prior stays where the regression with
    the wheel has it.
    """
    used = recordings[:training]
    model = with_unexplained(rigid(regress(used, mass), SPREAD, recordings), unexplained, Timing().duration)
    bare = [
        replace(recording, channels={k: v for k, v in recording.channels.items() if not k.startswith("wheel_momentum")})
        for recording in used
    ]
    effects = device_candidates(model, records_wheels=False)
    return diagnose(
        model, manoeuvres(model, bare), seed, effects=effects, bounds=BOUNDS, settings=SETTINGS, progress=progress
    )


def geometry_errors(studies: Sequence[Lacking], truth: Truth) -> dict[str, dict[str, Floats]]:
    """Errors of the principal moments against the geometry [%], by model and body, from the training throws alone.

    There are none without the bodies of the calibration, and none of bodies that were not diagnosed.
    """
    if not set(CALIBRATION) <= {study.body for study in studies}:
        return {"rigid": {}, "extended": {}}
    fitted = {study.body: study.body_found for study in studies}
    errors: dict[str, dict[str, Floats]] = {}
    for name in ("rigid", "extended"):
        device = fitted["cal_device"][name]
        inertia = wheel_inertia(device, fitted["cal_proof"][name], truth)
        errors[name] = {}
        for body in (body for body in truth.objects if body in fitted):
            moments = object_moments(device, fitted[body][name], inertia, truth.device_mass, truth.mass[body])[0]
            errors[name][body] = 100.0 * (moments / truth.moments[body] - 1.0)
    return errors
