"""How the fields of a Struct are written as CDR and read back; used through `cdr.CdrType`.

Neighbouring numbers, also across nested Structs, form a run that is unpacked by one `struct.Struct` call, with one
format for each of the eight offsets at which the run may start. Fields of variable length are parts of their own. All
that is nothing but numbers between two others is packed by one call, with a format for each set of lengths; a message
as long as one before it is also unpacked by one (`known_form`).
Reading accepts only what writing would produce, padding included, and makes nothing larger than the payload.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from itertools import islice
from typing import Any

from robot_io.cdr.joined import joined
from robot_io.cdr.known_form import Item, KnownForm, KnownForms, KnownPart, Values
from robot_io.cdr.packer import Build, Fixed, Sequence, Write, WriterCall, flattener_of, writer_of
from robot_io.cdr.shape import PRIMITIVES, Blob, Many, Nested, Scalar, Shape, Text, builder, leaves
from robot_io.cdr.variable_parts import COUNT, BlobPart, NumbersPart, TextPart
from robot_io.cdr.wire import HEADER_BYTES, NotThisType, Part, format_of, read_count, read_text, write_count, write_text


class Layout:
    """A Struct as a row of parts that are written and read one after another."""

    def __init__(self, shape: Nested) -> None:
        self._parts: list[Part] = []
        run: list[Item] = []
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
        self._forms = KnownForms()

    def write(self, value: Any, out: bytearray) -> None:
        """Append `value` to `out`, which starts with the encapsulation header."""
        if self._write is None:
            self._write = writer_of(joined(self._parts), HEADER_BYTES)
        self._write(value, out)

    def read(self, payload: bytes, at: int) -> tuple[Any, int]:
        """Return the Struct found at `at` and where it ends. Raises NotThisType, struct.error or ValueError."""
        if self._build is None:
            self._build = builder(self._shape)
        if (read := self._forms.read(payload, at)) is not None:
            return self._build(read[0]), read[1]
        found: list[Any] = []
        end = at
        for part in self._parts:
            end = part.read(payload, end, found)
        if not self.fixed:  # else one call has read it anyway
            self._forms.note(payload, at, lambda: self._form(found, at))
        return self._build(found), end

    def _form(self, found: list[Any], at: int) -> KnownForm | None:
        """Return the form of a message that was read as these values; None where one of its parts has none."""
        values = iter(found)
        parts = [part.known(values) for part in self._parts]
        known = [part for part in parts if part is not None]
        if len(known) < len(parts):
            return None
        items = [item for part in known for item in part.items]
        return KnownForm(known, struct.Struct(format_of(items, (at - HEADER_BYTES) & 7)))


class _Run(Part):
    """Numbers and fixed arrays of numbers, packed in one call."""

    numeric = True

    def __init__(self, items: list[Item]) -> None:
        self._items = items
        self._packers = [struct.Struct(format_of(items, start)) for start in range(8)]
        # Only these bytes can differ from what would be written again: padding, and bools.
        self._loose = [
            "x" in packer.format or any(scalar.ros == "bool" for _, scalar, _ in items) for packer in self._packers
        ]
        self.min_bytes = sum(PRIMITIVES[scalar.ros][1] * (count or 1) for _, scalar, count in items)
        self._length = sum(count or 1 for _, _, count in items)

    def writing(self) -> Fixed:
        return Fixed([(path, count) for path, _, count in self._items])

    def items(self, counts: Iterator[int]) -> list[Item]:
        return self._items

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

    def known(self, found: Iterator[Any]) -> KnownPart:
        for _ in islice(found, self._length):
            pass
        return KnownPart(self._items)


class _Items(Part):
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
            self._write_one = write_text
            self._read = read_text
            self._element_min = TextPart.min_bytes
        self.min_bytes = 4 if count is None else count * self._element_min

    def writing(self) -> Sequence | WriterCall:
        return WriterCall(self._path, self._write)

    def _write(self, values: tuple[Any, ...], out: bytearray) -> None:
        if self._count is None:
            write_count(len(values), out)
        elif len(values) != self._count:
            raise ValueError(f"an array of {len(values)} elements instead of {self._count}")
        for value in values:
            self._write_one(value, out)

    def read(self, payload: bytes, at: int, found: list[Any]) -> int:
        if self._count is None:
            count, at = read_count(payload, at, self._element_min)
        else:
            count = self._count
        values = []
        for _ in range(count):
            value, at = self._read(payload, at)
            values.append(value)
        found.append(tuple(values))
        return at

    def known(self, found: Iterator[Any]) -> KnownPart | None:
        empty = self._count is None and not next(found)
        return KnownPart([COUNT], 0, tuple) if empty else None


class _Rows(_Items):
    """A sequence of Structs that hold nothing but numbers."""

    numeric = True

    def __init__(self, path: str, element: Nested, columns: list[Item]) -> None:
        super().__init__(path, element, None)
        self._element = element
        self._columns = columns
        self._row: Build | None = None

    def writing(self) -> Sequence:
        return Sequence(self._path, flattener_of([(path, count) for path, _, count in self._columns]))

    def items(self, counts: Iterator[int]) -> list[Item]:
        return [COUNT, *(self._columns * next(counts))]

    def known(self, found: Iterator[Any]) -> KnownPart:
        rows = len(next(found))
        width = sum(count or 1 for _, _, count in self._columns)
        if self._row is None:
            self._row = builder(self._element)
        build = self._row

        def take(values: Values) -> tuple[Any, ...]:
            return tuple([build(list(values[at : at + width])) for at in range(0, len(values), width)])

        return KnownPart(self.items(iter((rows,))), rows, take)


def _variable_part(path: str, leaf: Shape) -> Part:
    match leaf:
        case Text(wide=False):
            return TextPart(path)
        case Blob():
            return BlobPart(path)
        case Many(Scalar() as element, None):
            return NumbersPart(path, element)
        case Many(Nested() as element, None) if (columns := _fixed_items(element)) is not None:
            return _Rows(path, element, columns)
        case Many((Nested() | Text(wide=False)) as element, count):
            return _Items(path, element, count)
    raise TypeError(f"{path}: {leaf!r} has no CDR form")


def _fixed_items(shape: Nested) -> list[Item] | None:
    """Return the numbers of a Struct that holds nothing else, None for any other."""
    items: list[Item] = []
    for path, leaf in leaves(shape):
        match leaf:
            case Scalar():
                items.append((path, leaf, None))
            case Many(Scalar() as element, int() as count):
                items.append((path, element, count))
            case _:
                return None
    return items
