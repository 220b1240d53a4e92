"""Check of a study and its recordings, before anything is identified."""

from __future__ import annotations

import math
from concurrent.futures import Executor
from dataclasses import asdict, dataclass
from typing import Any

from threadpoolctl import threadpool_limits

from bayesid._io.errors import InputError
from bayesid._io.progress import Progress, part_of, silent
from bayesid._io.short_form import ShortForm, Summary
from bayesid.app.functions.study_source import StudySource, study_of
from bayesid.app.study_to_model import load_manoeuvres, load_model
from bayesid.inference.conventions import find_conventions
from bayesid.inference.posterior import Posterior
from bayesid.inference.recording_check import RecordingCheck, check_recordings
from bayesid.inference.wrong_units import refuse_wrong_units
from bayesid.recording.convention import STATE_CONVENTIONS, Convention, ConventionError

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
    conventions : tuple of Convention
        Conventions of the recordings that differ from the declared ones.
    """

    title: str
    posterior: Posterior
    recordings: tuple[RecordingCheck, ...]
    conventions: tuple[Convention, ...] = ()

    def summary(self) -> Summary:
        """Return the warnings, one line per recording."""
        quiet = "See the conventions." if self.conventions else "No warnings."
        return Summary(
            [
                f"{check.name}: {check.duration:.4g} s. " + (" ".join(check.warnings) or quiet)
                for check in self.recordings
            ]
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the content of check.json."""
        return {
            "title": self.title,
            "robot": {"remarks": self.posterior.model.robot.remarks},
            "recordings": [_check_dict(check) for check in self.recordings],
            "conventions": [convention.to_dict() for convention in self.conventions],
        }


@threadpool_limits.wrap(limits=1)  # sums of several threads are slower here, and rounded by chance
def check(
    study: StudySource | Posterior, *, executor: Executor | None = None, progress: Progress = silent
) -> StudyCheck:
    """Check a study and its recordings: rates, gaps, noise, clocks, and joints that hardly move.

    Parameters
    ----------
    study : path, Study or Posterior
        Path of a study file, the study that was read from it, or its posterior.
    executor : concurrent.futures.Executor, optional
        Executor whose workers read one recording each.
    progress : Progress, optional
        Receiver of messages and of the share that is done.

    Raises
    ------
    InputError
        If a file is missing, a rule is violated or values cannot be in the units of the format.
    """
    study = study if isinstance(study, Posterior) else study_of(study)
    if isinstance(study, Posterior):
        posterior, conventions = study, find_conventions(study.model, study.manoeuvres)
    else:
        model = load_model(study)
        manoeuvres = load_manoeuvres(study, model.robot, part_of(progress, 0.0, 0.7), executor)
        conventions = find_conventions(model, manoeuvres)
        try:
            # nothing is fitted: the samples' correlations do not matter
            posterior = Posterior.of(model, manoeuvres, window=0)
        except InputError:  # with such readings nothing can be simulated
            if conventions:
                raise ConventionError(conventions, file=study.file, remedy=STATE_CONVENTIONS) from None
            raise
        if not conventions:
            refuse_wrong_units(posterior)
    checks = tuple(check_recordings(posterior, part_of(progress, 0.8, 1.0)))
    return StudyCheck("" if isinstance(study, Posterior) else study.title, posterior, checks, tuple(conventions))


def _check_dict(check: RecordingCheck) -> dict[str, Any]:
    content = asdict(check)
    for entry in (*content["sensors"], *content["suspects"]):
        entry["kind"] = entry["kind"].value
    for spectrum in content["spectra"]:  # curves are drawn in the report
        for key in ("frequency", "density"):
            spectrum.pop(key)
        for key in ("sigma", "declared", "sigma_error"):
            spectrum[key] = spectrum[key] if math.isfinite(spectrum[key]) else None
    content["warnings"] = list(check.warnings)
    return content
