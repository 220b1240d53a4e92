"""Recordings: read and written, joint motion smoothed, known actions, impossible values refused."""
