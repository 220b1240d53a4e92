"""Figures of the reports; every function returns a new matplotlib Figure, and none touches pyplot."""

from bayesid.report.figures.agreement_figures import measured_against_simulated, torques_over_time
from bayesid.report.figures.cause_picture import cause_picture
from bayesid.report.figures.design_figures import base_motion, covariance_ellipses, joints_within_limits, tip_motion
from bayesid.report.figures.diagnosis_figures import candidate_strengths, wrench_histories, wrench_spectrum
from bayesid.report.figures.forest_figure import parameter_forest
from bayesid.report.figures.identifiability_figures import direction_widths, displacements
from bayesid.report.figures.loop_figures import loop_progress
from bayesid.report.figures.prediction_figures import final_positions, trajectory_bands
from bayesid.report.figures.residual_figures import residual_histories, residual_spectra, residual_statistics
from bayesid.report.figures.robot_figures import manoeuvre, robot_pose
from bayesid.report.figures.sampler_figures import convergence
from bayesid.report.figures.uncertainty_figures import corner, correlations, prior_to_posterior

__all__ = [
    "base_motion",
    "candidate_strengths",
    "cause_picture",
    "convergence",
    "corner",
    "correlations",
    "covariance_ellipses",
    "direction_widths",
    "displacements",
    "final_positions",
    "joints_within_limits",
    "loop_progress",
    "manoeuvre",
    "measured_against_simulated",
    "parameter_forest",
    "prior_to_posterior",
    "residual_histories",
    "residual_spectra",
    "residual_statistics",
    "robot_pose",
    "tip_motion",
    "torques_over_time",
    "trajectory_bands",
    "wrench_histories",
    "wrench_spectrum",
]
