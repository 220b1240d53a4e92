"""Words for sentences: lists of names, and nouns that agree with their number."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

__all__ = ["abridged", "counted", "first_sentence", "joined", "ordinal"]

NAMED = 8  # number of texts that an abridged list names by default


def joined(texts: Iterable[str]) -> str:
    """Return texts as a list in a sentence: ``a``, ``a and b``, ``a, b and c``."""
    *first, last = [*texts] or [""]
    return f"{', '.join(first)} and {last}" if first else last


def abridged(texts: Sequence[str], most: int = NAMED, separator: str = ", ") -> str:
    """Return a list of texts that names the first few and counts the rest: ``a, b and 3 more``.

    Parameters
    ----------
    texts : sequence of str
    most : int
        Number of texts that are named.
    separator : str
    """
    more = len(texts) - most
    return separator.join(texts[:most]) + (f" and {more} more" if more > 0 else "")


def counted(number: int, noun: str, plural: str | None = None) -> str:
    """Return a number with its noun, whose plural has an s unless stated: ``1 recording``, ``3 recordings``.

    Parameters
    ----------
    number : int
    noun : str
        Noun in the singular.
    plural : str, optional
        Irregular plural.
    """
    return f"{number} {noun if number == 1 else plural or f'{noun}s'}"


def ordinal(number: int) -> str:
    """Return the ordinal of a number that counts from one: ``first``, ``second``, ``third``, ``4th``."""
    return {1: "first", 2: "second", 3: "third"}.get(number, f"{number}th")


def first_sentence(text: str) -> tuple[str, str]:
    """Return the first sentence of a text, of two words or more, and the rest, which starts with a capital or digit."""
    parts = re.match(r"(\S+ .*?[.!?]) ([A-Z0-9].*)", text, re.DOTALL)
    return (parts[1], parts[2]) if parts else (text, "")
