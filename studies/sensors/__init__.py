"""Section 4.3 of the paper, treatment of noise and sensor precision: its expectations, verified in three dimensions.

Joints are differentiated twice, filtered or fitted; rates are filtered; the accelerometer is integrated or not; the
linear method and the integral one are compared. Monte Carlo over data of an independent simulator gives the bias and
the standard deviation of the base's ten parameters. ``python -m studies.sensors --full`` writes
``reports/sensors.pdf``.
"""

from studies.sensors.report import STUDY
from studies.sensors.result import Effort, Result, run

__all__ = ["STUDY", "Effort", "Result", "main", "run"]

main = STUDY.main
