"""Prediction of where planned joint motions take base and end-effector."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bayesid._io.progress import Progress, silent
from bayesid._io.short_form import ShortForm, Summary
from bayesid.app.functions.study_source import StudySource, study_of
from bayesid.app.study_to_model import load_manoeuvres, load_model
from bayesid.design.base_prediction import BasePredictor, Prediction
from bayesid.inference.posterior import Posterior
from bayesid.recording.plausibility import refuse_impossible_motion
from bayesid.report.numbers import format_quantity
from bayesid.simulation.model import Manoeuvre, Model

__all__ = ["Predictions", "predict"]


@dataclass(frozen=True, repr=False)
class Predictions(ShortForm):
    """Result of `predict`.

    Attributes
    ----------
    posterior : Posterior
        Model of the first prediction, whose prior is propagated.
    manoeuvres : tuple of Manoeuvre
        Planned manoeuvres.
    recordings : tuple of Prediction
        Prediction of each of them.
    """

    posterior: Posterior
    manoeuvres: tuple[Manoeuvre, ...]
    recordings: tuple[Prediction, ...]

    def summary(self) -> Summary:
        """Return the final position of the end-effector, one sentence per recording."""
        lines = []
        for prediction in self.recordings:
            final = prediction.tip.pose().millimetres
            place = ", ".join(format_quantity(float(m), float(s)) for m, s in zip(final.mean, final.sd, strict=True))
            frame = prediction.tip_frame
            lines.append(f"{prediction.name}: {frame} ends at ({place}) mm from the initial position of the base.")
        return Summary(lines)

    def to_dict(self) -> dict[str, Any]:
        """Return the content of prediction.json."""
        return {"recordings": [prediction.to_dict() for prediction in self.recordings]}


def predict(
    study: StudySource | Model,
    manoeuvres: Sequence[Manoeuvre] | None = None,
    seed: int = 0,
    *,
    draws: int = 500,
    posterior: Path | None = None,
    tip_frame: str | None = None,
    progress: Progress = silent,
) -> Predictions:
    """Predict the motion of base and end-effector for planned joint motions.

    Parameters
    ----------
    study : path, Study or Model
        Path of a study file, the study that was read from it, or its model.
    manoeuvres : sequence of Manoeuvre, optional
        Planned manoeuvres of a model; a study names its recordings.
    seed : int
        Seed of all random numbers.
    draws : int
        Number of draws of the robot's parameters.
    posterior : path, optional
        ``posterior.nc`` of an earlier study, which replaces the study's prior.
    tip_frame : str, optional
        Frame of the end-effector, by default that of the study's section ``[design]`` or the last link.
    progress : Progress, optional
        Receiver of the fraction done.

    Raises
    ------
    InputError
        If the study is invalid, or a motion exceeds the limits of the joints.
    """
    if isinstance(study, Model):
        model, planned = study, list(manoeuvres or ())
    else:
        study = study_of(study)
        study = study if posterior is None else study.with_posterior(Path(posterior))
        model = load_model(study)
        planned = load_manoeuvres(study, model.robot)
        tip_frame = tip_frame or (None if study.design is None else study.design.tip_frame)
    for manoeuvre in planned:
        refuse_impossible_motion(manoeuvre.recording, model.robot)
    streams, predictors, predictions = np.random.SeedSequence(seed).spawn(len(planned)), [], []
    for index, (manoeuvre, stream) in enumerate(zip(planned, streams, strict=True)):
        progress(index / len(planned), f"predicting {manoeuvre.recording.name}")
        predictors.append(BasePredictor(model, manoeuvre, tip_frame))
        predictions.append(predictors[-1].predict(draws, np.random.default_rng(stream)))
    return Predictions(predictors[0].posterior, tuple(planned), tuple(predictions))
