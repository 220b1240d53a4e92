"""What the paper prints on problem 1 (section 4.1); the ten quantities are in the order of `BODY_QUANTITIES`."""

from __future__ import annotations

import numpy as np

# true mass [kg], centre of mass [m] and inertia xx, yy, zz, xy, xz, yz [kg m2]
TRUTH = np.array([2645.9, -0.532, -0.281, 1.499, 5665.5, 3033.0, 7067.2, 54.2, 145.1, -123.2])

# initial guess of the identification
GUESS = np.array([1000.0, 0.5, 0.5, 0.5, 1000.0, 1000.0, 1000.0, 10.0, 10.0, 10.0])

RESULT_WELL = np.array([2645.7, -0.53, -0.28, 1.50, 5667.25, 3037.73, 7075.85, 50.98, 148.39, -124.13])
# results from the well exciting and from the poorly exciting manoeuvre
RESULT_POOR = np.array([2655.99, -0.54, -0.23, 1.53, 5539.09, 3007.88, 7070.54, 42.70, 161.246, -57.47])

# optimum of (26): q1 and q2 of joint 1, of joint 2, of joint 3 [rad]
EXCITATION = np.array([0.63, -1.87, -2.18, -0.15, 5.3e-2, -0.56])

LIMIT = np.pi / 2.0  # joint limit that the paper states [rad]

# sigma of the noise in the simulated signals of the paper's reference [16], and in the data of ETS-VII; no unit. All
# studies read them as degrees per second of the rates and degrees of the joints: in rad/s the first would be five times
# the largest rate of the base. An accelerometer gets noise of the same share of its peak as the rates.
SIGMAS = (0.04, 0.009)
