"""Study file as a whole."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, PrivateAttr, ValidationError, model_validator

from bayesid._io.errors import InputError
from bayesid.app.schema.design_section import DesignSection
from bayesid.app.schema.sensor_sections import SensorsSection
from bayesid.app.schema.study_sections import (
    DiagnosisSection,
    ModelSection,
    OrbitSection,
    RecordingSection,
    RobotSection,
    UnknownsSection,
    check_extended,
)
from bayesid.app.schema.telemetry_section import JointSection, TelemetrySection
from bayesid.app.schema.validation_messages import explain, syntax_error
from bayesid.app.schema.value_types import Name, Section, array_of_tables


class Study(Section):
    """Content of a study file.

    Parameters
    ----------
    title : str, optional
        Title in reports, by default the stem of the file.
    robot : RobotSection
        Robot and its loads.
    orbit : OrbitSection or None
        Orbit about the Earth; without it, no environment effect applies.
    sensors : SensorsSection
        Sensors and their noise.
    telemetry : TelemetrySection, optional
        Times of the recordings, and use of the samples.
    joints : table of JointSection
        Joints whose recorded values have another sign, zero, unit or column than the robot's file, by name.
    recordings : sequence of RecordingSection
        Recordings; not required by commands that only design.
    unknowns : UnknownsSection
        Bodies to identify and their priors.
    model : ModelSection, optional
        Contents of the simulation.
    design : DesignSection or None
        Manoeuvre to design.
    diagnosis : DiagnosisSection
        Prior of a diagnosis.
    """

    title: str = ""
    robot: RobotSection
    orbit: OrbitSection | None = None
    sensors: SensorsSection
    telemetry: TelemetrySection = TelemetrySection()
    joints: Mapping[Name, JointSection] = {}
    recordings: Annotated[tuple[RecordingSection, ...], BeforeValidator(array_of_tables)] = ()
    unknowns: UnknownsSection
    model: ModelSection = ModelSection()
    design: DesignSection | None = None
    diagnosis: DiagnosisSection = DiagnosisSection()
    # a private attribute, because it is not a key of the file
    _file: Path | None = PrivateAttr(default=None)

    @property
    def defining_files(self) -> list[Path | None]:
        """All files that define the problem, without the recordings; None for those that the study does not name."""
        return [self.file, self.robot.urdf, self.unknowns.posterior, *self.model.plugins]

    @classmethod
    def of(cls, source: Study | str | Path) -> Study:
        """Return a study, which is read if a path is given."""
        if not isinstance(source, (Study, str, Path)):
            remedy = "Give the path of a study file, a bayesid.Study, or an object named in the function's help"
            raise InputError(f"a {type(source).__name__} is not a study", remedy=remedy)
        return source if isinstance(source, Study) else cls.load(source)

    @classmethod
    def load(cls, path: str | Path) -> Study:
        """Read and check a study file; its paths are resolved relative to the file's folder.

        Raises
        ------
        InputError
            If the file is absent, is not TOML, or breaks a rule; the message names the key, the value and the remedy.
        """
        file = Path(path)
        if not file.is_file():
            raise InputError("there is no such file", file=file, remedy="Give the path of a study, a TOML file")
        try:
            data = tomllib.loads(file.read_text(encoding="utf-8-sig"))
        except UnicodeDecodeError as error:
            raise InputError(f"not a text file: {error}", file=file, remedy="Save it as UTF-8 text") from error
        except tomllib.TOMLDecodeError as error:
            raise syntax_error(error, file) from error
        return cls.from_mapping({"title": file.stem} | data, file)

    @classmethod
    def from_mapping(cls, data: Mapping[str, Any], file: Path | None = None) -> Study:
        """Check the parsed content of a study file; without a file its paths stay as they are.

        Parameters
        ----------
        data : mapping of str to object
            Content of the file, as a TOML reader returns it.
        file : Path, optional
            Study file, against whose folder paths are resolved.
        """
        try:
            study = cls.model_validate(data, context={"folder": None if file is None else file.parent})
        except ValidationError as error:
            raise explain(error, data, cls).within(file=file) from error
        study._file = file
        return study

    @property
    def file(self) -> Path | None:
        """File from which the study was loaded, None for a study made from a mapping."""
        return self._file

    def with_posterior(self, posterior: Path) -> Study:
        """Return the study with the posterior of an earlier one as prior, in place of any prior that it states."""
        unknowns = self.unknowns.model_copy(update={"posterior": posterior, "prior": {}})
        return self.model_copy(update={"unknowns": unknowns})

    @model_validator(mode="after")
    def _check_whole(self) -> Study:
        files = [recording.file for recording in self.recordings]
        for index, file in enumerate(files):
            if file in files[:index]:
                remedy = "Remove one: the same data would be counted twice"
                raise InputError(f"'{file.name}' is listed twice", place=f"recordings #{index + 1}.file", remedy=remedy)
            for other in files[:index]:
                if other.stem == file.stem:
                    raise InputError(
                        f"the name '{file.stem}' is shared by two files, '{other}' and '{file}'",
                        place=f"recordings #{index + 1}.file",
                        remedy="Rename one: reports and results identify recordings by name",
                    )
        for index, load in enumerate(self.robot.loads, start=1):
            if (
                self.unknowns.posterior is None
                and load.name in self.unknowns.bodies
                and load.name not in self.unknowns.prior
            ):
                check_extended(load, place=f"robot.loads #{index} ('{load.name}')")
        return self
