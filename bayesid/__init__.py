"""Bayesian identification of the inertial parameters of free-flying space robots.

A study names a robot, its sensors and recordings; its posterior is identified by emcee::

    study = bayesid.Study.load("study.toml")
    result = bayesid.identify(bayesid.load_posterior(study), seed=1)
    print(result.bodies["base_link"].mean)

Names are loaded when they are first used (PEP 562), so that the import itself costs nothing.
"""

from __future__ import annotations

import importlib
import os
import sys
import warnings
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    __version__: str

    from bayesid._io.errors import InputError
    from bayesid.app.schema import Study
    from bayesid.app.study_to_model import load_manoeuvres, load_model, load_posterior
    from bayesid.inference.identification import Identification, identify
    from bayesid.inference.posterior import Posterior
    from bayesid.recording.joint_motion import Excitation, MeasuredMotion
    from bayesid.recording.recording import Recording
    from bayesid.robot.body_prior import BodyPrior
    from bayesid.robot.inertial_parameters import InertialParameters
    from bayesid.robot.robot import Load, Robot
    from bayesid.simulation.effects import Effect, Parameter, Wrench, register
    from bayesid.simulation.model import Manoeuvre, Model
    from bayesid.simulation.orbit import Orbit
    from bayesid.simulation.sensors import Instrument, Sensor, SensorKind, White

__all__ = [
    "BodyPrior",
    "Effect",
    "Excitation",
    "Identification",
    "InertialParameters",
    "InputError",
    "Instrument",
    "Load",
    "Manoeuvre",
    "MeasuredMotion",
    "Model",
    "Orbit",
    "Parameter",
    "Posterior",
    "Recording",
    "Robot",
    "Sensor",
    "SensorKind",
    "Study",
    "White",
    "Wrench",
    "identify",
    "load_manoeuvres",
    "load_model",
    "load_posterior",
    "register",
]

_PLACES = {
    "BodyPrior": "robot.body_prior",
    "Effect": "simulation.effects",
    "Excitation": "recording.joint_motion",
    "Identification": "inference.identification",
    "InertialParameters": "robot.inertial_parameters",
    "InputError": "_io.errors",
    "Instrument": "simulation.sensors",
    "SensorKind": "simulation.sensors",
    "Load": "robot.robot",
    "Manoeuvre": "simulation.model",
    "MeasuredMotion": "recording.joint_motion",
    "Model": "simulation.model",
    "Orbit": "simulation.orbit",
    "Parameter": "simulation.effects",
    "Posterior": "inference.posterior",
    "Recording": "recording.recording",
    "Robot": "robot.robot",
    "Sensor": "simulation.sensors",
    "Study": "app.schema",
    "White": "simulation.sensors",
    "Wrench": "simulation.effects",
    "identify": "inference.identification",
    "load_manoeuvres": "app.study_to_model",
    "load_model": "app.study_to_model",
    "load_posterior": "app.study_to_model",
    "register": "simulation.effects",
}

# JAX computes in 64 bits; set without importing it
if "jax" in sys.modules:
    sys.modules["jax"].config.update("jax_enable_x64", True)
else:
    os.environ["JAX_ENABLE_X64"] = "True"
# the pinned ArviZ announces its successor at every import
warnings.filterwarnings("ignore", message="\\s*ArviZ is undergoing", category=FutureWarning)


def __getattr__(name: str) -> object:
    """Load a public name, or read the version from the package's metadata."""
    if name == "__version__":
        from importlib.metadata import version

        return version("bayesid")
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_PLACES[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
