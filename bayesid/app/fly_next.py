"""The manoeuvre that would tell the rivals of an undecided verdict apart."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from bayesid._io.progress import Progress
from bayesid.app.schema import Study
from bayesid.app.study_to_design import load_problem, separating
from bayesid.app.study_to_encoders import assume_missing, encoder_noise
from bayesid.design import Design, Search, best_design, design
from bayesid.recording.recording import Recording

__all__ = ["FILE", "fly_next", "write_motion"]

FILE = "next-manoeuvre.csv"
"""Name of the file of the joints' motion."""

STARTS, ITERATIONS = 2, 60  # effort of the search, a small part of that of ``bayesid design``


def fly_next(study: Study, rivals: tuple[str, str], seed: int, progress: Progress) -> Design:
    """Design a manoeuvre that tells two effects apart within the limits of the study, with little effort.

    Raises
    ------
    InputError
        If the study defines no design problem for these effects.
    """
    problem = load_problem(separating(study, rivals))
    noise, _ = assume_missing(encoder_noise(study, problem.plan.model.robot))
    with ThreadPoolExecutor(os.cpu_count()) as executor:
        effort = Search(STARTS, ITERATIONS, executor=executor)
        return best_design(design(problem, seed, noise, effort, progress=progress))


def write_motion(item: Design, file: Path) -> None:
    """Write the positions of the joints along a manoeuvre as a recording."""
    recording = item.manoeuvre.recording
    joints = {key: values for key, values in recording.channels.items() if key.startswith("position.")}
    Recording(item.name, None, recording.time, joints).write(file)
