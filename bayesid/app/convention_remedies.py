"""Remedies of wrong conventions, written into a study file key by key, after asking."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Iterator, Mapping, MutableMapping, Sequence
from pathlib import Path
from typing import Any

import tomlkit

from bayesid._io.errors import InputError
from bayesid._io.files import write_text
from bayesid.app.schema import Study
from bayesid.app.study_to_conventions import convention_lines
from bayesid.app.study_to_model import load_manoeuvres, load_model
from bayesid.inference.conventions import find_conventions
from bayesid.inference.posterior import Posterior
from bayesid.inference.wrong_units import refuse_wrong_units
from bayesid.recording.convention import Convention, ConventionError, in_one_line

__all__ = ["conventions_of", "fixed_study", "with_remedies"]

ROUNDS = 4  # largest number of times that a study is put right: a unit of time hides all other mistakes
LIKELY = 0.5  # probability above which a remedy is offered: of two that exclude each other only one has it


def conventions_of(study: Study) -> list[Convention]:
    """Return the wrong conventions of a study, however they show.

    Parameters
    ----------
    study : Study
    """
    try:
        model = load_model(study)
        manoeuvres = load_manoeuvres(study, model.robot)
        if conventions := find_conventions(model, manoeuvres):
            return conventions
        refuse_wrong_units(Posterior.of(model, manoeuvres, window=0))
    except ConventionError as error:
        if error.conventions:
            return list(error.conventions)
        raise
    return []


def fixed_study(file: Path, agrees: Callable[[str], bool]) -> Iterator[str]:
    """Write the remedies of a study's wrong conventions into its file, until none is left.

    Parameters
    ----------
    file : Path
        Study file.
    agrees : callable
        Asks whether a remedy is to be written.

    Yields
    ------
    str
        Sentences to show.
    """
    for _ in range(ROUNDS):
        conventions = conventions_of(Study.load(file))
        offered = [convention for convention in conventions if convention.probability > LIKELY]
        yield from convention_lines(conventions)
        if conventions and not offered:
            yield "The data cannot distinguish these conventions: choose one and write it into the study."
        accepted = [offer for offer in offered if agrees(f"Write into {file.name}: {in_one_line(offer.remedy)}?")]
        if not accepted:
            yield f"{file}: {'nothing was written' if conventions else 'no wrong convention was detected'}."
            return
        text = with_remedies(file.read_text(encoding="utf-8-sig"), [convention.remedy for convention in accepted])
        Study.from_mapping(tomllib.loads(text), file)
        write_text(file, text)
        yield f"Wrote {len(accepted)} of {len(conventions)} remedies into {file}."


def with_remedies(text: str, remedies: Sequence[str]) -> str:
    """Return the text of a study with lines of other keys, which replace those that stand there.

    Parameters
    ----------
    text : str
    remedies : sequence of str
        Each a header in brackets with its keys, or several of them: the n-th of one header in double brackets means
        the n-th such section of the study.
    """
    lines = text.splitlines()
    for remedy in remedies:
        headers: list[str] = []
        for line in remedy.splitlines():
            if line.startswith("["):
                headers.append(line)
            else:
                _write(lines, headers, line)
    return "\n".join([*lines, ""])


def _write(lines: list[str], headers: Sequence[str], line: str) -> None:
    """Write a line with a key into the section of the last of the headers."""
    if not headers:
        raise InputError(f"the remedy {line} belongs to no section", remedy="Write the section's header before it")
    header, key = headers[-1], line.partition("=")[0].strip()
    number = headers.count(header) - 1 if header.startswith("[[") else 0
    if _place(lines, header, number) is None:
        if not header.startswith("[[") and (merged := _merged(lines, header, line)) is not None:
            lines[:] = merged
            return
        lines += ["", header]
    start = _place(lines, header, number)
    assert start is not None
    end = next((i for i in range(start + 1, len(lines)) if lines[i].lstrip().startswith("[")), len(lines))
    same = [i for i in range(start + 1, end) if re.match(rf"\s*{re.escape(key)}\s*=", lines[i])]
    if same:
        lines[same[0]] = line
    else:
        lines.insert(start + 1, line)


def _merged(lines: Sequence[str], header: str, line: str) -> list[str] | None:
    """Return the lines with one more key in a section that is written without a header, None where it is not there."""
    document = tomlkit.parse("\n".join(lines))
    section: Any = document
    added: Any = tomlkit.parse(f"{header}\n{line}")
    while len(added) == 1 and isinstance(next(iter(added.values())), Mapping):
        ((name, added),) = added.items()
        section = section.get(name) if isinstance(section, Mapping) else None
    if not isinstance(section, MutableMapping):
        return None
    section.update(added)
    return tomlkit.dumps(document).splitlines()


def _place(lines: Sequence[str], header: str, number: int = 0) -> int | None:
    """Return the number of the line with the n-th such header, however its name is quoted."""
    plain = header.replace('"', "").strip()
    same = [i for i, line in enumerate(lines) if line.partition("#")[0].replace('"', "").strip() == plain]
    return same[number] if number < len(same) else None
