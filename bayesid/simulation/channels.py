"""Layout of the residual: which of its columns belong to which sensor and which joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bayesid.simulation.sensors import Kind

__all__ = ["Channels"]


@dataclass(frozen=True)
class Channels:
    """Columns of the residual: the components of every sensor one after the other, then the torques of joints.

    Parameters
    ----------
    kinds : tuple of Kind
    joints : tuple of str
        Joints whose torque is measured.
    """

    kinds: tuple[Kind, ...]
    joints: tuple[str, ...] = ()

    def of(self, kind: Kind) -> slice:
        """Return the columns of one kind of sensor."""
        first = 0
        for other in self.kinds:
            if other == kind:
                return slice(first, first + other.size)
            first += other.size
        raise KeyError(kind)

    @property
    def torques(self) -> slice:
        """Columns of the joints' torques."""
        first = sum(kind.size for kind in self.kinds)
        return slice(first, first + len(self.joints))

    @property
    def count(self) -> int:
        """Number of columns."""
        return self.torques.stop

    @property
    def names(self) -> tuple[str, ...]:
        """One name per column, as recorded."""
        sensors = [name for kind in self.kinds for name in kind.components]
        return (*sensors, *(f"torque.{joint}" for joint in self.joints))

    @property
    def units(self) -> tuple[str, ...]:
        """One unit per column."""
        sensors = [kind.unit for kind in self.kinds for _ in range(kind.size)]
        return (*sensors, *("N m or N" for _ in self.joints))

    def groups(self) -> Sequence[tuple[str, slice]]:
        """Return the name and columns of every sensor, joint torques as one."""
        groups = [(kind.value, self.of(kind)) for kind in self.kinds]
        return [*groups, ("torque", self.torques)] if self.joints else groups
