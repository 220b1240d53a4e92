"""Channels whose stamps are off by a sample or more: late, as by a buffer, or early, as of joints that are commanded.

What lasts less than a sample is no convention: the catalogue has delays as effects. Such members compete all the same,
so that a delay is not rounded up to a sample.
"""

from __future__ import annotations

from collections.abc import Iterator

from bayesid.inference.conventions.mistake import Mistake, MistakeFamily
from bayesid.inference.conventions.readings_on_grid import ReadingsOnGrid
from bayesid.simulation.model import Model
from bayesid.simulation.sensors import SensorKind

__all__ = ["ShiftedChannels"]

SHIFTS = (1.0, 2.0, 4.0, 8.0, 16.0)  # numbers of samples, between which the search refines
WHOLE = 0.3  # largest part of a sample by which a shift may miss a whole number of them
LEAST = 0.75  # number of samples below which a delay is an effect
PARTS = {"rate": ("rate", "turning"), "accel": ("accel",), "attitude": ("attitude", "turning", "start")}


@MistakeFamily.register
class ShiftedChannels(MistakeFamily):
    """A sensor of the base, all joints together, or one of them."""

    title = "shifts of channels"

    def members(self, model: Model, readings: ReadingsOnGrid) -> Iterator[Mistake]:
        """Yield both directions of each channel."""
        sections = {kind.value: kind.section for kind in (*readings.sensors, SensorKind.ATTITUDE)}
        sections |= {"position": "sensors.encoder"}
        if len(readings.names) > 1:
            sections |= {f"position.{name}": f'joints."{name}"' for name in readings.names}
        intervals = {name: step for name, step in readings.source.intervals.items() if name in sections}
        for channel, interval in intervals.items():
            for samples in SHIFTS:
                for sign in (1.0, -1.0):
                    share = 0.5 / len(SHIFTS) / len(intervals)
                    yield _shifted(channel, sections[channel], sign * samples, interval, share)


def _shifted(channel: str, section: str, samples: float, interval: float, share: float) -> Mistake:
    whole = round(samples) if abs(samples - round(samples)) <= WHOLE else samples
    latency = whole * interval
    name = channel.removeprefix("position.")

    def nearby(level: int) -> tuple[Mistake, ...]:
        step = 0.25 * abs(samples) * 0.5**level
        return tuple(_shifted(channel, section, samples + sign * step, interval, share) for sign in (1.0, -1.0))

    def remedy(readings: ReadingsOnGrid) -> str:
        after = readings.recorded_as.later(channel, latency)
        stated = after.joint(name).latency if name in readings.names else after.sensor(name).latency
        return f"[{section}]\nlatency = {stated:.9g}"

    def text(readings: ReadingsOnGrid) -> str:
        what = {"position": "The joints are", name: f"Joint {name} is"} if name in ("position", *readings.names) else {}
        late = f"{abs(latency):.4g} s ({abs(whole):.3g} samples) {'late' if latency > 0.0 else 'early'}"
        commanded = ", like commanded rather than measured values" if what and latency < 0.0 else ""
        return f"{what.get(name, f'The readings of {name} are')} stamped {late}{commanded}."

    return Mistake(
        f"convention:shift:{name}",
        name,
        f"shift:{channel.partition('.')[0]}",
        -1,
        lambda readings: readings.stamped(channel, samples * interval),
        remedy,
        text,
        share,
        PARTS.get(channel, ()),
        nearby,
        value=2.0 * samples,  # half a sample apart are the same
        effect=abs(samples) < LEAST,
    )
