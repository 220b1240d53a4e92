"""The robot: its tree of links, inertial parameters, kinematics and regressors."""
