"""Simulation of a study's sensors at the given values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bayesid._io.short_form import ShortForm, Summary
from bayesid._io.words import counted
from bayesid.app.functions.study_source import StudySource, study_of
from bayesid.app.study_to_linearisation import lacking_sensors, planned_manoeuvres
from bayesid.app.study_to_model import load_manoeuvres, load_model
from bayesid.inference.posterior import Posterior
from bayesid.inference.predicted_readings import integration_error_at, simulate_recordings
from bayesid.inference.wrong_units import refuse_wrong_units
from bayesid.recording.recording import Recording

__all__ = ["Simulation", "simulate"]


@dataclass(frozen=True, repr=False)
class Simulation(ShortForm):
    """Result of `simulate`.

    Attributes
    ----------
    posterior : Posterior
        Model and manoeuvres that were simulated.
    recordings : tuple of Recording
        Readings of the sensors with the joints' motion.
    planned : bool
        Whether the joint motion is planned, and not recorded with readings of all sensors.
    noise : bool
        Whether the sensors' noise was added.
    integration_error : float
        Largest error of any sample caused by the integration step, in standard deviations of the sample.
    """

    posterior: Posterior
    recordings: tuple[Recording, ...]
    planned: bool
    noise: bool
    integration_error: float

    def to_dict(self) -> dict[str, Any]:
        """Return the content of simulation.json."""
        mounted = [sensor.kind.value for sensor in self.posterior.model.sensors if sensor.kind.mounted]
        return {
            "recordings": [
                {
                    "file": f"{recording.name}.csv",
                    "largest": {
                        kind: [float(np.nanmax(np.abs(recording.channels[f"{kind}.{axis}"]))) for axis in "xyz"]
                        for kind in mounted
                    },
                }
                for recording in self.recordings
            ],
            "noise": self.noise,
            "integration": {"step": self.posterior.step, "error_in_sigma": self.integration_error},
        }

    def summary(self) -> Summary:
        """Return the simulated manoeuvres and the accuracy of the simulation."""
        step, error = self.posterior.step, self.integration_error
        simulated = counted(len(self.recordings), "recording")
        said = f"Simulated {simulated}; integration step {step:g} s, error {error:.2g} sigma."
        return Summary([said])


def simulate(study: StudySource | Posterior, seed: int = 0, *, noise: bool = True) -> Simulation:
    """Simulate the sensor readings at the stated parameter values.

    Parameters
    ----------
    study : path, Study or Posterior
        Its recordings may contain planned joint motion only.
    seed : int
        Seed of the noise.
    noise : bool
        Whether the declared noise of the sensors is added.

    Raises
    ------
    InputError
        If the study is invalid, or values cannot be in the units of the format.
    """
    if isinstance(study, Posterior):
        posterior, planned = study, False
    else:
        study = study_of(study)
        model = load_model(study)
        manoeuvres = load_manoeuvres(study, model.robot)
        planned = bool(lacking_sensors(model, manoeuvres))
        if planned:
            manoeuvres, _ = planned_manoeuvres(study, model, manoeuvres)
        posterior = Posterior.of(model, manoeuvres)
        if not planned:
            refuse_wrong_units(posterior)
    recordings = simulate_recordings(posterior, np.random.default_rng(seed) if noise else None)
    error = integration_error_at(posterior, posterior.starting_point())
    return Simulation(posterior, tuple(recordings), planned, noise, error)
