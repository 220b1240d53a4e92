"""Sentences of the reports and of the terminal, one module per report or subject."""
