"""Command line of the pictures."""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

from studies.manual.pictures.store import make

parser = argparse.ArgumentParser(prog="python -m studies.manual.pictures", description="Make the manual's pictures.")
parser.add_argument("--work", type=Path, help="folder for the results; commands whose output is there are not repeated")
given = parser.parse_args()
if given.work is not None:
    given.work.mkdir(parents=True, exist_ok=True)
    make(given.work)
else:
    with tempfile.TemporaryDirectory() as folder:
        make(Path(folder))
