"""Errors that a user meets, files that are complete or absent, results kept under a key, and progress."""
