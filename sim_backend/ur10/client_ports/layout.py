"""Packets as tables: each row is a name, a type of the manual, and how its value is read from the robot."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence

from sim_backend.ur10.controller import UrController

TYPES = {
    "bool": "?",
    "int8": "b",
    "uint8": "B",
    "int32": "i",
    "uint32": "I",
    "uint64": "Q",
    "float": "f",
    "double": "d",
    "double[3]": "3d",
    "double[6]": "6d",
    "uint32[6]": "6I",
}
"""Type of the manual -> code of the struct module; big-endian and packed."""

Value = float | Sequence[float]
Row = tuple[str, str, Callable[[UrController], Value]]


class Layout:
    """Fields one after another."""

    def __init__(self, rows: Sequence[Row]) -> None:
        self._read = [read for _, _, read in rows]
        self._struct = struct.Struct(">" + "".join(TYPES[type_name] for _, type_name, _ in rows))
        self.size = self._struct.size

    def pack(self, robot: UrController) -> bytes:
        """Return the values of now."""
        values: list[float] = []
        for read in self._read:
            value = read(robot)
            if isinstance(value, Sequence):
                values.extend(value)
            else:
                values.append(value)
        return self._struct.pack(*values)


def always(value: Value) -> Callable[[UrController], Value]:
    """Return a reader for what is not modelled: the value of a healthy robot at rest."""
    return lambda _robot: value
