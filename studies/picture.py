"""The picture of the README: the demonstration's first recording, measured and simulated.

``python -m studies.picture`` writes ``reports/demo.png``.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from bayesid import Study, load_posterior
from bayesid.app.demonstration import write_demo
from bayesid.inference import maximise
from bayesid.inference.sensor_fit import sensor_fits
from bayesid.report import figures


def run(output: Path, *, seed: int = 0) -> None:
    """Identify the demonstration's base and draw its first recording."""
    with tempfile.TemporaryDirectory() as folder:
        write_demo(Path(folder), seed)
        posterior, optimum = maximise(
            load_posterior(Study.load(Path(folder) / "study.toml")), np.random.default_rng(seed)
        )
        figures.measured_against_simulated(sensor_fits(posterior, optimum.z)[0]).savefig(output, dpi=110)


if __name__ == "__main__":
    run(Path("reports/demo.png"))
