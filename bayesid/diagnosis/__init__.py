"""What the simulation gets wrong: candidates, tests, search, verdict and gain."""

from bayesid.diagnosis.candidates import candidates
from bayesid.diagnosis.diagnosis import Diagnosis, diagnose, identify_extended
from bayesid.diagnosis.evidence import Candidate
from bayesid.diagnosis.gain import Gain
from bayesid.diagnosis.search import Hypothesis, Search
from bayesid.diagnosis.unexplained import Frame, Unexplained
from bayesid.diagnosis.verdict import Status, Verdict

__all__ = [
    "Candidate",
    "Diagnosis",
    "Frame",
    "Gain",
    "Hypothesis",
    "Search",
    "Status",
    "Unexplained",
    "Verdict",
    "candidates",
    "diagnose",
    "identify_extended",
]
