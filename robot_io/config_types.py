"""What every table of a rig file is built of: ranges, vectors, levels, and the table itself."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

Positive = Annotated[float, Meta(gt=0)]
NonNegative = Annotated[float, Meta(ge=0)]
Level = Literal["sim", "emulated", "hardware"]
Vector2 = tuple[float, float]
Vector3 = tuple[float, float, float]
Matrix3 = tuple[Vector3, Vector3, Vector3]
Vector6 = tuple[float, float, float, float, float, float]


class Table(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A table of a rig file: frozen, unknown keys refused."""
