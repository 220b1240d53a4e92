"""What the diagnosis says before and after the designed manoeuvre."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from bayesid.diagnosis import diagnose
from bayesid.recording.joint_motion import Motion
from studies.separating.factors import flown, noisy
from studies.separating.setting import CANDIDATES, RIVALS, TRUTHS, rival_model

__all__ = ["Verdict", "verdicts"]


@dataclass(frozen=True)
class Verdict:
    """Status, the causes that are named, and the rivals that do as well."""

    status: str
    causes: tuple[str, ...]
    rivals: tuple[str, ...]


def verdicts(
    motions: Mapping[str, Motion],
    stages: Mapping[str, tuple[str, ...]],
    duration: float,
    seed: int,
    progress: Callable[[str], None],
) -> dict[tuple[str, str], Verdict]:
    """Diagnose the flights of one noise with each rival hidden; candidates are the five of the study.

    Parameters
    ----------
    stages : mapping of str to tuple of str
        Names of the manoeuvres that are diagnosed together.
    duration : float
        Of every manoeuvre [s].
    """
    found, model = {}, rival_model([])
    for truth in RIVALS:
        flights = {name: flown(motion, duration, truth, TRUTHS[truth]) for name, motion in motions.items()}
        for stage, names in stages.items():
            result = diagnose(model, noisy(flights, names, seed), seed, effects=list(CANDIDATES)).verdict
            rivals = tuple(" + ".join(rival.labels) for rival in result.rivals)
            found[truth, stage] = Verdict(result.status.value, tuple(result.causes), rivals)
            progress(f"{truth}, {stage}: {found[truth, stage]}")
    return found
