"""Check of a study and its recordings, before anything is identified."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from bayesid._io.short_form import ShortForm, Summary
from bayesid.app.functions.study_source import StudySource, recorded_posterior, study_of
from bayesid.inference.posterior import Posterior
from bayesid.inference.recording_check import RecordingCheck, check_recording

__all__ = ["StudyCheck", "check"]


@dataclass(frozen=True, repr=False)
class StudyCheck(ShortForm):
    """Result of `check`.

    Attributes
    ----------
    title : str
        Title of the study.
    posterior : Posterior
        Posterior of the recordings, without the correlation of the encoders' noise.
    recordings : tuple of RecordingCheck
        Sampling, noise and likely mistakes of each recording.
    """

    title: str
    posterior: Posterior
    recordings: tuple[RecordingCheck, ...]

    def summary(self) -> Summary:
        """Return what is conspicuous, a sentence for each recording."""
        return Summary(
            [
                f"{check.name}: {check.duration:.4g} s. " + (" ".join(check.warnings) or "Nothing conspicuous.")
                for check in self.recordings
            ]
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the content of check.json."""
        return {
            "title": self.title,
            "robot": {"remarks": self.posterior.model.robot.remarks},
            "recordings": [_check_dict(check) for check in self.recordings],
        }


def check(study: StudySource | Posterior) -> StudyCheck:
    """Check a study and its recordings: rates, gaps, noise, clocks, joints that hardly move.

    Parameters
    ----------
    study : path, Study or Posterior

    Raises
    ------
    InputError
        If a file is absent, a rule is broken or numbers cannot be in the units of the format.
    """
    study = study if isinstance(study, Posterior) else study_of(study)
    posterior = recorded_posterior(study, window=0)  # nothing is fitted: the samples' correlations do not matter
    checks = tuple(check_recording(posterior, index) for index in range(len(posterior.manoeuvres)))
    return StudyCheck("" if isinstance(study, Posterior) else study.title, posterior, checks)


def _check_dict(check: RecordingCheck) -> dict[str, Any]:
    content = asdict(check)
    for entry in (*content["sensors"], *content["suspects"]):
        entry["kind"] = entry["kind"].value
    content["warnings"] = list(check.warnings)
    return content
