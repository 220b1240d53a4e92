"""Errors that a user meets, and files that are complete or absent."""
