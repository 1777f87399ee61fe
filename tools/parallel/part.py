"""The result of one piece of work: rows for a table, and arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING

import msgspec

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Row = dict[str, str | int | float]


class Part(msgspec.Struct, frozen=True):
    """The result of one item: a row for each case, and named arrays."""

    rows: list[Row]
    arrays: dict[str, NDArray[np.float64]]
