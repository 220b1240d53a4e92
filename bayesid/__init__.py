"""Bayesian identification of the inertial parameters of free-flying space robots.

A study names a robot, its sensors and recordings; its posterior is identified by emcee::

    study = bayesid.Study.load("study.toml")
    result = bayesid.identify(bayesid.load_posterior(study), seed=1)
    print(result.bodies["base_link"].mean)
"""

import warnings

import jax

jax.config.update("jax_enable_x64", True)
# the pinned ArviZ announces its successor at every import
warnings.filterwarnings("ignore", message="\\s*ArviZ is undergoing", category=FutureWarning)

from bayesid.assemble import load_posterior  # noqa: E402
from bayesid.effects import Effect, register  # noqa: E402
from bayesid.errors import InputError  # noqa: E402
from bayesid.inertia import InertialParameters  # noqa: E402
from bayesid.inference import Identification, identify  # noqa: E402
from bayesid.model import Manoeuvre, Model  # noqa: E402
from bayesid.motion import Excitation, MeasuredMotion  # noqa: E402
from bayesid.orbit import Orbit  # noqa: E402
from bayesid.posterior import Posterior  # noqa: E402
from bayesid.recording import Recording  # noqa: E402
from bayesid.robot import Load, Robot  # noqa: E402
from bayesid.sensors import Kind, Sensor, White  # noqa: E402
from bayesid.study import Study  # noqa: E402
from bayesid.unknowns import BodyPrior  # noqa: E402

__all__ = [
    "BodyPrior",
    "Effect",
    "Excitation",
    "Identification",
    "InertialParameters",
    "InputError",
    "Kind",
    "Load",
    "Manoeuvre",
    "MeasuredMotion",
    "Model",
    "Orbit",
    "Posterior",
    "Recording",
    "Robot",
    "Sensor",
    "Study",
    "White",
    "identify",
    "load_posterior",
    "register",
]
