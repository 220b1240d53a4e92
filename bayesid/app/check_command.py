"""Command ``bayesid check``, which shows the contents of a study and its recordings."""

from __future__ import annotations

from collections.abc import Iterator

from bayesid._io.progress import Progress, part_of
from bayesid._io.words import counted
from bayesid.app.options import Output, Scheduler, StudyFile, executor_of

__all__ = ["run"]


def run(file: StudyFile, output: Output, progress: Progress, scheduler: Scheduler = None) -> Iterator[str]:
    """Check a study and its recordings without a fit: check.json and report.pdf."""
    from bayesid.app.schema import Study

    study = Study.load(file)

    from bayesid._io.files import complete_folder, write_json
    from bayesid.app.functions.check_study import check
    from bayesid.app.report_origin import report_origin
    from bayesid.app.study_draft import open_places
    from bayesid.app.study_to_conventions import convention_lines, remedy_sentence
    from bayesid.recording.convention import ConventionError
    from bayesid.report import check_report

    try:
        with executor_of(scheduler) as executor:
            result = check(study, executor=executor, progress=part_of(progress, 0.0, 0.5))
    except ConventionError as error:  # so wrong that nothing else can be said
        conventions = [convention.to_dict() for convention in error.conventions]
        with complete_folder(output) as folder:
            write_json(folder / "check.json", {"title": study.title, "conventions": conventions})
        raise
    progress(0.5, "drawing the report")
    posterior = result.posterior
    count = len(posterior.manoeuvres)
    yield f"{study.title}: {counted(count, 'recording')}, {posterior.samples} samples, {posterior.size} unknowns."
    yield from open_places(study)
    yield from posterior.model.robot.remarks
    with complete_folder(output) as folder:
        write_json(folder / "check.json", result.to_dict())
        origin = report_origin(study, "check", None, output=output)
        said = convention_lines(result.conventions)
        file = folder / "report.pdf"
        check_report(posterior, result.recordings, study.title, file, conventions=result.conventions, origin=origin)
    yield from said
    if said:
        yield remedy_sentence(study.file)
    yield from result.summary().sentences
    yield f"Wrote {output / 'report.pdf'}."
