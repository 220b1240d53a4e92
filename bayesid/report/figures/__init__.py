"""Figures of the reports; every function returns a matplotlib Figure, and none changes pyplot or its settings.

Those called ``plot_`` are also for users: they take a result, and optionally the user's axes.
"""

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
    joint_error_curve,
    parameter_forest,
    plot_disturbance,
    plot_verdict,
    wrench_histories,
    wrench_spectrum,
)
from bayesid.report.figures.posterior_figures import (
    convergence,
    correlations,
    direction_widths,
    displacements,
    plot_posterior,
    prior_to_posterior,
)
from bayesid.report.figures.residual_figures import (
    channel_spectra,
    measured_against_simulated,
    plot_residuals,
    plot_spectrum,
    residual_statistics,
    torques_over_time,
)
from bayesid.report.figures.robot_figures import manoeuvre, plot_manoeuvre, plot_robot, robot_pose

__all__ = [
    "base_motion",
    "candidate_strengths",
    "channel_spectra",
    "convergence",
    "correlations",
    "covariance_ellipses",
    "direction_widths",
    "displacements",
    "final_positions",
    "joint_error_curve",
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
    "residual_statistics",
    "robot_pose",
    "tip_motion",
    "torques_over_time",
    "trajectory_bands",
    "wrench_histories",
    "wrench_spectrum",
]
