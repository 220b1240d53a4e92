"""Reports as PDF: the document with its text, tables and figures, and one module per report."""

from bayesid.report.check_report import check_report
from bayesid.report.design_report import design_report
from bayesid.report.diagnosis.diagnosis_report import diagnosis_report
from bayesid.report.document import Document
from bayesid.report.identifiability_report import identifiability_report
from bayesid.report.identification_report import identification_report
from bayesid.report.loop_report import loop_report
from bayesid.report.numbers import format_quantity
from bayesid.report.prediction_report import prediction_report
from bayesid.report.simulation_report import simulation_report

__all__ = [
    "Document",
    "check_report",
    "design_report",
    "diagnosis_report",
    "format_quantity",
    "identifiability_report",
    "identification_report",
    "loop_report",
    "prediction_report",
    "simulation_report",
]
