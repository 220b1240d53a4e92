"""Bayesian identification of the inertial parameters of free-flying space robots.

A study names a robot, its sensors and recordings. Each command of the command line is a function of its name, which
takes a study and a seed and returns the result::

    found = bayesid.diagnose("study.toml", seed=1)
    print(found)
    print(found.identification.bodies["base_link"].mass)

Names are loaded when they are first used (PEP 562), so that the import itself costs nothing.
"""

from __future__ import annotations

import importlib
import sys
import warnings
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    __version__: str

    from bayesid._io.errors import InputError
    from bayesid.app.functions.check_study import StudyCheck, check
    from bayesid.app.functions.design_study import Designs, design
    from bayesid.app.functions.diagnose_study import diagnose
    from bayesid.app.functions.identifiability_of_study import Identifiability, identifiability
    from bayesid.app.functions.identify_study import identify
    from bayesid.app.functions.loop_study import loop
    from bayesid.app.functions.predict_study import Predictions, predict
    from bayesid.app.functions.simulate_study import Simulation, simulate
    from bayesid.app.schema import Study
    from bayesid.app.study_to_design import load_problem
    from bayesid.app.study_to_model import load_manoeuvres, load_model, load_posterior
    from bayesid.design import Design, Problem
    from bayesid.design.base_prediction import Prediction
    from bayesid.design.loop_history import History
    from bayesid.diagnosis import CausePrior, Diagnosis, DiagnosisSettings, Status
    from bayesid.inference.identification import Identification
    from bayesid.inference.posterior import Posterior
    from bayesid.recording.joint_motion import Excitation, MeasuredMotion
    from bayesid.recording.recording import Recording
    from bayesid.robot.body_prior import BodyPrior
    from bayesid.robot.inertial_parameters import InertialParameters
    from bayesid.robot.robot import Load, Robot
    from bayesid.robot.wheel import Wheel
    from bayesid.simulation.effects import Effect, Parameter, Wrench, create, known_effects, register
    from bayesid.simulation.joint_torques import TorqueSensor
    from bayesid.simulation.model import Manoeuvre, Model
    from bayesid.simulation.orbit import Orbit
    from bayesid.simulation.sensors import (
        AngleRandomWalk,
        Coloured,
        Filter,
        Instrument,
        Noise,
        NoiseDensity,
        Quantised,
        Scaled,
        Sensed,
        Sensor,
        SensorKind,
        StarTracker,
        White,
    )

__all__ = [
    "AngleRandomWalk",
    "BodyPrior",
    "CausePrior",
    "Coloured",
    "Design",
    "Designs",
    "Diagnosis",
    "DiagnosisSettings",
    "Effect",
    "Excitation",
    "Filter",
    "History",
    "Identifiability",
    "Identification",
    "InertialParameters",
    "InputError",
    "Instrument",
    "Load",
    "Manoeuvre",
    "MeasuredMotion",
    "Model",
    "Noise",
    "NoiseDensity",
    "Orbit",
    "Parameter",
    "Posterior",
    "Prediction",
    "Predictions",
    "Problem",
    "Quantised",
    "Recording",
    "Robot",
    "Scaled",
    "Sensed",
    "Sensor",
    "SensorKind",
    "Simulation",
    "StarTracker",
    "Status",
    "Study",
    "StudyCheck",
    "TorqueSensor",
    "Wheel",
    "White",
    "Wrench",
    "check",
    "create",
    "design",
    "diagnose",
    "identifiability",
    "identify",
    "known_effects",
    "load_manoeuvres",
    "load_model",
    "load_posterior",
    "load_problem",
    "loop",
    "predict",
    "register",
    "simulate",
]

_NAMES = {
    "_io.errors": "InputError",
    "app.functions.check_study": "StudyCheck check",
    "app.functions.design_study": "Designs design",
    "app.functions.diagnose_study": "diagnose",
    "app.functions.identifiability_of_study": "Identifiability identifiability",
    "app.functions.identify_study": "identify",
    "app.functions.loop_study": "loop",
    "app.functions.predict_study": "Predictions predict",
    "app.functions.simulate_study": "Simulation simulate",
    "app.schema": "Study",
    "app.study_to_design": "load_problem",
    "app.study_to_model": "load_manoeuvres load_model load_posterior",
    "design": "Design Problem",
    "design.base_prediction": "Prediction",
    "design.loop_history": "History",
    "diagnosis": "CausePrior Diagnosis DiagnosisSettings Status",
    "inference.identification": "Identification",
    "inference.posterior": "Posterior",
    "recording.joint_motion": "Excitation MeasuredMotion",
    "recording.recording": "Recording",
    "robot.body_prior": "BodyPrior",
    "robot.inertial_parameters": "InertialParameters",
    "robot.robot": "Load Robot",
    "robot.wheel": "Wheel",
    "simulation.effects": "Effect Parameter Wrench create known_effects register",
    "simulation.joint_torques": "TorqueSensor",
    "simulation.model": "Manoeuvre Model",
    "simulation.orbit": "Orbit",
    "simulation.sensors": "AngleRandomWalk Coloured Filter Instrument Noise NoiseDensity "
    "Quantised Scaled Sensed Sensor SensorKind StarTracker White",
}
"""Public names by the module that defines them."""

_PLACES = {name: module for module, names in _NAMES.items() for name in names.split()}

# the pinned ArviZ announces its successor at every import
warnings.filterwarnings("ignore", message="\\s*ArviZ is undergoing", category=FutureWarning)


class _Package(ModuleType):
    """The package, whose functions `design` and `identifiability` have the names of rooms.

    Importing a room would put it in place of the function. It does not, so that the name means the function whatever is
    imported and when; ``from bayesid.design import Problem`` finds the room all the same.
    """

    def __setattr__(self, name: str, value: object) -> None:
        if not (name in _PLACES and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package


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
