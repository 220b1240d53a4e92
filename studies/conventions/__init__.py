"""Conventions: how often wrong ones are named, and how often right studies are taken for wrong."""

from studies.conventions.report import STUDY

__all__ = ["STUDY", "main"]

main = STUDY.main
