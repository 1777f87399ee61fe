"""Reads the messages of a log as the types of today: as they are when the log's schema is today's, else field by field.

In an earlier log's message each field of today is looked for by its name (or the one it had, `log_format`). One that
the log lacks gets the value it meant then or had in other fields, else its type's default, else zero; one that is gone
is passed over.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, TypeVar

import msgspec
from msgspec.structs import replace

from robot_io.cdr.cdr_type import CdrType
from robot_io.cdr.schema import type_from_schema
from robot_io.cdr.shape import Blob, Many, Nested, Scalar, Shape, Text
from robot_io.errors import LogDamaged
from robot_io.log import log_format as table

MessageT = TypeVar("MessageT", bound=msgspec.Struct)
Convert = Callable[[Any], Any]
_ZERO: dict[str, Any] = {"bool": False, "float32": 0.0, "float64": 0.0}


class LoggedType(Generic[MessageT]):
    """Decodes the messages of one topic of a log as `today`'s type.

    name, text: the log's own type name and schema. Raises LogDamaged when they are of another type or cannot be used.
    """

    def __init__(self, today: CdrType[MessageT], name: str, text: str, log_format: int) -> None:
        self._today = today
        self._logged: CdrType[Any] | None = None
        self.missing: frozenset[str] = frozenset()
        """Dotted paths of the fields of today that the log does not have; elements of arrays without their index."""
        self.gone: frozenset[str] = frozenset()
        """Those of the log that today's type does not have."""
        if name != today.name:
            raise LogDamaged(f"a {name[:100]} where a {today.name} is expected")
        if text == today.schema_text:
            return
        self._logged = type_from_schema(name, text)
        maker = _Maker(log_format)
        self._convert = maker.nested(today.shape, self._logged.shape, "")
        self.missing, self.gone = frozenset(maker.missing), frozenset(maker.gone)

    @property
    def exact(self) -> bool:
        """Return whether the log's messages are today's, byte for byte."""
        return self._logged is None

    def holds_all_of(self, path: str) -> bool:
        """Return whether the part at a dotted path has the same fields in the log as today."""
        return not any(field.startswith(path) for field in self.missing | self.gone)

    def decode(self, payload: bytes) -> MessageT:
        """Return the message of a payload as today's. Raises LogDamaged when it is none of the log's own type."""
        if self._logged is None:
            return self._today.decode(payload)
        try:
            found: MessageT = self._convert(self._logged.decode(payload))
        except ValueError as error:  # a number that is none of today's enum
            raise LogDamaged(f"a value of {self._today.name} means nothing: {error}") from None
        return found

    def notes(self, topic: str) -> list[str]:
        """Return in words what could not be compared."""
        found = []
        if self.missing:
            found.append(f"not compared, the log's {topic} does not hold it: {', '.join(sorted(self.missing))}")
        if self.gone:
            found.append(f"not compared, today's {topic} does not hold it: {', '.join(sorted(self.gone))}")
        return found


class _Maker:
    """Makes the function that turns a message of a log into today's, and notes what does not match."""

    def __init__(self, log_format: int) -> None:
        self._format = log_format
        self._now_optional = {
            (name, field): counts for name, field, counts, last in table.NOW_OPTIONAL if log_format <= last
        }
        self.missing: set[str] = set()
        self.gone: set[str] = set()

    def nested(self, today: Nested, logged: Nested, path: str) -> Convert:
        ours = {name.lower(): (name, shape) for name, shape in logged.fields}
        for type_name, old, new, last_format in table.RENAMED_FIELDS:
            if type_name == today.ros_name and self._format <= last_format and old in ours:
                ours[new.lower()] = ours.pop(old)
        values: list[Convert] = []
        for name, shape in today.fields:
            here = f"{path}{name}"
            kept, its_shape = ours.pop(name.lower(), (name, None))
            convert = None if its_shape is None else self._shape(shape, its_shape, here)
            counts = self._now_optional.get((today.ros_name, name))
            if counts is not None and isinstance(shape, Many) and its_shape is not None:
                convert = self._shape(shape.element, its_shape, here)
            if convert is None:
                self.missing.add(here)
                if its_shape is not None:
                    self.gone.add(here)
                values.append(_constant(self._default(today, name, shape)))
            else:
                values.append(_field(kept, convert) if counts is None else _optional(kept, convert, counts))
        self.gone |= {f"{path}{name}" for name in ours}
        make = today.struct_type
        computed = [
            (field.split("."), of)
            for type_name, field, of, last_format in table.COMPUTED_VALUES
            if type_name == today.ros_name and self._format <= last_format and f"{path}{field}" in self.missing
        ]
        self.missing -= {f"{path}{'.'.join(field)}" for field, _ in computed}

        def convert_message(message: Any) -> Any:
            made = make(*[value(message) for value in values])
            for field, of in computed:
                made = _with(made, field, of(message))
            return made

        return convert_message

    def _shape(self, today: Shape, logged: Shape, path: str) -> Convert | None:
        """Return what converts a field; None when the two have nothing in common."""
        match today, logged:
            case Nested(), Nested():
                return self.nested(today, logged, f"{path}.")
            case Scalar(ros, enum), Scalar(its_ros) if _kind(ros) == _kind(its_ros):
                return enum if enum is not None else _as_it_is
            case Text(), Text():
                return _as_it_is
            case Blob(), Many(Scalar("uint8"), None):
                return bytes
            case Many(element, length), Many(its_element, its_length) if length == its_length:
                convert = self._shape(element, its_element, path)
                return None if convert is None else lambda items: tuple(map(convert, items))
        return None

    def _default(self, owner: Nested, name: str, shape: Shape) -> Any:
        for type_name, field, value, last_format in table.EARLIER_VALUES:
            if (type_name, field) == (owner.ros_name, name) and self._format <= last_format:
                return value
        for info in msgspec.structs.fields(owner.struct_type):
            if info.name == name and info.default is not msgspec.NODEFAULT:
                return info.default
        return self._zero(shape)

    def _zero(self, shape: Shape) -> Any:
        match shape:
            case Scalar(ros, enum):
                return _ZERO.get(ros, 0) if enum is None else next(iter(enum))
            case Text():
                return ""
            case Blob():
                return b""
            case Many(element, length):
                return (self._zero(element),) * (length or 0)
            case Nested(struct_type, _, fields):
                return struct_type(*[self._default(shape, name, inner) for name, inner in fields])


def _kind(ros: str) -> str:
    return "float" if ros.startswith("float") else "bool" if ros == "bool" else "int"


def _with(made: Any, field: list[str], value: Any) -> Any:
    """Return the message with another value of a field, which may be in a part of it."""
    first, *inner = field
    return replace(made, **{first: _with(getattr(made, first), inner, value) if inner else value})


def _constant(value: Any) -> Convert:
    return lambda _: value


def _field(name: str, convert: Convert) -> Convert:
    return lambda message: convert(getattr(message, name))


def _optional(name: str, convert: Convert, counts: Callable[[Any], bool]) -> Convert:
    return lambda message: (convert(getattr(message, name)),) if counts(message) else ()


def _as_it_is(value: Any) -> Any:
    return value
