"""Command ``bayesid check``, which shows the contents of a study and its recordings."""

from __future__ import annotations

from collections.abc import Iterator

from bayesid._io.words import counted
from bayesid.app.options import Output, StudyFile

__all__ = ["run"]


def run(file: StudyFile, output: Output) -> Iterator[str]:
    """Validate a study and its recordings, and report their contents: check.json and report.pdf."""
    from bayesid.app.schema import Study

    study = Study.load(file)

    from bayesid._io.files import complete_folder, write_json
    from bayesid.app.functions.check_study import check
    from bayesid.app.report_origin import report_origin
    from bayesid.app.study_draft import open_places
    from bayesid.report import check_report

    result = check(study)
    posterior = result.posterior
    count = len(posterior.manoeuvres)
    yield f"{study.title}: {counted(count, 'recording')}, {posterior.samples} samples, {posterior.size} unknowns."
    yield from open_places(study)
    yield from posterior.model.robot.remarks
    with complete_folder(output) as folder:
        write_json(folder / "check.json", result.to_dict())
        origin = report_origin(study, "check", None, output=output)
        check_report(posterior, result.recordings, study.title, folder / "report.pdf", origin=origin)
    yield from result.summary().sentences
    yield f"Wrote {output / 'report.pdf'}."
