"""The analysis of all throws under one model: calibration, bodies without the device, how throws scatter about them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import norm

from bayesid import Posterior
from bayesid._math.arrays import Floats
from bayesid.inference.body_quantities import bodies_of
from studies.throws.data import WHEEL_INERTIA, Truth, read_throws, regress
from studies.throws.joint import SMOOTH, Joint, SmoothWidth, Throw, fit_widths, losses, maximise_jointly, width_of
from studies.throws.model import (
    NAMED,
    STEP,
    Unexplained,
    WheelImbalance,
    extended,
    is_calibration,
    is_local,
    manoeuvres,
)
from studies.throws.raw import Timing
from studies.throws.residual import Residual, residual_of

PLATE_SD = 0.03  # relative uncertainty of the plate's moments, which are from the authors' CAD: "a few percent"

# relative uncertainty of what the blocks add: 0.1 to 0.2 mm in their place on levers of 63 mm, and their mass
BLOCK_SD = 0.005


@dataclass(frozen=True)
class Tensor:
    """Inertia about the centre of mass (..., 3, 3) [kg m2] and the centre of mass from the sensor (..., 3) [m]."""

    inertia: Floats
    com: Floats


def tensors(posterior: Posterior, coordinates: Floats) -> Tensor:
    """Turn log-Cholesky coordinates of many points, shape (n, 10), into inertias."""
    z = np.zeros((len(coordinates), posterior.size))
    z[:, :10] = coordinates
    values = bodies_of(posterior, z)["base_link"].values
    xx, yy, zz, xy, xz, yz = values[:, 4:].T
    return Tensor(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]).transpose(2, 0, 1), values[:, 1:4])


def steiner(mass: float, offset: Floats) -> Floats:
    """Inertia of a point mass at offsets (..., 3): shape (..., 3, 3)."""
    square = (offset**2).sum(axis=-1)[..., None, None]
    return mass * (square * np.eye(3) - offset[..., :, None] * offset[..., None, :])


def shift(device: Tensor, test: Tensor, device_mass: float, mass: float) -> Floats:
    """Return what the displacement of both parts from the common centre of mass adds to the inertia."""
    offset = test.com - device.com
    return steiner(device_mass, offset) + steiner(mass, device_mass / mass * offset)


def wheel_inertia(device: Tensor, proof: Tensor, truth: Truth) -> Floats:
    """Inertia of the wheel, shape (n,) [kg m2], that gives the known box its known moments, by least squares.

    The fits use a nominal wheel; all their inertias scale with it, the shift of the masses does not.
    """
    added = shift(device, proof, truth.device_mass, truth.mass["cal_proof"])
    # the box's edges lie along the sensor's axes: its smallest moment about x, its largest about z
    known = np.linalg.eigvalsh(np.diag(truth.moments["cal_proof"]) + added)
    seen = np.linalg.eigvalsh(proof.inertia - device.inertia)
    return WHEEL_INERTIA * (known * seen).sum(axis=-1) / (seen**2).sum(axis=-1)


def object_moments(device: Tensor, test: Tensor, wheel: Floats | float, device_mass: float, mass: float) -> Floats:
    """Principal moments of the body without the device, shape (n, 3) [kg m2], ascending."""
    scale = np.asarray(wheel)[..., None, None] / WHEEL_INERTIA
    alone = scale * (test.inertia - device.inertia) - shift(device, test, device_mass, mass)
    return np.linalg.eigvalsh(alone)


def truth_sd(truth: Truth, body: str) -> Floats:
    """Return the standard deviation of a body's stated moments, shape (3,) [kg m2], under the assumptions above."""
    plate = truth.moments.get("Empty", truth.moments[body])
    return np.hypot(PLATE_SD * plate, BLOCK_SD * (truth.moments[body] - plate))


@dataclass(frozen=True)
class BodyResult:
    """Principal moments of one body without the device, ascending [kg m2]."""

    name: str
    throws: tuple[str, ...]
    # (throws, 3): of single throws, with the posterior's standard deviation of each; device, wheel and drag as found
    # jointly
    moments: Floats
    formal: Floats
    # (3,): of all throws together; the jackknife takes whole throws out, calibration throws included
    joint: Floats
    joint_formal: Floats
    joint_jackknife: Floats
    # (3,)
    truth: Floats
    truth_sd: Floats

    @property
    def errors(self) -> Floats:
        """Of single throws against the truth [%], shape (throws, 3)."""
        return 100.0 * (self.moments / self.truth - 1.0)

    @property
    def joint_errors(self) -> Floats:
        """Of the joint fit against the truth [%], shape (3,)."""
        return 100.0 * (self.joint / self.truth - 1.0)

    @property
    def mean_error(self) -> float:
        """Mean size of the errors of single throws over throws and moments [%]."""
        return float(np.abs(self.errors).mean())

    @property
    def mean_error_sd(self) -> float:
        """Standard error of `mean_error`, from how throws differ [%]."""
        sizes = np.abs(self.errors).mean(axis=1)
        return float(sizes.std(ddof=1) / np.sqrt(len(sizes)))

    @property
    def largest_error(self) -> float:
        """Largest error of any moment in any throw [%]."""
        return float(np.abs(self.errors).max())

    @property
    def inflation(self) -> float:
        """Factor by which formal standard deviations of single throws are too small, from the throws' scatter alone."""
        freedom = len(self.throws) / (len(self.throws) - 1.0)
        return float(np.sqrt(freedom * (((self.moments - self.moments.mean(axis=0)) / self.formal) ** 2).mean()))

    def covered(self, level: float, *, about: Floats | None = None, with_truth: bool = False) -> tuple[int, int]:
        """Return how many intervals of single throws hold the truth at a level, or other moments, and of how many.

        With ``with_truth`` the interval counts what all throws share as well: the truth's own uncertainty, and that of
        the wheel and the device, for which the jackknife of the joint answer stands.
        """
        sd = np.sqrt(self.formal**2 + (self.truth_sd**2 + self.joint_jackknife**2 if with_truth else 0.0))
        inside = np.abs(self.moments - (self.truth if about is None else about)) < norm.ppf(0.5 + 0.5 * level) * sd
        return int(inside.sum()), inside.size

    @property
    def joint_distance(self) -> Floats:
        """Joint value less truth in units of jackknife and truth's uncertainty together, shape (3,)."""
        return (self.joint - self.truth) / np.hypot(self.joint_jackknife, self.truth_sd)


DRAWS = 1000


@dataclass(frozen=True)
class Analysis:
    """All throws under one model."""

    label: str
    # inertia of the wheel [kg m2]
    wheel: float
    wheel_formal: float
    wheel_jackknife: float
    bodies: Mapping[str, BodyResult]
    # of the unexplained torque and force, by body; empty for a rigid model
    widths: Mapping[str, Mapping[str, SmoothWidth]]
    noise: Mapping[str, Floats]  # noise of gyro and accelerometer relative to that of quiet stretches
    # unknowns of the device, in standard deviations of their priors times those: physical units
    calibration: Mapping[str, tuple[float, float]]
    # by effect and body, (throws,): by how much worse throws are predicted from the others without the effect [nats]
    losses: Mapping[str, Mapping[str, Floats]]
    imbalance: Mapping[str, tuple[float, float]]  # static, by body, with its standard deviation [kg m]
    left: Mapping[str, Residual]  # what the model leaves, by body; empty for a rigid model
    converged: bool

    def confirmed(self, effect: str, body: str) -> bool:
        """Whether throws of a body are predicted worse without an effect, by two standard errors over its throws."""
        loss = self.losses[effect][body]
        return bool(loss.mean() > 2.0 * loss.std(ddof=1) / np.sqrt(len(loss)))

    def unexplained(self, body: str) -> Unexplained:
        """Return what all throws of a body say of the unexplained torque and force in each, and of the noise."""
        widths = self.widths[body]
        return Unexplained(widths["smooth-torque"].sd, widths["smooth-force"].sd, self.noise[body])


def prepare(folder: Path, truth: Truth, count: int | None) -> list[Throw]:
    """Read the throws of all bodies, each started at its body's regression."""
    throws: list[Throw] = []
    for body in truth.bodies:
        recordings = read_throws(folder, body, Timing(), count)
        model = extended(regress(recordings, truth.thrown_mass(body)), recordings, Timing().duration)
        for recording in recordings:
            posterior = Posterior.of(model, manoeuvres(model, [recording]), step=STEP)
            throws.append(Throw(body, posterior, posterior.starting_point(), np.ones(posterior.size), np.ones(6)))
    return throws


def analyse(
    label: str,
    throws: Sequence[Throw],
    free: Callable[[str], bool],
    truth: Truth,
    rng: np.random.Generator,
    folder: Path,
    *,
    smooth: bool = True,
) -> Analysis:
    """Fit all throws jointly, then each throw of the bodies with the device's calibration held.

    Parameters
    ----------
    free : callable; which unknowns are fitted
    folder : path; of the measurements
    smooth : bool; whether these hold the unexplained torque and force, whose widths are then estimated
    """
    started: list[Throw] = []
    for body in truth.bodies:  # each body alone first: from there the fit of all needs a few steps
        of_body = [throw for throw in throws if throw.body == body]
        started += fit_widths(of_body, free) if smooth else maximise_jointly(of_body, free).throws
    joint = maximise_jointly(started, free)
    posteriors = {throw.body: throw.posterior for throw in throws}
    wheel, moments = _bodies(posteriors, joint, joint.value[None], truth)
    wheel_draws, draws = _bodies(posteriors, joint, joint.draw(DRAWS, rng), truth)
    wheel_left, left = _bodies(posteriors, joint, np.stack([joint.without(i) for i in range(len(throws))]), truth)
    groups = [throw.body for throw in throws]
    device = tensors(posteriors["cal_device"], joint.body_coordinates("cal_device", joint.value[None]))
    scale = float(_jackknife(wheel_left[:, None], groups)[0])
    results = {}
    for body in truth.objects:
        single = [throw for throw in joint.throws if throw.body == body]
        fitted = [_single(throw, free, device, float(wheel[0]), truth, rng) for throw in single]
        results[body] = BodyResult(
            name=body,
            throws=tuple(throw.name for throw in single),
            moments=np.array([value for value, _ in fitted]),
            formal=np.array([sd for _, sd in fitted]),
            joint=moments[body][0],
            joint_formal=draws[body].std(axis=0),
            joint_jackknife=_jackknife(left[body], groups),
            truth=truth.moments[body],
            truth_sd=truth_sd(truth, body),
        )
    return Analysis(
        label=label,
        wheel=float(wheel[0]),
        wheel_formal=float(wheel_draws.std()),
        wheel_jackknife=scale,
        bodies=results,
        widths={b: {e: width_of(joint, b, e) for e in SMOOTH} for b in truth.bodies} if smooth else {},
        noise={throw.body: throw.noise for throw in joint.throws},
        calibration=_calibration(joint, throws[0].posterior),
        losses=_losses(joint, free) if smooth else {},
        imbalance={body: _imbalance(joint, body) for body in truth.bodies} if smooth else {},
        left={b: residual_of([t for t in joint.throws if t.body == b], folder) for b in truth.bodies} if smooth else {},
        converged=joint.converged,
    )


def _losses(joint: Joint, free: Callable[[str], bool]) -> dict[str, dict[str, Floats]]:
    bodies = [throw.body for throw in joint.throws]
    each = {effect: losses(joint, effect, free) for effect in NAMED}
    return {
        effect: {body: loss[np.array(bodies) == body] for body in dict.fromkeys(bodies)}
        for effect, loss in each.items()
    }


def _imbalance(joint: Joint, body: str) -> tuple[float, float]:
    """Return the static imbalance of the wheel that the throws of one body say, and its standard deviation [kg m]."""
    rows = [joint.names.index(f"{body}:wheel-imbalance.static.{way}") for way in ("c", "s")]
    effects = joint.throws[0].posterior.model.effects
    sigma = next(e.parameters[0].sigma for e in effects if isinstance(e, WheelImbalance))
    value = joint.value[rows]
    size = float(np.linalg.norm(value))
    along = value / size
    return sigma * size, sigma * float(np.sqrt(along @ joint.covariance[np.ix_(rows, rows)] @ along))


def _bodies(
    posteriors: Mapping[str, Posterior], joint: Joint, values: Floats, truth: Truth
) -> tuple[Floats, dict[str, Floats]]:
    """Wheel's inertia (n,) and principal moments (n, 3) of the bodies at many points of the shared unknowns."""
    by_body = {body: tensors(posteriors[body], joint.body_coordinates(body, values)) for body in truth.bodies}
    wheel = wheel_inertia(by_body["cal_device"], by_body["cal_proof"], truth)
    moments = {
        body: object_moments(by_body["cal_device"], by_body[body], wheel, truth.device_mass, truth.mass[body])
        for body in truth.objects
    }
    return wheel, moments


def _single(
    throw: Throw, free: Callable[[str], bool], device: Tensor, wheel: float, truth: Truth, rng: np.random.Generator
) -> tuple[Floats, Floats]:
    """Principal moments of one throw and their formal standard deviations; device, wheel and drag as found jointly."""
    alone = maximise_jointly([throw], lambda name: free(name) and (is_local(name) or "base_link" in name))
    points = alone.body_coordinates(throw.body, np.concatenate([alone.value[None], alone.draw(DRAWS, rng)]))
    fitted = tensors(throw.posterior, points)
    values = object_moments(device, fitted, wheel, truth.device_mass, truth.mass[throw.body])
    return values[0], values[1:].std(axis=0)


def _jackknife(left: Floats, groups: Sequence[str]) -> Floats:
    """Return the standard error of values (n, k), each with one throw left out; throws vary within their body."""
    total = np.zeros(left.shape[1])
    for body in dict.fromkeys(groups):
        of_body = left[np.array(groups) == body]
        if len(of_body) > 1:
            total += (len(of_body) - 1.0) / len(of_body) * ((of_body - of_body.mean(axis=0)) ** 2).sum(axis=0)
    return np.sqrt(total)


def _calibration(joint: Joint, posterior: Posterior) -> dict[str, tuple[float, float]]:
    scale = {f"{effect.label}.{p.name}": p.sigma for effect in posterior.model.effects for p in effect.parameters}
    sd = np.sqrt(np.diag(joint.covariance))
    return {
        name: (float(scale[name] * value), float(scale[name] * width))
        for name, value, width in zip(joint.names, joint.value, sd, strict=True)
        if is_calibration(name)
    }
