"""Compiles the function that packs the numbers of a message, from their dotted paths.

    packer_of([("stamp.sec", None), ("force", 3)])  ->  def pack_run(m, pack): v0 = m.stamp; ...

Measured for `/control/tick` (200 numbers in 80 nested Structs and arrays): 6 us against 25 us with `attrgetter` and a
list, which was most of what encoding cost, in the loop and at level `sim`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NoReturn


def packer_of(items: list[tuple[str, int | None]]) -> Callable[[Any, Callable[..., bytes]], bytes]:
    """Return `f(message, pack)`: `pack` called with all values, fixed arrays (path, length) laid out flat.

    The paths must be attribute names. The function raises ValueError for an array of another length.
    """
    lines: list[str] = []
    owners: dict[str, str] = {"": "m"}

    def owner(path: str) -> str:
        if path not in owners:
            before, _, name = path.rpartition(".")
            value = f"{owner(before)}.{name}"
            owners[path] = f"v{len(owners)}"
            lines.append(f"{owners[path]} = {value}")
        return owners[path]

    values = []
    for path, length in items:
        if length is None:
            before, _, name = path.rpartition(".")
            values.append(f"{owner(before)}.{name}")
        else:
            array = owner(path)
            lines.append(f"if len({array}) != {length}: refuse({array}, {length})")
            values.append(f"*{array}")
    body = "".join(f"    {line}\n" for line in lines)
    names: dict[str, Any] = {"refuse": _refuse}
    exec(f"def pack_run(m, pack):\n{body}    return pack({', '.join(values)})\n", names)  # our own text: see above
    packer: Callable[[Any, Callable[..., bytes]], bytes] = names["pack_run"]
    return packer


def _refuse(array: tuple[Any, ...], length: int) -> NoReturn:
    raise ValueError(f"an array of {len(array)} where {length} belong")
