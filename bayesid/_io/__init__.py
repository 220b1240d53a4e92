"""Errors for the user, files that are complete or absent, results stored under a key, and progress."""
