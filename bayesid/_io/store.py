"""Results kept in files under a key, so that an interrupted run goes on from them.

The key is the SHA-256 of everything the results depend on. A file with another key is never used, by one rule: it is
refused, so that nothing a user waited for or flew is overwritten, unless its store is disposable; then it is replaced.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bayesid._io.errors import InputError
from bayesid._io.files import write_json

__all__ = ["JsonStore", "content_key", "file_key", "refuse_other"]


def content_key(*parts: object) -> str:
    """Return the SHA-256 of some content: files by what they hold, arrays by their values, all else by its `repr`."""
    digest = hashlib.sha256()
    for part in parts:
        if isinstance(part, Path):
            content = part.read_bytes()
        elif isinstance(part, np.ndarray):
            content = repr((part.shape, part.dtype.str)).encode() + part.tobytes()
        else:
            content = repr(part).encode()
        digest.update(hashlib.sha256(content).digest())
    return digest.hexdigest()


def file_key(file: Path) -> str:
    """Return the SHA-256 of a file, as other programs compute it."""
    return hashlib.sha256(file.read_bytes()).hexdigest()


def refuse_other(found: object, key: str, file: Path, owner: str, content: str) -> None:
    """Refuse a file with another key.

    Parameters
    ----------
    found : object
        The key that the file states.
    key : str
        The key that it should state.
    owner : str
        What the file belongs to, such as "loop".
    content : str
        What the key was made of, for the message.

    Raises
    ------
    InputError
        If the two differ.
    """
    if found != key:
        raise InputError(
            f"it belongs to another {owner}: {content} differ",
            file=file,
            remedy="Delete it or choose another output folder",
        )


@dataclass(frozen=True)
class JsonStore:
    """One JSON file of results.

    Parameters
    ----------
    file : Path
    key : str
        The SHA-256 of what the results depend on, from `content_key`.
    owner, content : str
        See `refuse_other`.
    disposable : bool
        Whether a file with another key is forgotten rather than refused.
    """

    file: Path
    key: str
    owner: str
    content: str
    disposable: bool = False

    def read(self, name: str) -> Any:
        """Return the results of a name; None where there are none.

        Raises
        ------
        InputError
            If the file cannot be read, or belongs to another key and is not disposable.
        """
        if not self.file.is_file():
            return None
        try:
            content = json.loads(self.file.read_text(encoding="utf-8"))
            found, results = content["key"], content[name]
        except (ValueError, KeyError, TypeError) as error:
            raise InputError(
                f"unreadable state of an interrupted {self.owner}: {type(error).__name__}: {error}",
                file=self.file,
                remedy="Delete the file or choose another output folder",
            ) from error
        if self.disposable and found != self.key:
            return None
        refuse_other(found, self.key, self.file, self.owner, self.content)
        return results

    def write(self, **results: Any) -> None:
        """Write all results by name."""
        self.file.parent.mkdir(parents=True, exist_ok=True)
        write_json(self.file, {"key": self.key, **results})
