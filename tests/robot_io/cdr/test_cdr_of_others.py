"""Payloads as others write them: by rosbags, by mcap-ros2-support, and by hand from the rules of the OMG."""

from __future__ import annotations

import struct
from typing import Any

import msgspec
import numpy as np
import pytest
from mcap_ros2._dynamic import serialize_dynamic
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.stores.ros2_humble import (
    builtin_interfaces__msg__Time as Time,
)
from rosbags.typesys.stores.ros2_humble import (
    sensor_msgs__msg__JointState as JointState,
)
from rosbags.typesys.stores.ros2_humble import (
    std_msgs__msg__Header as Header,
)

from robot_io.cdr.of_others import ReaderOfOthers
from robot_io.cdr.schema import shape_from_schema
from robot_io.errors import LogDamaged

LITTLE = b"\x00\x01\x00\x00"
BIG = b"\x00\x00\x00\x00"
STORE = get_typestore(Stores.ROS2_HUMBLE)


def read(text: str, payload: bytes) -> Any:
    return ReaderOfOthers("p/msg/T", shape_from_schema("p/msg/T", text)).decode(payload)


@pytest.mark.parametrize("little_endian", [True, False])
def test_a_message_by_rosbags_in_either_byte_order(little_endian):
    wanted = JointState(
        Header(Time(7, 9), "base"),
        ["a", "bcd"],
        np.array([0.5, -2.0]),
        np.array([], np.float64),
        np.array([1e300]),
    )
    payload = bytes(STORE.serialize_cdr(wanted, JointState.__msgtype__, little_endian=little_endian))
    assert payload[:2] == (b"\x00\x01" if little_endian else b"\x00\x00")
    text, _ = STORE.generate_msgdef(JointState.__msgtype__, ros_version=2)
    value = ReaderOfOthers(JointState.__msgtype__, shape_from_schema(JointState.__msgtype__, text)).decode(payload)
    assert (value.header.stamp.sec, value.header.stamp.nanosec, value.header.frame_id) == (7, 9, "base")
    assert value.name == ("a", "bcd")
    assert (value.position, value.velocity, value.effort) == ((0.5, -2.0), (), (1e300,))


EVERYTHING = """bool yes
byte raw
char letter
int8 a
uint8 b
int16 c
uint16 d
int32 e
uint32 f
int64 g
uint64 h
float32 i
float64 j
string text
int16[3] fixed
float64[] many
char[] letters
p/Pair[] pairs
string[2] words
================================================================================
MSG: p/Pair
uint8 x
float64 y
"""
VALUES = {
    "yes": True,
    "raw": 255,
    "letter": 65,
    "a": -1,
    "b": 200,
    "c": -300,
    "d": 60000,
    "e": -70000,
    "f": 4000000000,
    "g": -(2**62),
    "h": 2**63,
    "i": 0.5,
    "j": -0.125,
    "text": "grüß",
    "fixed": [1, -2, 3],
    "many": [1.5, 2.5],
    "letters": [104, 105],
    "pairs": [{"x": 1, "y": 2.0}, {"x": 3, "y": 4.0}],
    "words": ["", "b"],
}


def test_a_message_of_every_type_by_mcap_ros2_support():
    encode = serialize_dynamic("p/msg/T", EVERYTHING)["p/msg/T"]
    assert msgspec.to_builtins(read(EVERYTHING, encode(VALUES)), builtin_types=()) == {
        name: tuple(value) if isinstance(value, list) else value for name, value in VALUES.items()
    }


@pytest.mark.parametrize("padding", [b"", b"\x00", b"\x00\x00", b"\x00\x00\x00", b"\xcd\xcd"])
@pytest.mark.parametrize("options", [b"\x00\x00", b"\x00\x02", b"\x00\x03"])
def test_padding_behind_a_message_is_no_part_of_it(padding, options):
    """A middleware fills up to a multiple of four; the options may say by how much (DDS-XTypes 1.3, 7.6.3.1.2)."""
    assert read("string data", b"\x00\x01" + options + struct.pack("<I", 6) + b"hello\x00" + padding).data == "hello"


def test_more_than_padding_is_another_type():
    with pytest.raises(LogDamaged, match="4 bytes too many"):
        read("string data", LITTLE + struct.pack("<I", 6) + b"hello\x00" + bytes(4))


def test_padding_between_fields_has_any_value():
    """The standard leaves its value open; a writer that only steps over it leaves what was there before."""
    value = read("uint8 a\nfloat64 b", LITTLE + b"\x07" + b"\xcd" * 7 + struct.pack("<d", 1.25))
    assert (value.a, value.b) == (7, 1.25)


@pytest.mark.parametrize(("head", "order"), [(LITTLE, "<"), (BIG, ">")])
def test_a_wstring_as_ros_2_writes_it(head, order):
    """rosidl_typesupport_fastrtps and rmw_cyclonedds: a count, then each UTF-16 unit in four bytes; no NUL."""
    units = [0x48, 0xFC, 0xD83D, 0xDE00]  # the last two are one character
    payload = head + b"\x01" + bytes(3) + struct.pack(f"{order}I4I", 4, *units) + b"\x05"
    value = read("uint8 a\nwstring text\nuint8 b", payload)
    assert (value.a, value.text, value.b) == (1, "Hü\U0001f600", 5)
    assert read("wstring<=9 text", head + struct.pack(f"{order}I", 0)).text == ""


def test_a_wstring_of_two_bytes_a_character_is_not_misread():
    payload = LITTLE + struct.pack("<I", 4) + "abcdefgh".encode("utf-16-le")
    with pytest.raises(LogDamaged, match="not four bytes each"):
        read("wstring text", payload)


def test_a_string_of_length_0_is_empty():
    assert read("string a\nuint8 b", LITTLE + struct.pack("<IB", 0, 7)).b == 7


def test_an_empty_message_with_its_byte_and_without():
    values = [msgspec.to_builtins(read("# nothing", payload)) for payload in (LITTLE, LITTLE + b"\x00")]
    assert values == [{"structure_needs_at_least_one_member": 0}] * 2


@pytest.mark.parametrize(
    ("head", "word"),
    [
        (b"\x00\x02", "PL_CDR"),
        (b"\x00\x03", "PL_CDR"),
        (b"\x00\x06", "XCDR2"),
        (b"\x00\x07", "XCDR2"),
        (b"\x00\x09", "delimited"),
        (b"\x00\x0b", "PL_CDR2"),
        (b"\x00\x11", "XCDR2"),
        (b"\x00\x04", "XML"),
        (b"{}", "7b 7d"),
        (b"\x00", "too short"),
        (b"", "too short"),
    ],
)
def test_other_forms_are_refused_by_name(head, word):
    with pytest.raises(LogDamaged, match=word):
        read("float64 x", head + bytes(10) if len(head) == 2 else head)


@pytest.mark.parametrize(
    ("text", "body"),
    [
        ("bool x", b"\x02"),
        ("bool[] x", struct.pack("<I", 2) + b"\x01\x02"),
        ("string x", struct.pack("<I", 2) + b"ab"),
        ("string x", struct.pack("<I", 3) + b"\xff\xfe\x00"),
        ("wstring x", struct.pack("<II", 1, 0xD800)),
        ("float64 x", bytes(7)),
        ("float64[] x", struct.pack("<I", 2**32 - 1) + bytes(100)),
        ("string[] x", struct.pack("<I", 2**32 - 1) + bytes(100)),
        ("wstring[] x", struct.pack("<I", 2**32 - 1) + bytes(100)),
        ("wstring x", struct.pack("<I", 2**32 - 1) + bytes(100)),
        ("string[4000000000] x", bytes(100)),
        ("float64[4000000000] x", bytes(100)),
        ("p/E[] x\n===\nMSG: p/E\n", struct.pack("<I", 2**32 - 1) + bytes(100)),
    ],
)
def test_hostile_payloads_are_one_error_and_cost_nothing(text, body):
    with pytest.raises(LogDamaged, match="is not a p/msg/T"):
        read(text, LITTLE + body)


@pytest.mark.parametrize("name", ["class", "from", "K", "match", "count", "index"])
def test_fields_of_any_name(name):
    assert msgspec.to_builtins(read(f"uint8 {name}", LITTLE + b"\x03")) == {name: 3}


def test_a_schema_with_windows_line_ends():
    assert read("p/E x\r\n=====\r\nMSG: p/E\r\nuint8 a\r\n", LITTLE + b"\x03").x.a == 3


def test_a_missing_definition_is_named():
    with pytest.raises(LogDamaged, match="std_msgs/Header is not defined in it"):
        shape_from_schema("p/msg/T", "std_msgs/Header header")
