"""The way of this package: the recordings are diagnosed, and the model with the causes found is sampled."""

from pathlib import Path

import numpy as np

import bayesid
from bayesid.diagnosis import diagnose


def identify(folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return the ten quantities of the base and their standard deviations."""
    study = bayesid.Study.load(folder / "study.toml")
    model = bayesid.load_model(study)
    diagnosis = diagnose(model, bayesid.load_manoeuvres(study, model.robot), seed=0)
    base = bayesid.identify(diagnosis.posterior, seed=0, start=diagnosis.start).bodies["base_link"]
    return base.mean, base.sd
