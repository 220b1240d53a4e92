"""Memory that the arrays of recordings will need, estimated before any of them is made."""

from __future__ import annotations

from collections.abc import Sequence

from bayesid._math.memory import refuse_beyond_memory
from bayesid.inference.data import RecordedSamples
from bayesid.inference.whitening import WINDOWS
from bayesid.robot.composite_tables import WIDTH
from bayesid.robot.inertial_parameters import PARAMETERS
from bayesid.simulation.model import Model

__all__ = ["FEWER", "posterior_memory", "refuse_large_recordings"]

NUMBER = 8.0
"""Size of a number [bytes]."""

USUAL_WINDOW = 5
"""Blocks that enter a whitened sample where the encoders' noise matters; more are rare."""

COPIES = 3.0
"""Copies of the tables that exist at once: by recording, stacked, and on the device; beside them those of the step that
is tried."""

FEWER = "Use fewer or shorter recordings, reduce blocks_per_second, or use a machine with more free memory"
"""What helps where memory is lacking."""


def posterior_memory(model: Model, recorded: Sequence[RecordedSamples]) -> float:
    """Return the memory that a posterior of some recordings needs while it is made [bytes].

    Parameters
    ----------
    model : Model
    recorded : (R,) sequence of RecordedSamples
    """
    samples, channels = max(len(recording.time) for recording in recorded), model.channels.count
    nodes = max(len(recording.nodes) for recording in recorded)
    tables = WIDTH * (1.0 + PARAMETERS * len(model.priors))
    whitening = channels * channels * (USUAL_WINDOW + max(WINDOWS) / len(recorded))  # lags of one recording at a time
    return NUMBER * len(recorded) * (nodes * COPIES * tables + samples * whitening)


def refuse_large_recordings(model: Model, recorded: Sequence[RecordedSamples]) -> None:
    """Raise an `InputError` if the posterior of some recordings would need more memory than there is.

    Parameters
    ----------
    model : Model
    recorded : (R,) sequence of RecordedSamples
    """
    count = sum(len(recording.time) for recording in recorded)
    what = f"the likelihood of {count} samples with {len(model.priors)} unknown bodies"
    refuse_beyond_memory(posterior_memory(model, recorded), what, FEWER)
