"""Layout of the residual: the columns of each sensor and of each joint torque."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bayesid.simulation.sensors import SensorKind

__all__ = ["Channels"]


@dataclass(frozen=True)
class Channels:
    """Columns of the residual: the components of each sensor, one sensor after the other, then the joint torques.

    Parameters
    ----------
    kinds : tuple of SensorKind
        Kinds of the sensors.
    joints : tuple of str
        Names of the joints whose torque is measured.
    """

    kinds: tuple[SensorKind, ...]
    joints: tuple[str, ...] = ()

    def of(self, kind: SensorKind) -> slice:
        """Return the columns of one kind of sensor."""
        first = 0
        for other in self.kinds:
            if other == kind:
                return slice(first, first + other.size)
            first += other.size
        raise KeyError(kind)

    @property
    def torques(self) -> slice:
        """Columns of the joint torques."""
        first = sum(kind.size for kind in self.kinds)
        return slice(first, first + len(self.joints))

    @property
    def count(self) -> int:
        """Number of columns."""
        return self.torques.stop

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all columns, as in recordings."""
        sensors = [name for kind in self.kinds for name in kind.components]
        return (*sensors, *(f"torque.{joint}" for joint in self.joints))

    @property
    def units(self) -> tuple[str, ...]:
        """Units of all columns."""
        sensors = [kind.unit for kind in self.kinds for _ in range(kind.size)]
        return (*sensors, *("N m or N" for _ in self.joints))

    def groups(self) -> Sequence[tuple[str, slice]]:
        """Return the name and columns of every sensor, with all joint torques as one group."""
        groups = [(kind.value, self.of(kind)) for kind in self.kinds]
        return [*groups, ("torque", self.torques)] if self.joints else groups
