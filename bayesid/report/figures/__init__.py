"""Figures of the reports; every function returns a new matplotlib Figure, and none touches pyplot."""

from bayesid.report.figures.design_figures import (
    base_motion,
    covariance_ellipses,
    final_positions,
    joints_within_limits,
    loop_progress,
    tip_motion,
    trajectory_bands,
)
from bayesid.report.figures.diagnosis_figures import (
    candidate_strengths,
    cause_picture,
    parameter_forest,
    wrench_histories,
    wrench_spectrum,
)
from bayesid.report.figures.plots import (
    plot_disturbance,
    plot_manoeuvre,
    plot_posterior,
    plot_residuals,
    plot_robot,
    plot_spectrum,
    plot_verdict,
)
from bayesid.report.figures.posterior_figures import (
    convergence,
    corner,
    correlations,
    direction_widths,
    displacements,
    prior_to_posterior,
)
from bayesid.report.figures.residual_figures import (
    measured_against_simulated,
    residual_histories,
    residual_spectra,
    residual_statistics,
    torques_over_time,
)
from bayesid.report.figures.robot_figures import manoeuvre, robot_pose, robot_shapes

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
    "plot_disturbance",
    "plot_manoeuvre",
    "plot_posterior",
    "plot_residuals",
    "plot_robot",
    "plot_spectrum",
    "plot_verdict",
    "prior_to_posterior",
    "residual_histories",
    "residual_spectra",
    "residual_statistics",
    "robot_pose",
    "robot_shapes",
    "tip_motion",
    "torques_over_time",
    "trajectory_bands",
    "wrench_histories",
    "wrench_spectrum",
]
