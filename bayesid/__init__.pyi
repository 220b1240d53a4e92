"""Public names of the package, which `__init__.py` loads when they are first used."""

from bayesid._io.errors import InputError as InputError
from bayesid.app.functions.check_study import StudyCheck as StudyCheck
from bayesid.app.functions.check_study import check as check
from bayesid.app.functions.design_study import Designs as Designs
from bayesid.app.functions.design_study import design as design
from bayesid.app.functions.diagnose_study import diagnose as diagnose
from bayesid.app.functions.identifiability_of_study import (
    Identifiability as Identifiability,
)
from bayesid.app.functions.identifiability_of_study import (
    identifiability as identifiability,
)
from bayesid.app.functions.identify_study import identify as identify
from bayesid.app.functions.loop_study import LoopResult as LoopResult
from bayesid.app.functions.loop_study import loop as loop
from bayesid.app.functions.predict_study import Predictions as Predictions
from bayesid.app.functions.predict_study import predict as predict
from bayesid.app.functions.simulate_study import Simulation as Simulation
from bayesid.app.functions.simulate_study import simulate as simulate
from bayesid.app.schema import Study as Study
from bayesid.app.study_to_design import load_problem as load_problem
from bayesid.app.study_to_model import (
    load_manoeuvres as load_manoeuvres,
)
from bayesid.app.study_to_model import (
    load_model as load_model,
)
from bayesid.app.study_to_model import (
    load_posterior as load_posterior,
)
from bayesid.design import Design as Design
from bayesid.design import Problem as Problem
from bayesid.design.base_prediction import Prediction as Prediction
from bayesid.design.loop_history import History as History
from bayesid.diagnosis import (
    CausePrior as CausePrior,
)
from bayesid.diagnosis import (
    Diagnosis as Diagnosis,
)
from bayesid.diagnosis import (
    DiagnosisSettings as DiagnosisSettings,
)
from bayesid.diagnosis import (
    Status as Status,
)
from bayesid.inference.identification import Identification as Identification
from bayesid.inference.posterior import Posterior as Posterior
from bayesid.inference.sampler import (
    Emcee as Emcee,
)
from bayesid.inference.sampler import (
    PosteriorDraws as PosteriorDraws,
)
from bayesid.inference.sampler import (
    Sampler as Sampler,
)
from bayesid.inference.sampler import (
    SamplingTarget as SamplingTarget,
)
from bayesid.recording.joint_motion import Excitation as Excitation
from bayesid.recording.joint_motion import MeasuredMotion as MeasuredMotion
from bayesid.recording.recording import Recording as Recording
from bayesid.report.figures import (
    plot_disturbance as plot_disturbance,
)
from bayesid.report.figures import (
    plot_manoeuvre as plot_manoeuvre,
)
from bayesid.report.figures import (
    plot_posterior as plot_posterior,
)
from bayesid.report.figures import (
    plot_residuals as plot_residuals,
)
from bayesid.report.figures import (
    plot_robot as plot_robot,
)
from bayesid.report.figures import (
    plot_spectrum as plot_spectrum,
)
from bayesid.report.figures import (
    plot_verdict as plot_verdict,
)
from bayesid.robot.body_prior import BodyPrior as BodyPrior
from bayesid.robot.inertial_parameters import InertialParameters as InertialParameters
from bayesid.robot.robot import Load as Load
from bayesid.robot.robot import Robot as Robot
from bayesid.robot.wheel import Wheel as Wheel
from bayesid.simulation.effects import (
    Effect as Effect,
)
from bayesid.simulation.effects import (
    Parameter as Parameter,
)
from bayesid.simulation.effects import (
    Wrench as Wrench,
)
from bayesid.simulation.effects import (
    create as create,
)
from bayesid.simulation.effects import (
    known_effects as known_effects,
)
from bayesid.simulation.effects import (
    register as register,
)
from bayesid.simulation.joint_torques import TorqueSensor as TorqueSensor
from bayesid.simulation.model import Manoeuvre as Manoeuvre
from bayesid.simulation.model import Model as Model
from bayesid.simulation.orbit import Orbit as Orbit
from bayesid.simulation.sensors import (
    AngleRandomWalk as AngleRandomWalk,
)
from bayesid.simulation.sensors import (
    Coloured as Coloured,
)
from bayesid.simulation.sensors import (
    Filter as Filter,
)
from bayesid.simulation.sensors import (
    Instrument as Instrument,
)
from bayesid.simulation.sensors import (
    Noise as Noise,
)
from bayesid.simulation.sensors import (
    NoiseDensity as NoiseDensity,
)
from bayesid.simulation.sensors import (
    Quantised as Quantised,
)
from bayesid.simulation.sensors import (
    Scaled as Scaled,
)
from bayesid.simulation.sensors import (
    Sensed as Sensed,
)
from bayesid.simulation.sensors import (
    Sensor as Sensor,
)
from bayesid.simulation.sensors import (
    SensorKind as SensorKind,
)
from bayesid.simulation.sensors import (
    StarTracker as StarTracker,
)
from bayesid.simulation.sensors import (
    White as White,
)

__all__: list[str]
__version__: str
