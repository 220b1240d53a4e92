"""Files of results: written to a temporary folder and moved when complete, so that nothing is left half-written."""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from bayesid._io.errors import InputError

__all__ = ["complete_folder", "write_json"]


def write_json(file: Path, content: dict[str, Any]) -> None:
    """Write JSON, arrays as lists."""
    file.write_text(json.dumps(content, indent=1, default=lambda value: np.asarray(value).tolist()), encoding="utf-8")


@contextmanager
def complete_folder(output: Path) -> Iterator[Path]:
    """Yield a folder whose files appear in the output together, or not at all."""
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"cannot create the folder: {error.strerror}", file=output, remedy="Choose another output"
        ) from None
    with tempfile.TemporaryDirectory(dir=output, prefix=".part-") as name:
        yield Path(name)
        for item in sorted(Path(name).iterdir()):
            shutil.move(str(item), output / item.name)
