"""What every table of a rig file is built of: ranges, vectors, levels, and the table itself."""

from __future__ import annotations

from types import NoneType
from typing import Annotated, Any, Literal, get_args, get_origin

import msgspec
from msgspec import Meta

from robot_io.messages import Vector3

Positive = Annotated[float, Meta(gt=0)]
NonNegative = Annotated[float, Meta(ge=0)]
Level = Literal["sim", "emulated", "hardware"]
Vector2 = tuple[float, float]
_OnRobot = Annotated[float, Meta(ge=-5, le=5)]
OnRobot2 = tuple[_OnRobot, _OnRobot]
InBase = tuple[_OnRobot, _OnRobot, _OnRobot]
"""A point of the robot in m: beyond 5 m it was written in mm."""
_InRoom = Annotated[float, Meta(ge=-1000, le=1000)]
InRoom = tuple[_InRoom, _InRoom]
"""A point of the floor in m."""
_Turn = Annotated[float, Meta(ge=-6.3, le=6.3)]
Joints = tuple[_Turn, _Turn, _Turn, _Turn, _Turn, _Turn]
"""Joints of a UR10 in rad, a full turn to either side: beyond it they were written in degrees."""
Matrix3 = tuple[Vector3, Vector3, Vector3]


_Plain = bool | int | float | str
Options = dict[str, _Plain | list[_Plain]]
"""Keys of a device's kind, whose meaning only its driver knows."""


class Table(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A table of a rig file: frozen, unknown keys refused."""


class LawFacts(Table, frozen=True):
    """What a law of one's own declares: empty for a shipped law."""

    name: str = ""
    """What it is called in reports."""
    source_sha256: str = ""
    """Of the file it is in, hexadecimal."""
    state: tuple[str, ...] = ()
    """The name of each number of its state, in the order in which the log has them."""


def row_of(kind: Any) -> type[msgspec.Struct] | None:
    """Return the table of which a field of this type holds a list; None for any other field."""
    parts = get_args(kind)
    return table_of(parts[0]) if get_origin(kind) is tuple and parts[1:] == (Ellipsis,) else None


def table_of(kind: Any) -> type[msgspec.Struct] | None:
    """Return the table that a field of this type holds, also one that may be left out; None for any other field."""
    present = [part for part in get_args(kind) if part is not NoneType] or [kind]
    only = present[0] if len(present) == 1 else None
    return only if isinstance(only, type) and issubclass(only, msgspec.Struct) else None
