"""Conventions: how often wrong ones are named, and how often right studies are taken for wrong."""
