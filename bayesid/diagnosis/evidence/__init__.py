"""Evidence of sets of causes on one Gram matrix: NumPy and SciPy alone, no simulation."""
