"""The smallest pieces of CDR: alignment, counts, strings and raw bytes, and what every part of a layout can do."""

from __future__ import annotations

import struct
from abc import ABC, abstractmethod
from collections.abc import Iterator
from functools import lru_cache
from typing import Any

from robot_io.cdr.known_form import Item, KnownPart
from robot_io.cdr.packer import Fixed, Sequence, WriterCall
from robot_io.cdr.shape import PRIMITIVES

HEADER_BYTES = 4
"""Alignment counts from behind these bytes of encapsulation header."""

_COUNT = struct.Struct("<I")


class NotThisType(Exception):
    """The bytes are not a message of the wanted type."""


class Part(ABC):
    """Some neighbouring fields of a message; `min_bytes` is the least they can take."""

    min_bytes: int
    numeric = False
    """Whether it is nothing but numbers, counts included, so that it can be packed together with its neighbours."""

    @abstractmethod
    def writing(self) -> Fixed | Sequence | WriterCall:
        """Return how it is written."""

    def items(self, counts: Iterator[int]) -> list[Item]:
        """Return the numbers of a fixed part, or of a sequence that has the next of `counts` elements."""
        raise NotImplementedError  # a part that is written by a WriterCall is never asked for its numbers

    @abstractmethod
    def read(self, payload: bytes, at: int, found: list[Any]) -> int:
        """Append the fields found at `at` to `found`; return where they end."""

    @abstractmethod
    def known(self, found: Iterator[Any]) -> KnownPart | None:
        """Return how long the next of the fields that were found is; None where that has no fixed form."""


def format_of(items: list[Item], start: int) -> str:
    """Return the format of the `struct` module for these numbers behind `start` bytes."""
    form, at = "<", start
    for _, scalar, count in items:
        code, size = PRIMITIVES[scalar.ros]
        gap = -at % size
        form += f"{gap}x" if gap else ""
        form += code if count is None else f"{count}{code}"
        at += gap + size * (count or 1)
    return form


def pad(out: bytearray, size: int) -> None:
    """Append zeros up to a multiple of `size`."""
    gap = (HEADER_BYTES - len(out)) % size
    if gap:
        out += bytes(gap)


def aligned(payload: bytes, at: int, size: int) -> int:
    """Return where the next multiple of `size` is. Raises NotThisType when there is anything but zeros before it."""
    end = at + (-(at - HEADER_BYTES) % size)
    if any(payload[at:end]):
        raise NotThisType("padding that is not zero")
    return end


def write_count(count: int, out: bytearray) -> None:
    """Append the count of a sequence."""
    pad(out, 4)
    out += _COUNT.pack(count)


def read_count(payload: bytes, at: int, element_bytes: int) -> tuple[int, int]:
    """Return a sequence's count and where its elements are. Raises NotThisType when they do not fit."""
    at = aligned(payload, at, 4)
    (count,) = _COUNT.unpack_from(payload, at)
    at += 4
    if count * element_bytes > len(payload) - at:  # before anything of that size is made
        raise NotThisType(f"{count} elements cannot fit")
    return int(count), at


def write_blob(value: bytes, out: bytearray) -> None:
    """Append raw bytes."""
    write_count(len(value), out)
    out += value


def write_text(text: str, out: bytearray) -> None:
    """Append a string."""
    pad(out, 4)
    out += _text_bytes(text)


@lru_cache(maxsize=500)  # frame names, in every header
def _text_bytes(text: str) -> bytes:
    raw = text.encode()
    return _COUNT.pack(len(raw) + 1) + raw + b"\x00"


def read_text(payload: bytes, at: int) -> tuple[str, int]:
    """Return a string and where it ends. Raises NotThisType or UnicodeDecodeError."""
    size, at = read_count(payload, at, 1)
    end = at + size
    if size == 0 or payload[end - 1] != 0:
        raise NotThisType("a string without its terminator")
    return payload[at : end - 1].decode(), end
