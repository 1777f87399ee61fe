"""Reads CDR payloads as other programs write them, by the shape of their type; our own are read by `cdr_type`.

Wire form: DDS-XTypes 1.3, 7.4.1 and 7.6.3.1, encoding version 1, of either byte order. What the standard leaves open is
taken as it comes: padding of any value, up to three bytes of it behind the message, options in the header, a string of
length 0. A `wstring` is what the middlewares of ROS 2 make of it: a uint32 count and each UTF-16 unit as a uint32.

Nothing is made that is larger than the payload could fill.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Any

from robot_io.cdr.schema import ONLY_FIELD_OF_EMPTY
from robot_io.cdr.shape import PRIMITIVES, Many, Nested, Scalar, Shape, Text
from robot_io.cdr.wire import HEADER_BYTES, NotThisType
from robot_io.errors import LogDamaged

_PADDING_MAX = 3
_ORDERS = {0: ">", 1: "<"}
# By the number in the first two bytes; those from 0x10 on are of an older draft, and still written.
_OTHER_FORMS = {
    **dict.fromkeys((0x02, 0x03), "a parameter list (PL_CDR)"),
    **dict.fromkeys((0x06, 0x07, 0x10, 0x11), "CDR of version 2 (XCDR2)"),
    **dict.fromkeys((0x08, 0x09, 0x14, 0x15), "delimited CDR of version 2 (XCDR2)"),
    **dict.fromkeys((0x0A, 0x0B, 0x12, 0x13), "a parameter list of version 2 (PL_CDR2)"),
    0x04: "XML",
}


class ReaderOfOthers:
    """Decodes the payloads of one type: its name for messages, its shape from `schema.shape_from_schema`."""

    def __init__(self, name: str, shape: Nested) -> None:
        self._name = name
        self._read = _reader(shape)
        self._empty = shape.struct_type(0) if [field for field, _ in shape.fields] == [ONLY_FIELD_OF_EMPTY] else None

    def decode(self, payload: bytes) -> Any:
        """Return the message of a payload. Raises LogDamaged when it is none of this type, or of an unknown form."""
        try:
            cursor = _Cursor(payload, _order(payload))
            if self._empty is not None and len(payload) == HEADER_BYTES:
                return self._empty
            value = self._read(cursor)
            if len(payload) - cursor.at > _PADDING_MAX:
                raise NotThisType(f"{len(payload) - cursor.at} bytes too many")
        except (NotThisType, ValueError) as error:
            raise LogDamaged(f"a payload of {len(payload)} bytes is not a {self._name}: {error}") from None
        return value


class _Cursor:
    """A place in a payload."""

    __slots__ = ("at", "order", "payload")

    def __init__(self, payload: bytes, order: str) -> None:
        self.payload = payload
        self.order = order
        self.at = HEADER_BYTES

    def take(self, size: int, count: int = 1) -> int:
        """Step over `count` aligned elements and return where they begin."""
        start = self.at + (-(self.at - HEADER_BYTES) % size)
        if size * count > len(self.payload) - start:
            raise NotThisType("it ends too soon")
        self.at = start + size * count
        return start

    def count(self, element_min: int) -> int:
        """Return the length of a sequence whose elements take at least `element_min` bytes."""
        start = self.take(4)
        count = int.from_bytes(self.payload[start : start + 4], "little" if self.order == "<" else "big")
        self.require(count, element_min)
        return count

    def require(self, count: int, element_min: int) -> None:
        """Refuse more elements than there is room for, before anything of that size is made."""
        if count * element_min > len(self.payload) - self.at:
            raise NotThisType(f"{count} elements cannot fit")


_Read = Callable[[_Cursor], Any]


def _order(payload: bytes) -> str:
    if len(payload) < HEADER_BYTES:
        raise NotThisType("it is too short to be CDR")
    form = int.from_bytes(payload[:2], "big")
    if form in _OTHER_FORMS:
        raise NotThisType(f"it is {_OTHER_FORMS[form]}, and only CDR of version 1 can be read")
    if form not in _ORDERS:
        raise NotThisType(f"it starts with {payload[:2].hex(' ')}, which no form of CDR does")
    return _ORDERS[form]


def _reader(shape: Shape) -> _Read:
    match shape:
        case Nested(struct_type, _, fields):
            reads = [_reader(field) for _, field in fields]
            return lambda cursor: struct_type(*[read(cursor) for read in reads])
        case Scalar(ros):
            return _number(ros)
        case Text(wide):
            return _wide_text if wide else _text
        case Many(Scalar(ros), length):
            return _numbers(ros, length)
        case Many(element, length):
            return _items(_reader(element), _min_bytes(element), length)
    raise TypeError(f"{shape!r} is nothing that a schema says")


def _number(ros: str) -> _Read:
    code, size = PRIMITIVES[ros]
    unpack = {order: struct.Struct(f"{order}{code}").unpack_from for order in "<>"}

    def read(cursor: _Cursor) -> Any:
        start = cursor.take(size)
        (value,) = unpack[cursor.order](cursor.payload, start)
        if code == "?":
            _require_bools(cursor.payload[start : start + 1])
        return value

    return read


def _numbers(ros: str, length: int | None) -> _Read:
    code, size = PRIMITIVES[ros]

    def read(cursor: _Cursor) -> Any:
        count = cursor.count(size) if length is None else length
        if count == 0:
            return ()
        start = cursor.take(size, count)
        if code == "?":
            _require_bools(cursor.payload[start : start + count])
        return struct.unpack_from(f"{cursor.order}{count}{code}", cursor.payload, start)

    return read


def _items(read_one: _Read, element_min: int, length: int | None) -> _Read:
    def read(cursor: _Cursor) -> Any:
        if length is None:
            count = cursor.count(element_min)
        else:
            count = length
            cursor.require(count, element_min)
        return tuple([read_one(cursor) for _ in range(count)])

    return read


def _text(cursor: _Cursor) -> str:
    count = cursor.count(1)
    start = cursor.take(1, count)
    if count and cursor.payload[cursor.at - 1] != 0:
        raise NotThisType("a string without its end")
    return cursor.payload[start : cursor.at - 1].decode() if count else ""


def _wide_text(cursor: _Cursor) -> str:
    count = cursor.count(4)
    start = cursor.take(4, count)
    units = struct.unpack_from(f"{cursor.order}{count}I", cursor.payload, start)
    if any(unit > 0xFFFF for unit in units):
        raise NotThisType("a wstring whose characters are not four bytes each")
    return struct.pack(f"<{count}H", *units).decode("utf-16-le")


def _require_bools(raw: bytes) -> None:
    if raw.strip(b"\x00\x01"):
        raise NotThisType("a bool that is neither 0 nor 1")


def _min_bytes(shape: Shape) -> int:
    match shape:
        case Nested(_, _, fields):
            return sum(_min_bytes(field) for _, field in fields)
        case Scalar(ros):
            return PRIMITIVES[ros][1]
        case Many(element, int() as length):
            return length * _min_bytes(element)
        case _:
            return 4
