"""What is timed: diagnoses of files that MuJoCo wrote, and the other commands on those with nothing hidden."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from studies.truth import hidden_causes

__all__ = ["COMMANDS", "DIAGNOSES", "Diagnosed", "write_case"]

FIRST_SEED = 7100
"""Seed of the first case; those of tests and of the campaign are others."""


class Diagnosed(NamedTuple):
    """A diagnosis that is timed.

    Attributes
    ----------
    title : str
        What is hidden.
    case : str
        Name of the case of `studies.truth.hidden_causes`.
    warm, cold : float
        Longest wanted times from files to verdict, with compiled code kept and without [s].
    """

    title: str
    case: str
    warm: float
    cold: float


DIAGNOSES = (
    Diagnosed("nothing", "null, three joints", 5.0, 20.0),
    Diagnosed("leak", "thruster-leak", 5.0, 20.0),
    Diagnosed("payload", "payload:link3", 5.0, 20.0),
    Diagnosed("link", "link-inertia:link2", 5.0, 20.0),
    Diagnosed("wheel and bias", "wheel-momentum, accel-bias", 10.0, 40.0),
    Diagnosed("growing torque", "growing-torque", 10.0, 40.0),
    Diagnosed("swinging torque", "swinging-torque", 10.0, 40.0),
)
"""Single causes within 5 s, cold 20 s; pairs and what nobody listed within twice that."""

COMMANDS = {
    "check": (("check",), None),
    "identify": (("identify",), 20.0),
    "identifiability": (("identifiability",), 30.0),
    "design": (("design",), 120.0),
}
"""Other commands: words, and the longest wanted time with compiled code kept, from files to report [s]."""


def write_case(name: str, folder: Path) -> Path:
    """Write the files of a case, three recordings of 140 to 160 s, and return the study's."""
    number = next(k for k, case in enumerate(hidden_causes.CASES) if case.name == name)
    return hidden_causes.CASES[number].make(folder, FIRST_SEED + number)
