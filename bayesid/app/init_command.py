"""Command ``bayesid init``, which drafts the study file of a robot and its recordings."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer

from bayesid._io.errors import InputError
from bayesid._io.words import counted

__all__ = ["run"]


def run(
    robot: Annotated[Path | None, typer.Argument(metavar="ROBOT.urdf", help="Robot, as URDF or MJCF.")] = None,
    recordings: Annotated[
        list[Path] | None, typer.Argument(metavar="RECORDING...", help="CSV or Parquet files.")
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="STUDY.toml", help="Study file to write.")
    ] = None,
    nearest_physical: Annotated[
        bool, typer.Option("--nearest-physical", help="Replace impossible link inertias by the nearest possible ones.")
    ] = False,
    fix: Annotated[
        Path | None,
        typer.Option(
            "--fix",
            metavar="STUDY.toml",
            help="Correct wrong conventions in this study, asking before each; no argument is needed.",
        ),
    ] = None,
    yes: Annotated[bool, typer.Option("--yes", help="Write the corrections without asking.")] = False,
) -> Iterator[str]:
    """Draft a study file for a robot and its recordings, and mark values that need to be checked."""
    if fix is not None:
        from bayesid.app.convention_remedies import fixed_study

        if robot is not None or output is not None:
            problem = "--fix changes a study, and takes neither a robot nor recordings nor --output"
            raise InputError(problem, remedy=f"bayesid init --fix {fix}")

        yield from fixed_study(fix, (lambda question: True) if yes else typer.confirm)
        return
    if robot is None or not recordings or output is None:
        problem = "robot, recordings and --output are required"
        raise InputError(problem, remedy="bayesid init ROBOT.urdf RECORDING... --output STUDY.toml")
    if output.exists():
        raise InputError("the file exists", file=output, remedy="Choose another output; init never overwrites a file")
    if output.suffix != ".toml":
        raise InputError("a study is a TOML file", file=output, remedy=f"Name it {output.with_suffix('.toml')}")

    import tomllib

    from bayesid._io.files import create_folder, write_text
    from bayesid.app.schema import Study
    from bayesid.app.study_draft import CHECK, draft_study
    from bayesid.recording.recording import Recording
    from bayesid.robot.robot import Robot

    known = Robot.from_urdf(robot, nearest_physical=nearest_physical)
    read = [Recording.read(file) for file in recordings]
    text = draft_study(known, robot, read, output.parent, output.stem, nearest_physical=nearest_physical)
    try:
        Study.from_mapping(tomllib.loads(text))
    except InputError as error:
        problem = f"no valid study can be drafted from the recordings: {error.problem}"
        raise InputError(problem, place=error.place, remedy=error.remedy) from None
    create_folder(output.parent)
    write_text(output, text)
    yield from known.remarks
    yield f"Matched {counted(len(known.joints), 'joint')} of {known.name} in {counted(len(read), 'recording')}."
    yield f"Wrote {output}, with {text.count(CHECK)} places marked `{CHECK}`."
    yield f"Next: bayesid check {output} --output {output.with_name(output.stem + '-check')}"
