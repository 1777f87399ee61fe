"""A type that has read messages of a length before reads every other one as a type that has read none."""

from __future__ import annotations

import random
from enum import IntEnum
from typing import Annotated

import msgspec
import pytest

from robot_io.cdr.cdr_type import CdrType
from robot_io.cdr.known_form import KnownForm
from robot_io.cdr.parts import Layout
from robot_io.errors import LogDamaged


class Colour(IntEnum):
    RED = 1
    BLUE = 7


class Row(msgspec.Struct, frozen=True):
    number: float
    flags: tuple[bool, bool]
    colour: Annotated[Colour, "uint8"]


class Part(msgspec.Struct, frozen=True):
    byte: Annotated[int, "uint8"]
    doubles: tuple[float, ...]


class Message(msgspec.Struct, frozen=True):
    flag: bool
    rows: tuple[Row, ...]
    name: str
    shorts: tuple[Annotated[int, "int16"], ...]
    switches: tuple[bool, ...]
    part: Part
    names: tuple[str, ...]
    colours: tuple[Colour, ...]
    parts: tuple[Part, ...]
    last: Annotated[int, "uint8"]


def fresh() -> CdrType[Message]:
    return CdrType(Message, "push_msgs/msg/Message")


def message(rng: random.Random, *, lists: int = 0) -> Message:
    def part() -> Part:
        return Part(rng.randrange(256), tuple(rng.gauss(0.0, 1.0) for _ in range(rng.randrange(3))))

    def some(make, most: int) -> tuple:
        return tuple(make() for _ in range(rng.randrange(most + 1)))

    def flag() -> bool:
        return rng.random() < 0.5

    return Message(
        flag(),
        some(lambda: Row(rng.gauss(0.0, 1.0), (flag(), flag()), rng.choice(tuple(Colour))), 2),
        "x\N{GREEK SMALL LETTER THETA}yz"[: rng.randrange(5)],
        some(lambda: rng.randrange(-9, 9), 3),
        some(flag, 3),
        part(),
        some(lambda: "ab", lists),
        some(lambda: rng.choice(tuple(Colour)), 2),
        some(part, lists),
        rng.randrange(256),
    )


def read(cdr_type: CdrType[Message], payload: bytes) -> Message | str:
    try:
        return cdr_type.decode(payload)
    except LogDamaged as error:
        return str(error)


@pytest.mark.parametrize("lists", [0, 2])
def test_what_was_read_before_changes_nothing(lists):
    rng = random.Random(lists)
    writer, known = fresh(), fresh()
    for _ in range(150):
        payload = writer.encode(message(rng, lists=lists))
        assert read(known, payload) == read(fresh(), payload) == writer.decode(payload)


def test_a_spoilt_message_is_refused_in_the_same_words_or_read_as_the_same():
    rng = random.Random(7)
    refused = 0
    for _ in range(12):
        known = fresh()
        payload = known.encode(message(rng))
        for _ in range(3):
            assert known.encode(known.decode(payload)) == payload
        for _ in range(25):
            spoilt = bytearray(payload)
            for _ in range(rng.randrange(1, 4)):
                spoilt[rng.randrange(len(spoilt))] ^= 1 << rng.randrange(8)
            found = read(known, bytes(spoilt))
            assert found == read(fresh(), bytes(spoilt))
            refused += isinstance(found, str)
    assert 60 < refused < 295  # of 300: both happen


def test_other_counts_in_as_many_bytes_are_read_as_they_are():
    """Two numbers of 2 bytes and four bools fill as much as one number and six bools, say."""
    cdr_type = fresh()
    for _ in range(3):
        for shorts, switches in (((1, 2), (True,) * 4), ((3,), (False,) * 6), ((), (True,) * 8)):
            value = Message(True, (), "", shorts, switches, Part(1, ()), (), (), (), 2)
            assert cdr_type.decode(cdr_type.encode(value)) == value


def test_a_form_is_made_once_and_those_of_one_length_may_take_turns(monkeypatch):
    made = []
    monkeypatch.setattr("robot_io.cdr.parts.KnownForm", lambda *parts: made.append(parts) or KnownForm(*parts))
    cdr_type = fresh()
    turns = [
        cdr_type.encode(Message(True, (), "", shorts, switches, Part(1, ()), (), (), (), 2))
        for shorts, switches in (((1, 2), (True,) * 4), ((3,), (False,) * 6), ((), (True,) * 8))
    ]
    assert len({len(payload) for payload in turns}) == 1
    for _ in range(9):
        for payload in turns:
            cdr_type.decode(payload)
    assert len(made) == 3


def test_of_one_length_only_a_few_forms_are_made_and_none_twice_that_cannot_be(monkeypatch):
    tries = []
    form = Layout._form
    monkeypatch.setattr(Layout, "_form", lambda *args: tries.append(args) or form(*args))
    cdr_type = fresh()
    without = [Message(True, (), "", (), (True,) * n, Part(1, ()), ("ab",), (), (), 2) for n in (0, 1, 2, 3, 4)]
    for _ in range(9):
        for value in without:
            payload = cdr_type.encode(value)
            assert cdr_type.decode(payload) == value
    lengths = {len(cdr_type.encode(value)) for value in without}
    assert len(tries) <= 4 * len(lengths)


def test_a_string_that_lost_its_end_is_refused_by_a_type_that_knows_its_length():
    cdr_type = fresh()
    payload = cdr_type.encode(Message(True, (), "abc", (), (), Part(1, ()), (), (), (), 2))
    for _ in range(3):
        cdr_type.decode(payload)
    with pytest.raises(LogDamaged, match="a string without its terminator"):
        cdr_type.decode(payload.replace(b"abc\0", b"abcd"))
    with pytest.raises(LogDamaged, match="utf-8"):
        cdr_type.decode(payload.replace(b"abc\0", b"\xff\xff\xff\0"))
