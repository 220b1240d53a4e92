"""Recordings: their files, the smoothing of joint motion, known actions, and the refusal of impossible values."""
