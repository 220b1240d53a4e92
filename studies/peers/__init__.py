"""Peers: bayesid compared with its alternatives, on the same density and on the same task."""

from studies.peers.report import STUDY

__all__ = ["STUDY", "main"]

main = STUDY.main
