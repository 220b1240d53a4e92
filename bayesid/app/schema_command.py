"""Command ``bayesid schema``, which writes the JSON Schema of the study file for editors."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer

__all__ = ["run"]


def run(
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="File to write; by default the schema is printed.")
    ] = None,
) -> Iterator[str]:
    """Write the JSON Schema of study files, for completion and validation in editors."""
    import json

    from bayesid.app.schema.editor_schema import editor_schema

    if output is None:
        typer.echo(json.dumps(editor_schema(), indent=1))
        return

    from bayesid._io.errors import InputError
    from bayesid._io.files import create_folder, write_json

    if output.is_dir():
        raise InputError("this is a folder", file=output, remedy="Give the name of the file to write")
    create_folder(output.parent)
    write_json(output, editor_schema())
    yield f"Wrote {output}. Reference it in the first line of a study: #:schema {output.name}"
