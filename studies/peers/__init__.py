"""Peers: bayesid beside what its users would use instead, on the same density and on the same task."""
