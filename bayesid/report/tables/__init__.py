"""Rows of the reports' tables, one module per report."""
