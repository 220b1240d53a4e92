"""JSON Schema of the study file, with which editors complete and check it while it is written.

The classes of the sections say everything once: their fields are the keys, their types the values, and the sections
"Parameters" of their docstrings the descriptions of the keys, with units.
"""

from __future__ import annotations

import inspect
import re
from typing import Any

from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core.core_schema import ModelSchema, NullableSchema

from bayesid.app.schema.study_file import Study
from bayesid.app.schema.value_types import Section

__all__ = ["editor_schema"]

DIALECT = "https://json-schema.org/draft/2020-12/schema"  # version of JSON Schema that pydantic writes


def editor_schema() -> dict[str, Any]:
    """Return the JSON Schema of a study file."""
    from bayesid.design.criteria import known_criteria  # JAX takes seconds to import

    schema = Study.model_json_schema(schema_generator=_FromDocstrings)
    criteria = schema["$defs"]["DesignSection"]["properties"]["criteria"]
    shipped = [name for name, kind in known_criteria().items() if kind.__module__ == known_criteria.__module__]
    criteria["items"] = {"anyOf": [{"enum": shipped}, criteria["items"]]}  # a plugin may register others
    return {"$schema": DIALECT, **schema, "title": "Study of bayesid"}


class _FromDocstrings(GenerateJsonSchema):
    """Schemas whose keys are described by the docstrings of their sections."""

    def model_schema(self, schema: ModelSchema) -> JsonSchemaValue:
        """Return the schema of a section, with descriptions of it and of its keys."""
        made = super().model_schema(schema)
        section: type[Section] = schema["cls"]
        made["description"], described = _documented(section)
        made["properties"] = {key: made["properties"][key] for key in section.key_names()}
        for key, value in made["properties"].items():
            value.pop("title", None)
            if key in described:
                value["description"] = described[key]
        return made

    def nullable_schema(self, schema: NullableSchema) -> JsonSchemaValue:
        """Return the schema of a value that may be left out, since TOML has no null."""
        return self.generate_inner(schema["schema"])

    def default_schema(self, schema: Any) -> JsonSchemaValue:
        """Return the schema of a value with a default, and leave out a default of None or of a whole table."""
        made = super().default_schema(schema)
        if made.get("default") is None or isinstance(made["default"], dict):
            made.pop("default", None)
        return made


def _documented(section: type[Section]) -> tuple[str, dict[str, str]]:
    """Return the description of a section, and those of its keys and of those that it inherits."""
    described: dict[str, str] = {}
    for parent in reversed(section.__mro__):
        if not issubclass(parent, Section):
            continue
        _, _, parameters = inspect.cleandoc(parent.__doc__ or "").partition("Parameters\n----------\n")
        for names, text in re.findall(r"^(\S[^:\n]*) : .*\n((?: {4}.*\n?)+)", parameters, flags=re.MULTILINE):
            described |= dict.fromkeys(names.split(", "), _plain(text))
    prose = inspect.cleandoc(section.__doc__ or "").partition("\n\nParameters\n")[0]
    return _plain(prose), described


def _plain(text: str) -> str:
    """Return text of a docstring on one line without its marks of code."""
    return " ".join(text.replace("`", "").split())
