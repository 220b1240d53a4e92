"""Size of a diagnosis, estimated from the study before it runs: memory, time, and what cannot fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bayesid._math.memory import GIGABYTE, refuse_beyond_memory
from bayesid.diagnosis.candidates.cause_kind import kind_of
from bayesid.diagnosis.candidates.event_cause import INSTANTS as EVENT_INSTANTS
from bayesid.diagnosis.candidates.event_cause import EventCause
from bayesid.diagnosis.candidates.generic_cause import generic_columns, instants_of_each
from bayesid.diagnosis.candidates.instant_cause import INSTANTS, InstantCause
from bayesid.diagnosis.candidates.linear_cause import group_names
from bayesid.diagnosis.candidates.motion_errors import motion_columns
from bayesid.diagnosis.candidates.shaped_cause import ShapedCause
from bayesid.diagnosis.candidates.vibration_cause import FREQUENCIES, PAIRS, slosh_entries
from bayesid.inference.memory_estimate import FEWER
from bayesid.inference.posterior import Posterior
from bayesid.robot.composite_tables import WIDTH
from bayesid.simulation.effects.effect import Effect

__all__ = ["RunSize"]

NUMBER = 8.0
"""Size of a number [bytes]."""

PROGRAM = 1.2 * GIGABYTE
"""Memory of the program with its compiled code [bytes]."""

BANKS, GRAMS = 1.5, 5.0
"""Sets of columns, and matrices of the size of the Gram, that exist at once: about two fits, and factors of them."""

FEWEST, PER_NUMBER, PER_PRODUCT, PER_ENTRY = 4.0, 2.5e-6, 3e-9, 3e-7
"""Time of the smallest diagnosis, for each number in the columns, for each product of derivatives in the unknowns, and
for each entry of the Gram [s], measured on two cores with 3 recordings of up to 600 s at ten blocks a second, and with
40."""

PROPOSED = 8
"""Shapes of a cause that the data propose, at most."""

TOGETHER = 64
"""Perturbations that are computed at once."""


@dataclass(frozen=True)
class RunSize:
    """Size of a diagnosis.

    Attributes
    ----------
    recordings : int
    rows : int
        Scalars of the residual, those that fill the recordings up to one length among them.
    shared, local : int
        Columns that act in all recordings, and those that act in one.
    unknowns : int
        Unknowns of the model.
    instants : int
        Nodes and samples of all recordings.
    """

    recordings: int
    rows: int
    shared: int
    local: int
    unknowns: int
    instants: int

    @staticmethod
    def of(posterior: Posterior, effects: Sequence[Effect]) -> RunSize:
        """Return the size of a diagnosis.

        Parameters
        ----------
        posterior : Posterior
            Of the present model.
        effects : sequence of Effect
            Candidates.
        """
        recordings = len(posterior.manoeuvres)
        shared, local = {"motion": motion_columns(posterior)}, generic_columns(posterior)
        for effect in effects:
            amplitudes = len(effect.amplitude_quantities)
            if effect.modes_count:
                couplings = slosh_entries().shape[1] if effect.reach_of_swing is not None else len(PAIRS)
                shared[effect.label] = couplings * len(FREQUENCIES)
            elif isinstance(kind_of(effect), InstantCause):
                local += recordings * amplitudes * instants_of_each(INSTANTS, recordings)
            elif isinstance(kind_of(effect), ShapedCause):
                shared[effect.label] = PROPOSED * amplitudes
                if isinstance(kind_of(effect), EventCause):
                    local += recordings * amplitudes * instants_of_each(EVENT_INSTANTS, recordings)
            elif effect.per_recording:
                local += recordings * amplitudes
            else:
                shared["".join(group_names(effect).values())] = amplitudes
        grid = posterior.data.arrays.grid
        instants = grid.node.known.shape[1] + grid.sample.known.shape[1]
        outputs = posterior.residual_shape[1] * posterior.residual_shape[2]
        return RunSize(
            recordings, recordings * outputs, sum(shared.values()), local, posterior.size, recordings * instants
        )

    @property
    def memory(self) -> float:
        """Largest memory of the diagnosis [bytes]."""
        columns = BANKS * (self.shared + self.local / self.recordings) + 4.0 * self.unknowns
        perturbations = 2.0 * TOGETHER * self.instants * (WIDTH + 6)
        return PROGRAM + NUMBER * (self.rows * columns + GRAMS * (self.shared + self.local) ** 2 + perturbations)

    @property
    def seconds(self) -> float:
        """Time of the diagnosis on two cores with compiled code kept, within a factor of two [s]."""
        products = PER_PRODUCT * self.rows * self.unknowns**2
        return FEWEST + PER_NUMBER * self.rows * self.shared + products + PER_ENTRY * (self.shared + self.local) ** 2

    def __str__(self) -> str:
        """Return time and memory in words."""
        return f"about {self.seconds:.0f} s and {self.memory / GIGABYTE:.1f} GB in all"

    def refuse(self) -> None:
        """Raise an `InputError` if the diagnosis cannot fit into the memory that is free."""
        refuse_beyond_memory(self.memory, f"a diagnosis of {self.rows} samples with {self.shared} columns", FEWER)
