"""Reports as PDF."""

from bayesid.report.check import check_report
from bayesid.report.design import design_report
from bayesid.report.diagnosis import diagnosis_report
from bayesid.report.document import Document
from bayesid.report.identification import identification_report
from bayesid.report.numbers import format_quantity
from bayesid.report.prediction import prediction_report
from bayesid.report.simulation import simulation_report

__all__ = [
    "Document",
    "check_report",
    "design_report",
    "diagnosis_report",
    "format_quantity",
    "identification_report",
    "prediction_report",
    "simulation_report",
]
