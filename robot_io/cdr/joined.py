"""How neighbouring parts of a message are written: all that is nothing but numbers between two others by one call."""

from __future__ import annotations

import struct
from collections.abc import Callable
from itertools import groupby

from robot_io.cdr.packer import Packed, WriterCall
from robot_io.cdr.wire import Part, format_of

_MOST_PACKS = 1000
"""More combinations of lengths than a run's ticks have; beyond it those kept are made anew."""


class _Packs(dict[tuple[int, ...], Callable[..., bytes]]):
    """What packs some neighbouring parts, by offset modulo 8 and the number of elements of each sequence."""

    def __init__(self, parts: list[Part]) -> None:
        super().__init__()
        self._parts = parts

    def __missing__(self, key: tuple[int, ...]) -> Callable[..., bytes]:
        if len(self) >= _MOST_PACKS:
            self.clear()
        start, *counts = key
        left = iter(counts)
        items = [item for part in self._parts for item in part.items(left)]
        self[key] = struct.Struct(format_of(items, start)).pack
        return self[key]


def joined(parts: list[Part]) -> list[Packed | WriterCall]:
    """Return how the parts are written: neighbours that are nothing but numbers by one call."""
    joined: list[Packed | WriterCall] = []
    for is_numbers, group in groupby(parts, lambda part: part.numeric):
        together = list(group)
        written = [part.writing() for part in together]
        if is_numbers:
            joined.append(Packed([one for one in written if not isinstance(one, WriterCall)], _Packs(together)))
        else:
            joined.extend(one for one in written if isinstance(one, WriterCall))
    return joined
