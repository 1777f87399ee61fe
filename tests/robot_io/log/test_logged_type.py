"""A message of another version of a type, field by field: what both have, what is missing, what has gone."""

from __future__ import annotations

from enum import IntEnum
from typing import Annotated, ClassVar

import msgspec
import pytest

from robot_io.cdr.cdr_type import CdrType
from robot_io.cdr.schema import type_from_schema
from robot_io.errors import LogDamaged, UsageError
from robot_io.log import log_format
from robot_io.log.log_format import ComputedValue, EarlierValue, RenamedField, format_of
from robot_io.log.logged_type import LoggedType

NAME = "push_msgs/msg/Whole"


class Colour(IntEnum):
    RED = 3
    BLUE = 5


class Part(msgspec.Struct, frozen=True):
    __ros_name__: ClassVar[str] = "push_msgs/msg/Part"
    x: float
    y: float = 2.5


class Whole(msgspec.Struct, frozen=True):
    __ros_name__: ClassVar[str] = NAME
    n: int
    force_N: float
    small: Annotated[int, "uint8"]
    good: bool
    text: str
    blob: bytes
    colour: Colour
    part: Part
    parts: tuple[Part, ...]
    six: tuple[float, float, float]


TODAY = CdrType(Whole, NAME)
FIELDS = TODAY.schema_text.split("=" * 80)[0]
PART = "float64 x\nfloat64 y\n"


def text_of(fields: str, part: str = PART) -> str:
    return f"{fields}{'=' * 80}\nMSG: push_msgs/Part\n{part}"


def read(
    fields: str, part: str = PART, log_format_number: int = 1, /, **values: object
) -> tuple[Whole, LoggedType[Whole]]:
    """Encode a message of such a schema and return it as today's."""
    text = text_of(fields, part)
    logged = type_from_schema(NAME, text)
    made = LoggedType(TODAY, NAME, text, log_format_number)
    payload = logged.encode(msgspec.convert(values, logged.struct_type))
    return made.decode(payload), made


def test_the_schema_of_today_is_read_exactly():
    value = Whole(1, 2.0, 3, True, "a", b"b", Colour.BLUE, Part(1.0), (Part(2.0),), (1.0, 2.0, 3.0))
    made = LoggedType(TODAY, NAME, TODAY.schema_text, 2)
    assert made.exact
    assert made.decode(TODAY.encode(value)) == value
    assert made.notes("/t") == []


def test_every_kind_of_field_is_found_by_its_name_in_any_order():
    fields = "\n".join(reversed(FIELDS.strip().split("\n"))) + "\n"
    found, made = read(
        fields, n=-7, force_n=0.5, small=200, good=True, text="ü", blob=(1, 2), colour=5, part={"x": 1.0, "y": 9.0},
        parts=[{"x": 3.0, "y": 4.0}], six=(1.0, 2.0, 3.0),
    )  # fmt: skip
    assert not made.exact
    assert found == Whole(-7, 0.5, 200, True, "ü", b"\1\2", Colour.BLUE, Part(1.0, 9.0), (Part(3.0, 4.0),), (1, 2, 3))
    assert made.missing == made.gone == frozenset()


def test_what_is_missing_gets_its_default_or_zero_and_is_named():
    found, made = read("int64 n\nPart[] parts\n", "float64 x\n", n=7, parts=[{"x": 1.0}, {"x": 2.0}])
    zero = Whole(
        7, 0.0, 0, False, "", b"", Colour.RED, Part(0.0, 2.5), (Part(1.0, 2.5), Part(2.0, 2.5)), (0.0, 0.0, 0.0)
    )
    assert found == zero
    absent = {"force_N", "small", "good", "text", "blob", "colour", "part", "six", "parts.y"}
    assert made.missing == absent
    assert made.notes("/t") == [f"not compared, the log's /t does not hold it: {', '.join(sorted(absent))}"]


def test_a_field_of_another_kind_is_missing_here_and_gone_there():
    found, made = read(
        "float64 n\nint64 force_n\nint64[3] six\nfloat64[2] parts\n", n=1.0, force_n=2, six=(1, 2, 3), parts=(1.0, 2.0)
    )
    assert (found.n, found.force_N, found.six, found.parts) == (0, 0.0, (0.0, 0.0, 0.0), ())
    assert made.gone == {"n", "force_N", "six", "parts"}
    assert made.gone < made.missing


def test_a_wider_or_narrower_number_is_the_same_number():
    found, made = read("int32 n\nfloat32 force_n\nint64 small\n", n=-3, force_n=0.5, small=100)
    assert (found.n, found.force_N, found.small) == (-3, 0.5, 100)
    assert {"n", "force_N", "small"}.isdisjoint(made.missing)


def test_renamed_fields_and_earlier_values_up_to_their_format(monkeypatch):
    monkeypatch.setattr(log_format, "RENAMED_FIELDS", (RenamedField("push_msgs/msg/Part", "left", "x", 1),))
    monkeypatch.setattr(log_format, "EARLIER_VALUES", (EarlierValue("push_msgs/msg/Part", "y", 8.0, 1),))
    found, made = read("Part part\n", "float64 left\n", part={"left": 4.0})
    assert found.part == Part(4.0, 8.0)
    assert "part.x" not in made.missing
    assert made.gone == frozenset()
    found, made = read("Part part\n", "float64 left\n", 2, part={"left": 4.0})
    assert found.part == Part(0.0, 2.5)
    assert made.gone == {"part.left"}


def test_a_value_that_was_in_other_fields_is_made_of_them(monkeypatch):
    """Also in a part of the message, from what stood outside of that part."""
    monkeypatch.setattr(
        log_format,
        "COMPUTED_VALUES",
        (
            ComputedValue(NAME, "part.y", lambda message: message.scale * message.part.left, 1),
            ComputedValue("push_msgs/msg/Part", "x", lambda part: part.left + 1.0, 1),
            ComputedValue(NAME, "n", lambda message: 99, 1),
        ),
    )
    found, made = read("int64 n\nfloat64 scale\nPart part\n", "float64 left\n", n=7, scale=3.0, part={"left": 4.0})
    assert (found.n, found.part) == (7, Part(5.0, 12.0))  # n is there
    assert {"part.x", "part.y"}.isdisjoint(made.missing)
    assert made.gone == {"scale", "part.left"}
    found, made = read("Part part\nfloat64 scale\n", "float64 left\n", 2, scale=3.0, part={"left": 4.0})
    assert found.part == Part(0.0, 2.5)
    assert {"part.x", "part.y"} < made.missing


def test_what_is_no_such_message_is_damage():
    with pytest.raises(LogDamaged, match="where a push_msgs/msg/Whole is expected"):
        LoggedType(TODAY, "push_msgs/msg/Part", PART, 1)
    with pytest.raises(LogDamaged, match="cannot be read"):
        LoggedType(TODAY, NAME, "wstring n\n", 1)
    made = LoggedType(TODAY, NAME, text_of("int64 n\nint64 colour\nPart part\n"), 1)
    with pytest.raises(LogDamaged, match="payload of 3 bytes"):
        made.decode(b"\0\1\0")
    logged = type_from_schema(NAME, "int64 colour\n")
    made = LoggedType(TODAY, NAME, "int64 colour\n", 1)
    with pytest.raises(LogDamaged, match="means nothing"):
        made.decode(logged.encode(logged.struct_type(4)))


def test_the_first_format_said_nothing():
    assert format_of({}) == 1
    assert format_of({"format": "1"}) == 1
    assert format_of({"format": "2"}) == 2
    assert format_of({"format": "5"}) == 5
    with pytest.raises(UsageError, match="format 6"):
        format_of({"format": "6"})
