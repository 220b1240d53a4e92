"""The wrench it would take: what a fit leaves, as force and torque on the base against time, and its frame."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from pathlib import Path

import numpy as np
from scipy.special import logsumexp

from bayesid._io.files import write_text
from bayesid._math.arrays import Floats
from bayesid.diagnosis.hypothesis import Hypothesis

__all__ = ["Frame", "Unexplained", "unexplained_wrench"]

TORQUE, FORCE = 0.05, 0.05
"""Unit of the cosines' amplitudes [N m, N]."""

WAVES = 40
"""Cosines in time per axis and recording."""

SCALES = np.geomspace(1e-4, 1e2, 25)
"""Prior standard deviations tried for the cosines' amplitudes, in the disturbances' scale."""

DECIDED = 6.0
"""Advantage in twice the log likelihood that names a frame."""

SHARE = 0.6
"""Share of what three free axes explain that one fixed direction must explain."""

ROUNDS = 15


class Frame(Enum):
    """Axes in which a disturbance may keep its direction."""

    BASE = "base"
    ORBIT = "orbit"
    INERTIAL = "inertial"


@dataclass(frozen=True)
class Unexplained:
    """A disturbing wrench.

    Attributes
    ----------
    signal_to_noise : float
    time : list of (S,) arrays
        Per recording [s].
    torque, force : dict of Frame to list of (S, 3) arrays
        Mean, about and through the common centre of mass [N m, N].
    torque_sd, force_sd : list of (S, 3) arrays
        Base axes.
    fixed_in : Frame or None
    log_bayes_factor : float
        Of a free torque and force in every recording against none: what a named cause has to beat.
    """

    signal_to_noise: float
    names: tuple[str, ...]
    time: list[Floats]
    torque: dict[Frame, list[Floats]]
    force: dict[Frame, list[Floats]]
    torque_sd: list[Floats]
    force_sd: list[Floats]
    fixed_in: Frame | None
    log_bayes_factor: float

    def write(self, file: Path) -> None:
        """Write the wrench as CSV."""
        header = ["recording", "time"]
        header += [f"{frame.value}_{kind}.{axis}" for frame in Frame for kind in ("torque", "force") for axis in "xyz"]
        header += [f"base_{kind}_sd.{axis}" for kind in ("torque", "force") for axis in "xyz"]
        lines = [",".join(header)]
        for r, name in enumerate(self.names):
            blocks = [part[frame][r] for frame in Frame for part in (self.torque, self.force)]
            table = np.concatenate([self.time[r][:, None], *blocks, self.torque_sd[r], self.force_sd[r]], axis=1)
            lines += [",".join([name, *(f"{value:.6g}" for value in row)]) for row in table]
        write_text(file, "\n".join(lines) + "\n")


def unexplained_wrench(hypothesis: Hypothesis, name_frame: bool = True) -> Unexplained:
    """Reconstruct the disturbance that a fit leaves, with a prior whose size the data choose.

    Parameters
    ----------
    hypothesis : Hypothesis
    name_frame : bool
        Whether to look for the axes that it is fixed in.
    """
    fit = hypothesis.fit
    count = len(fit.posterior.manoeuvres)
    node = fit.operating.node
    times = np.asarray(node.environment.time)
    rotations = _frames(hypothesis)
    columns = np.concatenate([_responses(hypothesis, rotations[Frame.BASE][0], kind) for kind in (3, 0)], axis=1)
    gram, gradient = fit.project(columns), columns.T @ fit.residual
    values, vectors = np.linalg.eigh(gram)
    values = np.maximum(values, 0.0)
    along = vectors.T @ gradient
    fits = [0.5 * (s**2 * along**2 / (1.0 + s**2 * values) - np.log1p(s**2 * values)).sum() for s in SCALES]
    scale = SCALES[int(np.argmax(fits))]
    precision = values + scale**-2
    amplitude = -vectors @ (along / precision)
    covariance = (vectors / precision) @ vectors.T
    used = values * scale**2 > 1.0
    snr = float(np.sqrt(max((along[used] ** 2 / values[used]).sum() - used.sum(), 0.0))) if used.any() else 0.0

    half = count * WAVES * 3
    time, torque, force, torque_sd, force_sd = [], [], [], [], []
    for r in range(count):
        own = np.concatenate([[True], np.diff(times[r]) > 0.0])
        waves = _waves(times[r][own])
        parts = []
        for first, size in ((0, TORQUE), (half, FORCE)):
            block = slice(first + r * WAVES * 3, first + (r + 1) * WAVES * 3)
            mean = size * np.einsum("kt,ka->ta", waves, amplitude[block].reshape(WAVES, 3))
            spread = covariance[block, block].reshape(WAVES, 3, WAVES, 3)
            sd = size * np.sqrt(np.maximum(np.einsum("kt,kala,lt->ta", waves, spread, waves), 0.0))
            parts.append((mean, sd))
        time.append(times[r][own])
        torque.append(parts[0][0])
        force.append(parts[1][0])
        torque_sd.append(parts[0][1])
        force_sd.append(parts[1][1])

    def turned(series: list[Floats], frame: Frame) -> list[Floats]:
        out = []
        for r, value in enumerate(series):
            own = np.concatenate([[True], np.diff(times[r]) > 0.0])
            out.append(np.einsum("tba,tb->ta", rotations[frame][0][r][own], value))
        return out

    return Unexplained(
        snr,
        tuple(manoeuvre.recording.name for manoeuvre in fit.posterior.manoeuvres),
        time,
        {frame: turned(torque, frame) for frame in Frame},
        {frame: turned(force, frame) for frame in Frame},
        torque_sd,
        force_sd,
        _fixed_in(hypothesis, rotations, scale) if name_frame and snr > 0.0 else None,
        float(logsumexp(fits) - np.log(len(SCALES))),
    )


def _waves(time: Floats) -> Floats:
    return np.cos(np.pi * np.arange(WAVES)[:, None] * time / time[-1])


def _frames(hypothesis: Hypothesis) -> dict[Frame, tuple[Floats, Floats]]:
    """Rotations from each frame to the base at stages (R, S, 3, 3) and samples (R, T, 3, 3)."""
    operating = hypothesis.fit.operating
    result: dict[Frame, list[Floats]] = {frame: [] for frame in Frame}
    for instant in (operating.node, operating.sample):
        attitude = np.asarray(instant.attitude)  # base to orbit axes
        to_base = np.swapaxes(attitude, -1, -2)
        zenith = np.asarray(instant.environment.zenith)
        argument_of_latitude = np.asarray(instant.environment.argument_of_latitude)
        there = np.linalg.norm(zenith, axis=-1).min() > 0.5
        normal = np.zeros_like(zenith) + np.array([0.0, 0.0, 1.0])
        local = np.stack([zenith, np.cross(normal, zenith), normal], axis=-1) if there else np.eye(3) + 0.0 * attitude
        start = argument_of_latitude[:, :1] if there else np.zeros((len(attitude), 1))
        cos, sin, zero = np.cos(start), np.sin(start), 0.0 * start
        # node axes seen in the recording's orbit axes
        rows = [np.stack(row, axis=-1) for row in ((cos, sin, zero), (-sin, cos, zero), (zero, zero, zero + 1.0))]
        node = np.broadcast_to(np.stack(rows, axis=-2), attitude.shape)
        result[Frame.BASE].append(np.broadcast_to(np.eye(3), attitude.shape))
        result[Frame.ORBIT].append(to_base @ local)
        result[Frame.INERTIAL].append(to_base @ node)
    return {frame: (parts[0], parts[1]) for frame, parts in result.items()}


def _responses(hypothesis: Hypothesis, frames: Floats, first: int, samples: Floats | None = None) -> Floats:
    """Responses to cosines of a torque (first = 3) or force (0) along the axes of frames: (N, R WAVES 3)."""
    engine, fit = hypothesis.engine, hypothesis.fit
    operating = fit.operating
    data = engine.data_of(fit)
    count = len(fit.posterior.manoeuvres)
    scale = TORQUE if first == 3 else FORCE
    sides = []
    for instant, turn in ((operating.node, frames), (operating.sample, samples)):
        time = np.asarray(instant.environment.time)
        axes = np.broadcast_to(np.eye(3), (*time.shape, 3, 3)) if turn is None else turn
        sides.append((time, axes, np.asarray(instant.body.com)))
    found = []
    for r in range(count):
        wrenches = []
        for time, axes, com in sides:
            waves = np.cos(np.pi * np.arange(WAVES)[:, None] * time[r] / sides[0][0][r].max())
            wrench = np.zeros((WAVES, 3, *time.shape, 6))
            direction = scale * np.einsum("kt,tba->katb", waves, axes[r])
            wrench[:, :, r, :, first : first + 3] = direction
            if first == 0:
                wrench[:, :, r, :, 3:] = np.cross(com[r], direction)
            wrenches.append(wrench.reshape(WAVES * 3, *time.shape, 6))
        perturbation = engine.perturbation(WAVES * 3, node_wrench=wrenches[0], sample_wrench=wrenches[1])
        found.append(engine.respond(perturbation, fit.z, data))
    return np.concatenate(found, axis=1)


def _fixed_in(hypothesis: Hypothesis, rotations: dict[Frame, tuple[Floats, Floats]], scale: float) -> Frame | None:
    """Return the frame in which a torque of one direction, with a free course, explains most; None if undecided."""
    fit = hypothesis.fit
    explained = {}
    whole = 0.0
    orbit = float(np.linalg.norm(np.asarray(fit.operating.node.environment.zenith)[0, 0])) > 0.5
    for frame in Frame if orbit else (Frame.BASE, Frame.INERTIAL):
        columns = _responses(hypothesis, rotations[frame][0], 3, rotations[frame][1])
        gram, gradient = fit.project(columns), columns.T @ fit.residual
        courses = gram.shape[0] // 3
        gram = gram.reshape(courses, 3, courses, 3)
        gradient = gradient.reshape(courses, 3)
        if frame is Frame.BASE:
            flat = gram.reshape(3 * courses, -1) + scale**-2 * np.eye(3 * courses)
            whole = float(gradient.ravel() @ np.linalg.solve(flat, gradient.ravel()))
        explained[frame] = max(_one_direction(gram, gradient, scale, d) for d in np.eye(3))
    ranked = sorted(explained, key=lambda frame: -explained[frame])
    best, second = ranked[0], ranked[1]
    if explained[best] < SHARE * whole or explained[best] - explained[second] < DECIDED:
        return None
    return best


def _one_direction(gram: Floats, gradient: Floats, scale: float, direction: Floats) -> float:
    """Chi-square that a torque of one direction and a free course takes, by alternating least squares."""
    taken = 0.0
    for _ in range(ROUNDS):
        inner = np.einsum("kalb,a,b->kl", gram, direction, direction) + scale**-2 * np.eye(len(gram))
        trajectory = np.linalg.solve(inner, gradient @ direction)
        taken = float(gradient @ direction @ trajectory)
        quadratic = np.einsum("kalb,k,l->ab", gram, trajectory, trajectory)
        direction = np.linalg.solve(quadratic + 1e-9 * np.trace(quadratic) * np.eye(3), trajectory @ gradient)
        direction = direction / np.linalg.norm(direction)
    return taken
