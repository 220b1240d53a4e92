"""What a loop has done so far, kept in its folder so that it survives an interruption at any point.

A stage counts as done when its entry is in ``loop.json`` and its file is unchanged; whatever follows a stage that is
not done is forgotten. All else the folder holds are recordings, which nobody but the spacecraft can make.
"""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bayesid._io.errors import InputError

__all__ = ["History"]

STAGES = ("plan", "recording", "identification")


@dataclass
class History:
    """The steps of a loop.

    Attributes
    ----------
    folder : Path
    key : str
        Identifies robot, sensors, prior, limits and seed.
    status : str
        ``running``, ``waiting`` (for a recording), ``reached``, ``at-most`` or ``no-go``.
    steps : list of dict
        Per step what is known of its ``plan``, ``recording`` and ``identification``.
    """

    folder: Path
    key: str
    status: str = "running"
    steps: list[dict[str, Any]] = field(default_factory=list)

    @classmethod
    def open(cls, folder: Path, key: str) -> History:
        """Read what an earlier call left in a folder, as far as its files are there.

        Raises
        ------
        InputError
            If it belongs to another loop, or a recording or plan was changed after it was used.
        """
        folder.mkdir(parents=True, exist_ok=True)
        file = folder / "loop.json"
        if not file.is_file():
            return cls(folder, key)
        try:
            content = json.loads(file.read_text(encoding="utf-8"))
            found, steps = content["key"], content["steps"]
        except (ValueError, KeyError, TypeError) as error:
            raise InputError(f"unreadable: {error}", file=file, remedy="Delete it or choose another folder") from error
        if found != key:
            raise InputError(
                "it belongs to another loop: robot, sensors, prior, limits, search or seed differ",
                file=file,
                remedy="Choose another output folder",
            )
        history = cls(folder, key)
        history._take(steps)
        return history

    def path(self, number: int, stage: str) -> Path:
        """Return the file of a stage of a step; steps count from 1."""
        return self.folder / f"step-{number}-{_ENDING[stage]}"

    def entry(self, number: int, stage: str) -> dict[str, Any] | None:
        """Return what is known of a stage; None if it is not done."""
        return self.steps[number - 1].get(stage) if number <= len(self.steps) else None

    def record(self, number: int, stage: str, entry: dict[str, Any]) -> None:
        """Remember that a stage is done, its file being complete."""
        if number > len(self.steps):
            self.steps.append({"step": number})
        self.steps[number - 1][stage] = {**entry, **self._mark(number, stage)}
        self.write()

    def close(self, status: str) -> None:
        """Remember how the loop stands."""
        self.status = status
        self.write()

    def write(self) -> None:
        """Write ``loop.json``, all or nothing."""
        content = {"key": self.key, "status": self.status, "steps": self.steps}
        part = self.folder / ".loop.json.part"
        part.write_text(json.dumps(content, indent=1), encoding="utf-8")
        os.replace(part, self.folder / "loop.json")

    def _mark(self, number: int, stage: str) -> dict[str, str]:
        file = self.path(number, stage)
        return {"file": file.name, "sha256": hashlib.sha256(file.read_bytes()).hexdigest()}

    def _take(self, steps: list[dict[str, Any]]) -> None:
        """Keep the entries of stages that are done."""
        for number, step in enumerate(steps, start=1):
            kept: dict[str, Any] = {"step": number}
            for stage in STAGES:
                if stage not in step or not self.path(number, stage).is_file():
                    break
                if self._mark(number, stage)["sha256"] != step[stage]["sha256"]:
                    if stage == "identification":
                        break
                    raise InputError(
                        f"the {stage} of step {number} was changed after it was used",
                        file=self.path(number, stage),
                        remedy="Put it back, or start again in another folder",
                    )
                kept[stage] = step[stage]
            if len(kept) > 1:
                self.steps.append(kept)
            if len(kept) <= len(STAGES):
                return


_ENDING = {"plan": "plan.csv", "recording": "recording.csv", "identification": "posterior.nc"}
