"""ROS 2 messages as bytes (CDR): message types from Structs, and from the schema text of a log."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robot_io._lazy import exports

if TYPE_CHECKING:
    from robot_io.cdr.cdr_type import CdrType
    from robot_io.cdr.schema import type_from_schema

__all__ = ["CdrType", "type_from_schema"]

__getattr__, __dir__ = exports(
    __name__,
    {
        "CdrType": "cdr_type",
        "type_from_schema": "schema",
    },
)
