"""Types as `rosapi` describes them field by field: names, types, array lengths and examples.

As rosapi does: a list of -1 for a single value, 0 for a list of any length; ROS 2 gives the IDL's names of numbers, and
short names of messages (`pkg/Type`). Constants are left out: no type of the emulated robot has any in ROS 1, and what
ROS 2 lists as such are its own helpers.
"""

from __future__ import annotations

from typing import Any

from sim_backend.ridgeback.ros_types import Fields, RosTypes

TypeDef = dict[str, Any]
_EXAMPLES = {"bool": "False", "string": "", "float32": "0.0", "float64": "0.0"}
_NUMBERS = ("uint8", "int32", "uint32", "float32", "float64")
_IDL_NAMES = {"float64": "double", "float32": "float", "bool": "boolean"}
_ROS_2_TIMES = {"time": "builtin_interfaces/Time", "duration": "builtin_interfaces/Duration"}


class TypeDefs:
    """Describes the types that `types` knows, and those of `own` besides."""

    def __init__(self, types: RosTypes, own: dict[str, Fields]) -> None:
        self._types = types
        self._own = own

    def of_message(self, type_name: str) -> list[TypeDef] | None:
        """Return a message type and, depth first, all types in it; None for an unknown one."""
        kind = type_name.replace("/msg/", "/")
        return self._all(kind, []) if kind in self._own or self._types.canonical(type_name) else None

    def of_fields(self, type_name: str, fields: Fields) -> list[TypeDef]:
        """Return a request or an answer of these fields, and all types in it."""
        return self._with_nested(type_name, fields, [])

    def _all(self, kind: str, seen: list[str]) -> list[TypeDef]:
        if kind in seen or kind in _NUMBERS or kind in _EXAMPLES:
            return []
        seen.append(kind)
        if kind in _ROS_2_TIMES:
            parts: Fields = (
                (("sec", "int32"), ("nanosec", "uint32"))
                if self._types.ros_version == 2
                else (("secs", "int32"), ("nsecs", "int32"))
            )
            return self._with_nested(self._spelt(kind), parts, seen)
        return self._with_nested(kind, self._own.get(kind) or self._types.fields_of(kind), seen)

    def _with_nested(self, name: str, fields: Fields, seen: list[str]) -> list[TypeDef]:
        kinds = [kind.partition("[")[0] for _, kind in fields]
        definition = {
            "type": name,
            "fieldnames": [field for field, _ in fields],
            "fieldtypes": [self._spelt(kind) for kind in kinds],
            "fieldarraylen": [int(kind.partition("[")[2][:-1] or 0) if "[" in kind else -1 for _, kind in fields],
            "examples": [_example(kind) for _, kind in fields],
            "constnames": [],
            "constvalues": [],
        }
        return [definition, *(found for kind in kinds for found in self._all(kind, seen))]

    def _spelt(self, kind: str) -> str:
        return {**_IDL_NAMES, **_ROS_2_TIMES}.get(kind, kind) if self._types.ros_version == 2 else kind


def _example(kind: str) -> str:
    if "[" in kind:
        return "[]"
    return _EXAMPLES.get(kind, "0" if kind in _NUMBERS else "{}")
