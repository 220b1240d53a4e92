"""Where a study's report comes from: date, commit, processor, hashes of its inputs, version, seed and command."""

from __future__ import annotations

import argparse
import os
import platform
import subprocess
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from bayesid._io.words import counted
from bayesid.app.report_origin import origin_text

ROOT = Path(__file__).resolve().parents[2]  # folder of the checkout

# options of single studies that say how much is repeated
COUNTS = ("starts", "searches", "repeats", "flights", "ships")

# what a report says that only sets trials anew that were made before
KEPT = "Trials were read from earlier runs, and their times are those of the machines that made them"

MODELS = ROOT / "bayesid" / "robot" / "models"  # folder of the robots that are shipped


def study_origin(name: str, options: argparse.Namespace, inputs: Sequence[Path] = (MODELS / "ets7.urdf",)) -> str:
    """Return one paragraph on where a report comes from.

    Parameters
    ----------
    name : str; name of the study
    options : argparse.Namespace; options of the command as `studies.common.study.Command.parse` gives them
    inputs : sequence of Path; files that the study reads, by default the robot ETS-VII
    """
    seed = getattr(options, "seed", None)
    flags = [f"--{option}" for option, value in vars(options).items() if value is True]
    words = ["python", "-m", f"studies.{name}", *flags]
    words += [] if seed is None else ["--seed", str(seed)]
    counts = {key: getattr(options, key, None) for key in COUNTS}
    for key, count in counts.items():
        if count:
            words += [f"--{key}", *map(str, count if isinstance(count, list) else [count])]
    now = f"{datetime.now(UTC):%Y-%m-%d}, commit {commit()}, {processor()}. "
    if not getattr(options, "made", False):
        return now + origin_text(inputs, words, seed)
    kept = [*inputs, *(file for file in [options.trials] if file not in inputs)]
    return f"{now}{origin_text(kept, words, seed)}. {KEPT}"


def commit() -> str:
    """Return the commit of the code that runs, marked where package or studies differ from it."""
    try:
        revision = _git("rev-parse", "--short=12", "HEAD")
        return f"{revision} with changes" if _git("status", "--porcelain", "--", "bayesid", "studies") else revision
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


def _git(*words: str) -> str:
    return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()


def processor() -> str:
    """Return the name of the processor and the number of its cores that are at hand."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return f"{next(names, platform.processor() or platform.machine())} with {counted(os.cpu_count() or 1, 'core')}"
