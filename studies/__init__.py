"""Studies: each returns its numbers and figures, and writes its report."""
