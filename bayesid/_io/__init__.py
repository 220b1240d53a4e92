"""Errors for the user, files that are complete or absent, results kept under a key, and progress."""
