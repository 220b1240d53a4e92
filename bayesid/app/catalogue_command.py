"""Command ``bayesid catalogue``, which prints what is known of the effects that a model can have."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer

__all__ = ["run"]


def run(
    name: Annotated[str | None, typer.Argument(help="Name of an effect; by default all effects.")] = None,
    study: Annotated[
        Path | None,
        typer.Option(metavar="STUDY.toml", help="Study with robot, orbit and plugins; by default those of ETS-VII."),
    ] = None,
) -> Iterator[str]:
    """List the effects of the catalogue: parameters, units, priors, largest plausible sizes, requirements."""
    from bayesid.app.schema import Study

    loaded = None if study is None else Study.load(study)

    from bayesid.app.study_to_model import load_model
    from bayesid.report.effect_catalogue import catalogue, entry_of

    entries = catalogue(None if loaded is None else load_model(loaded))
    shown = entries if name is None else [entry_of(name, entries)]
    typer.echo("\n\n".join(str(entry) for entry in shown))
    if name is None:
        yield f"{len(entries)} effects. `bayesid catalogue NAME` prints one."
