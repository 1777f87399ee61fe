"""Types of fields that several messages of a tick share."""

from __future__ import annotations

from typing import Annotated

Vector4 = tuple[float, float, float, float]
U32 = Annotated[int, "uint32"]
Counts6 = tuple[U32, U32, U32, U32, U32, U32]
