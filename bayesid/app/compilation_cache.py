"""Cache of compiled functions between runs, so that a second command on a similar study starts at once."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

__all__ = ["keep_compiled"]

# options of JAX that keep every function, as reading even a small one takes less time than compiling it
SETTINGS = {"jax_persistent_cache_min_compile_time_secs": 0.0, "jax_persistent_cache_min_entry_size_bytes": -1}
FOLDER = "jax_compilation_cache_dir"  # name of the option of JAX for the folder
KEPT_FOR = 30.0 * 86400.0  # time after which what nobody read is removed, such as that of another version [s]
PATTERNS = ("*.executable", "*-cache", "*-atime")  # names of the files that this package and JAX keep


def keep_compiled(folder: Path | None = None) -> None:
    """Keep compiled functions in a folder, by default the one in ``BAYESID_CACHE`` or else the user's cache.

    An empty ``BAYESID_CACHE`` switches the cache off, and a folder that JAX uses already stays. What has not been used
    for `KEPT_FOR` is removed. JAX need not be imported.
    """
    named = os.environ.get("BAYESID_CACHE")
    if folder is None and (named == "" or (named is None and _given())):
        return
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    chosen = folder or (Path(named) if named else home / "bayesid")
    try:
        chosen.mkdir(parents=True, exist_ok=True)
    except OSError:  # with a read-only home there is no cache, which only costs time
        return
    _remove_old(chosen)
    for option, value in {FOLDER: str(chosen), **SETTINGS}.items():
        if "jax" in sys.modules:
            sys.modules["jax"].config.update(option, value)
        else:
            os.environ[option.upper()] = str(value)


def _remove_old(folder: Path) -> None:
    """Remove the files of the cache that nobody has used for a long time."""
    latest = time.time() - KEPT_FOR
    for pattern in PATTERNS:
        for file in folder.glob(pattern):
            try:
                if file.stat().st_mtime < latest:
                    file.unlink(missing_ok=True)
            except OSError:  # another process was faster, or the folder is read-only
                continue


def _given() -> object:
    """Return the folder that JAX uses already, if any."""
    if "jax" in sys.modules:
        return getattr(sys.modules["jax"].config, FOLDER)
    return os.environ.get(FOLDER.upper())
