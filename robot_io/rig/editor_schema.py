"""The JSON Schema of a rig file, by which editors complete keys and mark mistakes."""

from __future__ import annotations

from typing import Any

import msgspec

from robot_io.rig import calibration, config, task, topics, world
from robot_io.rig.notes import notes_of

DRAFT = "https://json-schema.org/draft/2020-12/schema"
INCLUDE = {
    "type": "array",
    "items": {"type": "string"},
    "description": "Files whose keys this rig takes, such as calibrations: paths from this file.",
}
EXTENDS = {"type": "string", "description": "The rig that this one changes: a shipped name, or a path from this file."}


def rig_schema() -> dict[str, Any]:
    """Return the schema: every key with its type, range, default and what is said of it."""
    schema = msgspec.json.schema(config.RigConfig)
    notes = notes_of(config, task, calibration, topics, world)
    tables = schema["$defs"]
    del tables["FtConfig"]["properties"]["declared"], tables["SensorFacts"]  # written by the program
    for name, table in tables.items():
        table.pop("required", None)  # it may come from the rig that is extended
        table["properties"] = {
            key: _field(field, notes.get((name, key), "")) for key, field in table["properties"].items()
        }
    tables["RigConfig"]["properties"] |= {"extends": EXTENDS, "include": INCLUDE}
    return {"$schema": DRAFT, **schema}


def _field(field: dict[str, Any], note: str) -> dict[str, Any]:
    if "$ref" in field or field.get("default", 0) is None:
        field.pop("default", None)
    kinds = [kind for kind in field.pop("anyOf", ()) if kind != {"type": "null"}]  # TOML has no null
    if len(kinds) == 1:
        field |= kinds[0]
    elif kinds:
        field["anyOf"] = kinds
    return field | ({"description": note} if note else {})
