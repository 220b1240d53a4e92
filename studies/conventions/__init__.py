"""Conventions: how often wrong ones are named, and how often correct studies are reported as wrong."""

from studies.conventions.report import STUDY

__all__ = ["STUDY", "main"]

main = STUDY.main
