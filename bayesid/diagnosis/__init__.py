"""What the simulation gets wrong: candidates, tests, search, verdict and gain."""

from bayesid.diagnosis.candidate_effects import candidates
from bayesid.diagnosis.candidate_table import Candidate
from bayesid.diagnosis.cause_search import CauseSearch, Hypothesis
from bayesid.diagnosis.diagnosis_run import Diagnosis, diagnose, identify_extended
from bayesid.diagnosis.disturbing_wrench import Frame, Unexplained
from bayesid.diagnosis.gain import Gain
from bayesid.diagnosis.verdict import Status, Verdict

__all__ = [
    "Candidate",
    "CauseSearch",
    "Diagnosis",
    "Frame",
    "Gain",
    "Hypothesis",
    "Status",
    "Unexplained",
    "Verdict",
    "candidates",
    "diagnose",
    "identify_extended",
]
