"""Bank of signatures: what every candidate would change in the residual, per unit of its amplitudes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from bayesid._math.arrays import Floats
from bayesid.diagnosis.evidence.scales import CandidateCause

__all__ = ["SignatureBank", "Signatures"]


@dataclass(frozen=True)
class Signatures:
    """Columns of one group of amplitudes, or of those of its amplitudes that act in one recording alone.

    Attributes
    ----------
    name : str
        Name of the group in the Gram, which holds all columns of that name, recording after recording.
    columns : (N, k) array
        Derivatives of the whitened residual in the amplitudes: of all recordings, or of one, the others being zero.
    recording : int, optional
        Number of that one recording.
    tone : pair of float, optional
        Frequency [Hz] and damping ratio of a vibration.
    instants : tuple of float, optional
        Instant of a jump in each recording [s], infinite where it does not jump.
    """

    name: str
    columns: Floats
    recording: int | None = None
    tone: tuple[float, float] | None = None
    instants: tuple[float, ...] | None = None


@dataclass(frozen=True)
class SignatureBank:
    """Signatures of all groups of amplitudes, and the candidate causes that they belong to.

    Attributes
    ----------
    signatures : tuple of Signatures
    causes : tuple of CandidateCause
    """

    signatures: tuple[Signatures, ...] = ()
    causes: tuple[CandidateCause, ...] = ()

    @staticmethod
    def joined(banks: Iterable[SignatureBank]) -> SignatureBank:
        """Return several banks as one; groups of one name are the same and kept once."""
        found: dict[str, list[Signatures]] = {}
        causes: list[CandidateCause] = []
        for bank in banks:
            new: dict[str, list[Signatures]] = {}
            for item in bank.signatures:
                new.setdefault(item.name, []).append(item)
            found = new | found
            causes += bank.causes
        return SignatureBank(tuple(item for items in found.values() for item in items), tuple(causes))
