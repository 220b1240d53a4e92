"""Results kept in files under a key, so that an interrupted run continues from them.

The key is the SHA-256 of everything on which the results depend. A file with another key is never used. The file of a
disposable store is then replaced; any other is refused, so that no result of a long run or a flight is overwritten.
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
    """Return the SHA-256 of files by their content, of arrays by their values and of other objects by their `repr`."""
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
    """Return the SHA-256 of the bytes of a file."""
    return hashlib.sha256(file.read_bytes()).hexdigest()


def refuse_other(stated: object, key: str, file: Path, owner: str, content: str) -> None:
    """Refuse a file with another key.

    Parameters
    ----------
    stated : object
        Key that the file states.
    key : str
        Key that the file should state.
    file : Path
        File with the key.
    owner : str
        Kind of computation that the file belongs to, such as "loop", for the message.
    content : str
        Description of what the key is made of, for the message.

    Raises
    ------
    InputError
        If the two keys differ.
    """
    if stated != key:
        problem = f"it belongs to another {owner}: {content} differ"
        raise InputError(problem, file=file, remedy="Delete it or choose another output folder")


@dataclass(frozen=True)
class JsonStore:
    """JSON file of results under a key.

    Parameters
    ----------
    file : Path
        File of the results.
    key : str
        SHA-256 of everything on which the results depend, from `content_key`.
    owner, content : str
        Parameters of `refuse_other`.
    disposable : bool
        True if a file with another key is replaced instead of refused.
    """

    file: Path
    key: str
    owner: str
    content: str
    disposable: bool = False

    def read(self, name: str) -> Any:
        """Return the results under a name, None where there are none.

        Raises
        ------
        InputError
            If the file cannot be read, or belongs to another key and is not disposable.
        """
        if not self.file.is_file():
            return None
        try:
            content = json.loads(self.file.read_text(encoding="utf-8"))
            stated, results = content["key"], content[name]
        except (ValueError, KeyError, TypeError) as error:
            raise InputError(
                f"unreadable state of an interrupted {self.owner}: {type(error).__name__}: {error}",
                file=self.file,
                remedy="Delete the file or choose another output folder",
            ) from error
        if self.disposable and stated != self.key:
            return None
        refuse_other(stated, self.key, self.file, self.owner, self.content)
        return results

    def write(self, **results: Any) -> None:
        """Write all results by their names, in place of earlier ones."""
        self.file.parent.mkdir(parents=True, exist_ok=True)
        write_json(self.file, {"key": self.key, **results})
