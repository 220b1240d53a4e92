"""Command ``bayesid check``, which shows the contents of a study and its recordings."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from bayesid.app.options import Output, StudyFile

if TYPE_CHECKING:
    from bayesid.inference.recording_check import RecordingCheck

__all__ = ["run"]


def run(file: StudyFile, output: Output) -> Iterator[str]:
    """Validate a study and its recordings, and report their contents: check.json and report.pdf."""
    from bayesid.app.schema import Study

    study = Study.load(file)

    from bayesid._io.files import complete_folder, write_json
    from bayesid.app.report_origin import report_origin
    from bayesid.app.study_draft import open_places
    from bayesid.app.study_to_model import load_posterior
    from bayesid.inference.recording_check import check_recording
    from bayesid.inference.wrong_units import refuse_wrong_units
    from bayesid.report import check_report

    posterior = load_posterior(study, window=0)  # nothing is fitted: the samples' correlations do not matter
    refuse_wrong_units(posterior)
    count = len(posterior.manoeuvres)
    yield f"{study.title}: {count} recordings, {posterior.samples} samples, {posterior.size} unknowns."
    yield from open_places(study)
    yield from posterior.model.robot.remarks
    checks = [check_recording(posterior, index) for index in range(count)]
    with complete_folder(output) as folder:
        write_json(
            folder / "check.json",
            {
                "title": study.title,
                "robot": {"remarks": posterior.model.robot.remarks},
                "recordings": [_check_dict(check) for check in checks],
            },
        )
        origin = report_origin(study, "check", None, output=output)
        check_report(posterior, checks, study.title, folder / "report.pdf", origin=origin)
    for check in checks:
        yield f"{check.name}: {check.duration:.4g} s. " + (" ".join(check.warnings) or "Nothing conspicuous.")
    yield f"Wrote {output / 'report.pdf'}."


def _check_dict(check: RecordingCheck) -> dict[str, Any]:
    content = asdict(check)
    for sensor in content["sensors"]:
        sensor["kind"] = sensor["kind"].value
    for suspect in content["suspects"]:
        suspect["kind"] = suspect["kind"].value
    content["warnings"] = list(check.warnings)
    return content
