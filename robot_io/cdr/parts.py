"""How the fields of a Struct are written as CDR and read back; used through `cdr.CdrType`.

Neighbouring numbers, also across nested Structs, form a run that is packed by one `struct.Struct` call, with one
format for each of the eight offsets at which the run may start. Fields of variable length are parts of their own.
Reading accepts only what writing would produce, padding included, and makes nothing larger than the payload.
"""

from __future__ import annotations

import struct
from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import lru_cache
from typing import Any

from robot_io.cdr.packer import Build, Packed, Write, WriterCall, writer_of
from robot_io.cdr.shape import PRIMITIVES, Blob, Many, Nested, Scalar, Shape, Text, builder, leaves

HEADER_BYTES = 4
"""Alignment counts from behind these bytes of encapsulation header."""

_COUNT = struct.Struct("<I")


class NotThisType(Exception):
    """The bytes are not a message of the wanted type."""


class Layout:
    """A Struct as a row of parts that are written and read one after another."""

    def __init__(self, shape: Nested) -> None:
        self._parts: list[_Part] = []
        run: list[tuple[str, Scalar, int | None]] = []
        self.min_bytes = 0
        for path, leaf in leaves(shape):
            match leaf:
                case Scalar():
                    run.append((path, leaf, None))
                case Many(Scalar() as element, int() as count):
                    run.append((path, element, count))
                case _:
                    if run:
                        self._parts.append(_Run(run))
                        run = []
                    self._parts.append(_variable_part(path, leaf))
        if run:
            self._parts.append(_Run(run))
        self.min_bytes = sum(part.min_bytes for part in self._parts)
        self.fixed = all(isinstance(part, _Run) for part in self._parts)
        """Return whether all messages have one size, because none of its parts varies."""
        self._shape = shape
        # Compiled at their first use: most types of a run are never read, most of a log never written.
        self._build: Build | None = None
        self._write: Write | None = None

    def write(self, value: Any, out: bytearray) -> None:
        """Append `value` to `out`, which starts with the encapsulation header."""
        if self._write is None:
            self._write = writer_of([part.writing() for part in self._parts], HEADER_BYTES)
        self._write(value, out)

    def read(self, payload: bytes, at: int) -> tuple[Any, int]:
        """Return the Struct found at `at` and where it ends. Raises NotThisType, struct.error or ValueError."""
        if self._build is None:
            self._build = builder(self._shape)
        found: list[Any] = []
        for part in self._parts:
            at = part.read(payload, at, found)
        return self._build(found), at


class _Part(ABC):
    """Some neighbouring fields of a message; `min_bytes` is the least they can take."""

    min_bytes: int

    @abstractmethod
    def writing(self) -> Packed | WriterCall:
        """Return how it is written."""

    @abstractmethod
    def read(self, payload: bytes, at: int, found: list[Any]) -> int:
        """Append the fields found at `at` to `found`; return where they end."""


class _Run(_Part):
    """Numbers and fixed arrays of numbers, packed in one call."""

    def __init__(self, items: list[tuple[str, Scalar, int | None]]) -> None:
        self._paths = [(path, count) for path, _, count in items]
        self._packers = [struct.Struct(_format(items, start)) for start in range(8)]
        # Only these bytes can differ from what would be written again: padding, and bools.
        self._loose = [
            "x" in packer.format or any(scalar.ros == "bool" for _, scalar, _ in items) for packer in self._packers
        ]
        self.min_bytes = sum(PRIMITIVES[scalar.ros][1] * (count or 1) for _, scalar, count in items)

    def writing(self) -> Packed:
        return Packed(self._paths, [packer.pack for packer in self._packers])

    def read(self, payload: bytes, at: int, found: list[Any]) -> int:
        offset = (at - HEADER_BYTES) & 7
        packer = self._packers[offset]
        if at + packer.size > len(payload):
            raise NotThisType("it ends too soon")
        values = packer.unpack_from(payload, at)
        end = at + packer.size
        if self._loose[offset] and packer.pack(*values) != payload[at:end]:
            raise NotThisType("a bool that is neither 0 nor 1, or padding that is not zero")
        found.extend(values)
        return end


class _Text(_Part):
    """A string."""

    min_bytes = 5

    def __init__(self, path: str) -> None:
        self._path = path

    def writing(self) -> WriterCall:
        return WriterCall(self._path, _write_text)

    def read(self, payload: bytes, at: int, found: list[Any]) -> int:
        text, at = _read_text(payload, at)
        found.append(text)
        return at


class _Blob(_Part):
    """Raw bytes."""

    min_bytes = 4

    def __init__(self, path: str) -> None:
        self._path = path

    def writing(self) -> WriterCall:
        return WriterCall(self._path, _write_blob)

    def read(self, payload: bytes, at: int, found: list[Any]) -> int:
        count, at = _read_count(payload, at, 1)
        found.append(bytes(payload[at : at + count]))
        return at + count


class _Numbers(_Part):
    """A sequence of numbers."""

    min_bytes = 4

    def __init__(self, path: str, scalar: Scalar) -> None:
        self._path = path
        self._code, self._size = PRIMITIVES[scalar.ros]
        self._enum = scalar.enum

    def writing(self) -> WriterCall:
        return WriterCall(self._path, self._write)

    def _write(self, values: tuple[Any, ...], out: bytearray) -> None:
        _write_count(len(values), out)
        if values:
            _pad(out, self._size)
            out += struct.pack(f"<{len(values)}{self._code}", *values)

    def read(self, payload: bytes, at: int, found: list[Any]) -> int:
        count, at = _read_count(payload, at, self._size)
        values: tuple[Any, ...] = ()
        if count:
            at = _aligned(payload, at, self._size)
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


class _Items(_Part):
    """A sequence, or a fixed array, of Structs or strings."""

    def __init__(self, path: str, element: Nested | Text, count: int | None) -> None:
        self._path = path
        self._count = count
        if isinstance(element, Nested):
            layout = Layout(element)
            self._write_one: Write = layout.write
            self._read: Callable[[bytes, int], tuple[Any, int]] = layout.read
            self._element_min = layout.min_bytes
        else:
            self._write_one = _write_text
            self._read = _read_text
            self._element_min = _Text.min_bytes
        self.min_bytes = 4 if count is None else count * self._element_min

    def writing(self) -> WriterCall:
        return WriterCall(self._path, self._write)

    def _write(self, values: tuple[Any, ...], out: bytearray) -> None:
        if self._count is None:
            _write_count(len(values), out)
        elif len(values) != self._count:
            raise ValueError(f"an array of {len(values)} elements instead of {self._count}")
        for value in values:
            self._write_one(value, out)

    def read(self, payload: bytes, at: int, found: list[Any]) -> int:
        if self._count is None:
            count, at = _read_count(payload, at, self._element_min)
        else:
            count = self._count
        values = []
        for _ in range(count):
            value, at = self._read(payload, at)
            values.append(value)
        found.append(tuple(values))
        return at


def _variable_part(path: str, leaf: Shape) -> _Part:
    match leaf:
        case Text(wide=False):
            return _Text(path)
        case Blob():
            return _Blob(path)
        case Many(Scalar() as element, None):
            return _Numbers(path, element)
        case Many((Nested() | Text(wide=False)) as element, count):
            return _Items(path, element, count)
    raise TypeError(f"{path}: {leaf!r} has no CDR form")


def _format(items: list[tuple[str, Scalar, int | None]], start: int) -> str:
    form, at = "<", start
    for _, scalar, count in items:
        code, size = PRIMITIVES[scalar.ros]
        gap = -at % size
        form += f"{gap}x" if gap else ""
        form += code if count is None else f"{count}{code}"
        at += gap + size * (count or 1)
    return form


def _pad(out: bytearray, size: int) -> None:
    gap = (HEADER_BYTES - len(out)) % size
    if gap:
        out += bytes(gap)


def _aligned(payload: bytes, at: int, size: int) -> int:
    end = at + (-(at - HEADER_BYTES) % size)
    if any(payload[at:end]):
        raise NotThisType("padding that is not zero")
    return end


def _write_count(count: int, out: bytearray) -> None:
    _pad(out, 4)
    out += _COUNT.pack(count)


def _read_count(payload: bytes, at: int, element_bytes: int) -> tuple[int, int]:
    at = _aligned(payload, at, 4)
    (count,) = _COUNT.unpack_from(payload, at)
    at += 4
    if count * element_bytes > len(payload) - at:  # before anything of that size is made
        raise NotThisType(f"{count} elements cannot fit")
    return int(count), at


def _write_blob(value: bytes, out: bytearray) -> None:
    _write_count(len(value), out)
    out += value


def _write_text(text: str, out: bytearray) -> None:
    _pad(out, 4)
    out += _text_bytes(text)


@lru_cache(maxsize=500)  # frame names, in every header
def _text_bytes(text: str) -> bytes:
    raw = text.encode()
    return _COUNT.pack(len(raw) + 1) + raw + b"\x00"


def _read_text(payload: bytes, at: int) -> tuple[str, int]:
    size, at = _read_count(payload, at, 1)
    end = at + size
    if size == 0 or payload[end - 1] != 0:
        raise NotThisType("a string without its terminator")
    return payload[at : end - 1].decode(), end
