"""What a loop has done so far, kept in its folder so that it survives an interruption at any point.

A stage counts as done when its entry is in ``loop.json`` and its file is unchanged; whatever follows a stage that is
not done is forgotten. All else the folder holds are recordings, which nobody but the spacecraft can make.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bayesid._io.errors import InputError
from bayesid._io.files import create_folder
from bayesid._io.store import JsonStore, file_key

__all__ = ["History"]

STAGES = ("plan", "recording", "identification")


@dataclass
class History:
    """The steps of a loop.

    Attributes
    ----------
    folder : Path
    key : str
        The SHA-256 of robot, sensors, prior, manoeuvre, limits, search and seed.
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
        create_folder(folder)
        history = cls(folder, key)
        history._take(history._store.read("steps") or [])
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
        self._store.write(status=self.status, steps=self.steps)

    @property
    def _store(self) -> JsonStore:
        content = "robot, sensors, prior, manoeuvre, limits, search or seed"
        return JsonStore(self.folder / "loop.json", self.key, "loop", content)

    def _mark(self, number: int, stage: str) -> dict[str, str]:
        file = self.path(number, stage)
        return {"file": file.name, "sha256": file_key(file)}

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
