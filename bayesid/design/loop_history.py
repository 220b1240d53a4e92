"""History of a loop, kept in its folder so that it survives an interruption at any point.

A stage counts as done when its entry is in ``loop.json`` and its file is unchanged; the entries after a stage that is
not done are discarded. Recordings stay in the folder even then, because only the spacecraft can make them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bayesid._io.errors import InputError
from bayesid._io.files import create_folder
from bayesid._io.store import JsonStore, file_key

__all__ = ["History"]

# stages of a step, in their order; a loop that is reviewed has the diagnosis as well
STAGES = ("plan", "recording", "identification")
ENDING = {  # ending of the file name, by stage
    "plan": "plan.csv",
    "recording": "recording.csv",
    "identification": "posterior.nc",
    "diagnosis": "diagnosis.json",
}


@dataclass
class History:
    """History of a loop, step by step."""

    folder: Path  #: folder of the loop's files
    key: str  #: SHA-256 of robot, sensors, prior, manoeuvre, limits, search and seed
    #: status ``running``, ``waiting`` (for a recording), ``reached``, ``at-most``, ``no-go`` or ``wrong-model``
    status: str = "running"
    stages: tuple[str, ...] = STAGES  #: names of the stages of each step
    #: entries of the stages, one dictionary per step, and what was noted of it
    steps: list[dict[str, Any]] = field(default_factory=list)

    @classmethod
    def open(cls, folder: Path, key: str, *, reviewed: bool = False) -> History:
        """Read the history of an earlier run from a folder, up to the last existing file.

        Parameters
        ----------
        folder : Path
        key : str
        reviewed : bool
            Whether every step is diagnosed.

        Raises
        ------
        InputError
            If the history belongs to another loop, or a recording or plan was changed after it was used.
        """
        create_folder(folder)
        history = cls(folder, key, stages=(*STAGES, "diagnosis") if reviewed else STAGES)
        history._take(history._store.read("steps") or [])
        return history

    def path(self, number: int, stage: str) -> Path:
        """Return the path of the file of a stage.

        Parameters
        ----------
        number : int
            Number of the step, from 1.
        stage : str
            Name of the stage, one of `stages`.
        """
        return self.folder / f"step-{number}-{ENDING[stage]}"

    def entry(self, number: int, stage: str) -> dict[str, Any] | None:
        """Return the entry of a stage, None if the stage is not done.

        Parameters
        ----------
        number : int
            Number of the step, from 1.
        stage : str
            Name of the stage, one of `stages`.
        """
        return self.steps[number - 1].get(stage) if number <= len(self.steps) else None

    def record(self, number: int, stage: str, entry: dict[str, Any]) -> None:
        """Record that a stage is done, with its entry; its file must be complete.

        Parameters
        ----------
        number : int
            Number of the step, from 1.
        stage : str
            Name of the stage, one of `stages`.
        entry : dict
            Entry of the stage.
        """
        if number > len(self.steps):
            self.steps.append({"step": number})
        self.steps[number - 1][stage] = {**entry, **self._mark(number, stage)}
        self.write()

    def note(self, number: int, name: str, content: Any) -> None:
        """Note something that follows from the stages of a step, and is recomputed whenever the loop is run.

        Parameters
        ----------
        number : int
            Number of the step, from 1.
        name : str
            Key of the note in the step's entry.
        content
            What is noted, as JSON writes it.
        """
        self.steps[number - 1][name] = content
        self.write()

    def close(self, status: str) -> None:
        """Record the status with which the loop ends."""
        self.status = status
        self.write()

    def write(self) -> None:
        """Write ``loop.json``, whole or not at all."""
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
            for stage in self.stages:
                if stage not in step or not self.path(number, stage).is_file():
                    break
                if self._mark(number, stage)["sha256"] != step[stage]["sha256"]:
                    if stage in ("identification", "diagnosis"):
                        break
                    raise InputError(
                        f"the {stage} of step {number} was changed after it was used",
                        file=self.path(number, stage),
                        remedy="Restore it, or start again in another folder",
                    )
                kept[stage] = step[stage]
            if len(kept) > 1:
                self.steps.append(kept)
            if len(kept) <= len(self.stages):
                return
