"""Fields whose length a message says itself: strings, raw bytes, and sequences of numbers."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import Any

from robot_io.cdr.known_form import Item, KnownPart, Values
from robot_io.cdr.packer import Sequence, WriterCall
from robot_io.cdr.shape import PRIMITIVES, Scalar
from robot_io.cdr.wire import NotThisType, Part, aligned, read_count, read_text, write_blob, write_text

COUNT: Item = ("", Scalar("uint32"), None)
_BYTES = Scalar("uint8")
_LONGEST_TEXT = 64
"""A longer one is not taken apart byte by byte; names are shorter."""


class TextPart(Part):
    """A string."""

    min_bytes = 5

    def __init__(self, path: str) -> None:
        self._path = path

    def writing(self) -> WriterCall:
        """Return how it is written."""
        return WriterCall(self._path, write_text)

    def read(self, payload: bytes, at: int, found: list[Any]) -> int:
        """Append the field found at `at` to `found`; return where it ends."""
        text, at = read_text(payload, at)
        found.append(text)
        return at

    def known(self, found: Iterator[Any]) -> KnownPart | None:
        """Return how long the next of the fields that were found is; None for a long one."""
        size = len(next(found).encode()) + 1
        return None if size > _LONGEST_TEXT else KnownPart([COUNT, ("", _BYTES, size)], size, _text)


class BlobPart(Part):
    """Raw bytes."""

    min_bytes = 4

    def __init__(self, path: str) -> None:
        self._path = path

    def writing(self) -> WriterCall:
        """Return how it is written."""
        return WriterCall(self._path, write_blob)

    def read(self, payload: bytes, at: int, found: list[Any]) -> int:
        """Append the field found at `at` to `found`; return where it ends."""
        count, at = read_count(payload, at, 1)
        found.append(bytes(payload[at : at + count]))
        return at + count

    def known(self, found: Iterator[Any]) -> None:
        """Pass over the next of the fields that were found: pictures, say, are not to be taken apart."""
        next(found)


class NumbersPart(Part):
    """A sequence of numbers."""

    numeric = True
    min_bytes = 4

    def __init__(self, path: str, scalar: Scalar) -> None:
        self._path = path
        self._code, self._size = PRIMITIVES[scalar.ros]
        self._scalar = scalar
        self._enum = scalar.enum

    def writing(self) -> Sequence:
        """Return how it is written."""
        return Sequence(self._path, None)

    def items(self, counts: Iterator[int]) -> list[Item]:
        """Return the numbers of a sequence that has the next of `counts` elements."""
        count = next(counts)
        return [COUNT, *([("", self._scalar, count)] if count else [])]

    def read(self, payload: bytes, at: int, found: list[Any]) -> int:
        """Append the field found at `at` to `found`; return where it ends."""
        count, at = read_count(payload, at, self._size)
        values: tuple[Any, ...] = ()
        if count:
            at = aligned(payload, at, self._size)
            form = f"<{count}{self._code}"
            values = struct.unpack_from(form, payload, at)
            if self._code == "?" and struct.pack(form, *values) != payload[at : at + count]:
                raise NotThisType("a bool that is neither 0 nor 1")
            at += count * self._size
        if self._enum is not None:
            enum = self._enum
            values = tuple(enum(value) for value in values)
        found.append(values)
        return at

    def known(self, found: Iterator[Any]) -> KnownPart:
        """Return how long the next of the fields that were found is."""
        count, enum = len(next(found)), self._enum
        take = tuple if enum is None else lambda values: tuple(map(enum, values))
        return KnownPart(self.items(iter((count,))), count, take)


def _text(values: Values) -> str:
    """Return the string of these bytes. Raises NotThisType or UnicodeDecodeError."""
    if values[-1] != 0:
        raise NotThisType("a string without its terminator")
    return bytes(values[:-1]).decode()
