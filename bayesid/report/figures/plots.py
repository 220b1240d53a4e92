"""The plots that people expect of a result, one call each: a matplotlib Figure, or drawn into axes that are given.

No plot touches pyplot or matplotlib's settings. ``figure.savefig("plot.png")`` writes one, and notebooks show it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Protocol

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.diagnosis import Diagnosis, Frame
from bayesid.diagnosis.outcome.torque_of_causes import torque_of_causes
from bayesid.inference.identification import Identification
from bayesid.inference.posterior import Posterior
from bayesid.inference.residual_view import ResidualView
from bayesid.report.figures.diagnosis_figures import cause_picture, wrench_histories
from bayesid.report.figures.posterior_figures import corner
from bayesid.report.figures.residual_figures import residual_histories, residual_spectra
from bayesid.report.figures.robot_figures import manoeuvre, robot_shapes
from bayesid.robot.robot import Robot

__all__ = [
    "plot_disturbance",
    "plot_manoeuvre",
    "plot_posterior",
    "plot_residuals",
    "plot_robot",
    "plot_spectrum",
    "plot_verdict",
]

CURVE_POINTS = 600  # number of points of a curve over time

Panels = Any
"""Axes of matplotlib, in an array or list."""


class HasPosterior(Protocol):
    """Result of a check, an identification, a simulation, a prediction or a design."""

    @property
    def posterior(self) -> Posterior:
        """Model and manoeuvres."""
        ...


def plot_residuals(
    result: Identification | Diagnosis, recording: int | None = None, *, axes: Panels | None = None
) -> Figure:
    """Draw the residuals of one recording over time, in standard deviations of the noise, by sensor and axis.

    Parameters
    ----------
    result : Identification or Diagnosis
        Of a diagnosis that names causes, the residuals with and without them are drawn.
    recording : int, optional
        Number of the recording, by default the first, or that where the causes change most.
    axes : array_like of Axes, optional
        Panels to draw in, a row for each sensor.
    """
    if recording is None:
        recording = result.strongest_recording if isinstance(result, Diagnosis) else 0
    return residual_histories(_residuals(result), recording, axes)


def plot_spectrum(result: Identification | Diagnosis, *, axes: Panels | None = None) -> Figure:
    """Draw the spectra of the residuals by sensor and axis; noise alone has level one.

    Parameters
    ----------
    result : Identification or Diagnosis
    axes : array_like of Axes, optional
        Panels to draw in, a row for each sensor.
    """
    return residual_spectra(_residuals(result), axes)


def plot_posterior(result: Identification, body: str | None = None, *, axes: Panels | None = None) -> Figure:
    """Draw the joint distributions of a body's mass, centre of mass and inertia.

    Parameters
    ----------
    result : Identification
    body : str, optional
        Name of the link or load, by default the first that was identified.
    axes : (10, 10) array_like of Axes, optional
        Panels to draw in.
    """
    names = list(result.bodies)
    if not names or (body is not None and body not in names):
        remedy = f"Choose one of {', '.join(names)}" if names else "Name a body to identify"
        raise InputError(f"no body {body!r} was identified" if body else "no body was identified", remedy=remedy)
    return corner(result.bodies[body or names[0]], axes)


def plot_verdict(diagnosis: Diagnosis, recording: int | None = None, *, axes: Panels | None = None) -> Figure:
    """Draw the robot with the causes where they act, and the residual of the axis that they change most.

    Parameters
    ----------
    diagnosis : Diagnosis
    recording : int, optional
        Number of the recording, by default that where the causes change most.
    axes : sequence of Axes, optional
        Panels of the robot and of the residual before and, where causes are named, after.
    """
    return cause_picture(diagnosis, diagnosis.strongest_recording if recording is None else recording, axes)


def plot_disturbance(diagnosis: Diagnosis, frame: str | Frame = Frame.BASE, *, axes: Panels | None = None) -> Figure:
    """Draw the torque, and the force where it is seen, that would explain the residual, and that of the named causes.

    Parameters
    ----------
    diagnosis : Diagnosis
    frame : str or Frame
        Axes: ``"base"``, ``"orbit"`` or ``"inertial"``.
    axes : array_like of Axes, optional
        Panels to draw in, three for the torque and three for the force where it is seen.
    """
    cause = torque_of_causes(diagnosis.after) if diagnosis.named else None
    return wrench_histories(diagnosis.disturbance, Frame(frame), cause, axes)


def plot_manoeuvre(
    result: Posterior | HasPosterior | Diagnosis, recording: int = 0, *, axes: Panels | None = None
) -> Figure:
    """Draw positions and speeds of the joints in a manoeuvre.

    Parameters
    ----------
    result : Posterior, or result that has one
        Of a diagnosis, the recordings; of a design, the designed manoeuvre.
    recording : int
        Number of the manoeuvre.
    axes : array_like of Axes, optional
        Panels of position and speed, a row for each unit of the joints.
    """
    if isinstance(result, Diagnosis):
        posterior = result.before.fit.posterior
    else:
        posterior = result if isinstance(result, Posterior) else result.posterior
    flown = posterior.manoeuvres[recording]
    time = np.linspace(flown.recording.time[0], flown.recording.time[-1], CURVE_POINTS)
    return manoeuvre(flown.motion, posterior.model.robot, time, axes)


def plot_robot(robot: Robot | str | Path, position: Floats | None = None, *, ax: Axes | None = None) -> Figure:
    """Draw a robot in space: its meshes where they are there, else primitives or boxes of the same inertia.

    Parameters
    ----------
    robot : Robot or path of a URDF or MJCF
    position : (joints,) array, optional
        Positions of the joints [rad or m], by default zero, or the nearest that the limits allow.
    ax : Axes3D, optional
        Axes to draw in, with ``projection="3d"``.
    """
    drawn = robot if isinstance(robot, Robot) else Robot.from_urdf(robot)
    rest = np.array([np.clip(0.0, joint.lower, joint.upper) for joint in drawn.joints])
    given = rest if position is None else np.asarray(position, dtype=float)
    if given.shape != rest.shape:
        names = ", ".join(joint.name for joint in drawn.joints)
        raise InputError(f"{given.size} positions for {rest.size} joints", remedy=f"Give those of {names}")
    return robot_shapes(drawn, given, ax)


def _residuals(result: Identification | Diagnosis) -> list[ResidualView]:
    """Return the residuals before, and after where causes are named."""
    if isinstance(result, Diagnosis):
        return result.residuals
    return [ResidualView.at(result.posterior, result.optimum.z)]
