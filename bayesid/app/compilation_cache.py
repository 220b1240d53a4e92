"""Compiled functions kept between runs, so that a second command on a like study starts at once."""

from __future__ import annotations

import os
from pathlib import Path

import jax

__all__ = ["keep_compiled"]


def keep_compiled(folder: Path | None = None) -> None:
    """Keep compiled functions in a folder; by default the user's cache, or what ``BAYESID_CACHE`` names.

    An empty ``BAYESID_CACHE`` keeps nothing.
    """
    named = os.environ.get("BAYESID_CACHE")
    if folder is None and named == "":
        return
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    chosen = folder or (Path(named) if named else home / "bayesid")
    try:
        chosen.mkdir(parents=True, exist_ok=True)
    except OSError:  # a read-only home costs time, nothing else
        return
    jax.config.update("jax_compilation_cache_dir", str(chosen))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.05)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)
