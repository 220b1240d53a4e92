"""Effects that are events: each in one recording, or alike in all, at an instant, with amplitudes of its own."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import ClassVar, NamedTuple, Self

import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._io.errors import InputError
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import Parameter

__all__ = ["EVERY", "Event", "Events"]

EVERY = -1
"""Recording of an event that recurs in every recording, at the same instant and with the same amplitudes."""

ALL = "all"
"""How that is written."""


class Event(NamedTuple):
    """One event.

    Attributes
    ----------
    recording : int
        Number of the recording, from zero, or `EVERY`.
    time : float
        Instant in it [s].
    shape : tuple of float
        Further constants of the effect, such as the time in which it decays [s].
    """

    recording: int
    time: float
    shape: tuple[float, ...] = ()


class Events(Effect):
    """Effect that is a few events, whose recordings, instants and shapes are constants: nothing is smooth in them.

    Parameters
    ----------
    place : str
        Events as ``RECORDING@TIME``, with recordings from 1, or ``all@TIME`` where it recurs in every recording, then
        the shape after slashes, and commas between events. Without any there is one at 3 s in the first recording.
    """

    cause_kind = "event"
    constant_names = ("recordings", "times", "shapes", "shares")
    amplitude: Sequence[tuple[str, str, float]] = ()
    """Name, unit and prior standard deviation of each amplitude of one event."""
    trial_shapes: ClassVar[Sequence[tuple[float, ...]]] = ((),)
    """Shapes that a diagnosis tries, equally probable beforehand."""
    most_in_recording: ClassVar[int] = 1
    """Most events that a diagnosis seeks in one recording."""

    def __init__(self, place: str = "") -> None:
        self.stated, self.only = bool(place), EVERY
        self._take(tuple(map(self._parsed, place.split(","))) if place else (Event(0, 3.0, self.trial_shapes[0]),), ())

    def _parsed(self, text: str) -> Event:
        recording, _, rest = text.partition("@")
        try:
            time, *shape = map(float, rest.split("/"))
            number = 0 if recording == ALL else int(recording)
            known = (number > 0 or recording == ALL) and len(shape) in (0, len(self.trial_shapes[0]))
        except ValueError:
            known = False
        if not known:
            remedy = f"Write RECORDING@TIME, such as {self.name}:1@12.5,2@30, or {self.name}:all@12.5"
            raise InputError(f"{self.name}: {text!r} is not an event", remedy=remedy)
        return Event(number - 1, time, tuple(shape) or self.trial_shapes[0])

    def _take(self, events: Sequence[Event], names: Sequence[str], one: bool = False) -> None:
        self.recordings = np.array([event.recording for event in events], dtype=float)
        self.times = np.array([event.time for event in events])
        self.shapes = np.array([event.shape for event in events], dtype=float).reshape(len(events), -1)
        keys = [""] if one else self._keys(events, names)
        self.shares = np.ones((len(events), 1)) if one else np.eye(len(events))
        self.parameters = tuple(
            Parameter(key + name, unit, sigma) for key in keys for name, unit, sigma in self.amplitude
        )

    @staticmethod
    def _keys(events: Sequence[Event], names: Sequence[str]) -> list[str]:
        """Return what stands before the names of each event's amplitudes: its recording, and its number in that."""
        keys: list[str] = []
        for place, event in enumerate(events):
            name = ALL if event.recording == EVERY else names[event.recording] if names else str(event.recording + 1)
            earlier = sum(other.recording == event.recording for other in events[:place])
            keys.append(f"{name}.{earlier + 1}." if earlier else f"{name}.")
        return keys if len(events) > 1 or names else [""]

    def with_events(self, events: Sequence[Event], names: Sequence[str] = (), *, one: bool = False) -> Self:
        """Return the effect with other events.

        Parameters
        ----------
        events : sequence of Event
        names : sequence of str
            Names of the recordings, for those of the amplitudes; by default their numbers.
        one : bool
            Whether all events have the same amplitudes.
        """
        changed = copy.copy(self)
        changed.stated = True
        changed._take(events, names, one)
        return changed

    @property
    def events(self) -> tuple[Event, ...]:
        """The events."""
        rows = zip(self.recordings.tolist(), self.times.tolist(), self.shapes.tolist(), strict=True)
        return tuple(Event(int(recording), time, tuple(shape)) for recording, time, shape in rows)

    @property
    def keys(self) -> list[str]:
        """What stands before the names of the amplitudes of each event."""
        count = len(self.amplitude)
        return [p.name.removesuffix(self.amplitude[0][0]) for p in self.parameters[::count]]

    @property
    def label(self) -> str:
        """Name of the effect, followed by its events where they are given."""
        if not self.stated:
            return self.name
        texts = (
            "/".join([f"{event.recording + 1 or ALL}@{event.time:.6g}", *(f"{value:.5g}" for value in event.shape)])
            for event in self.events
        )
        return f"{self.name}:{','.join(texts)}"

    @property
    def candidate(self) -> str:
        """Name without events, which the data give."""
        return self.name

    def in_recording(self, index: int) -> Self:
        """Return the effect with the `jumps` of one recording."""
        changed = copy.copy(self)
        changed.only = index
        return changed

    def jumps(self, end: float) -> Sequence[float]:
        """Return the instants within a recording, of all events or of those of the one that was chosen."""
        mine = [event for event in self.events if event.recording == self.only or EVERY in (event.recording, self.only)]
        return tuple(event.time for event in mine if 0.0 <= event.time < end)

    def each(self, values: Array) -> Array:
        """Return the amplitudes of each event, shape (E, k), of values of the parameters."""
        return jnp.asarray(self.shares) @ values.reshape(-1, len(self.amplitude))

    def begun(self, time: Array, recording: Array) -> Array:
        """Return 1 for each event that has happened, else 0.

        Parameters
        ----------
        time : (...) array
            Instants in a recording [s].
        recording : () array
            Its number, from zero.

        Returns
        -------
        (..., E) array
        """
        recordings = jnp.asarray(self.recordings)
        here = (recordings == recording) | (recordings == EVERY)
        return jnp.where(here & (jnp.asarray(time)[..., None] > jnp.asarray(self.times)), 1.0, 0.0)
