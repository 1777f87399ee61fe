"""The CDR codec against hand-computed bytes, against two independent codecs, and against rubbish."""

from __future__ import annotations

import dataclasses
import math
import random
import struct
from enum import IntEnum
from typing import Annotated, ClassVar

import msgspec
import pytest
from mcap_ros2._dynamic import generate_dynamic, serialize_dynamic
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from robot_io.cdr.cdr_type import CdrType
from robot_io.errors import LogDamaged
from robot_io.log import ros_messages as ros
from robot_io.messages import SensorWrench, Stamped


class Colour(IntEnum):
    RED = 1
    BLUE = 7


class Small(msgspec.Struct, frozen=True, gc=False):
    flag: bool
    count: Annotated[int, "uint16"]
    gain: float
    name: str
    ratio: Annotated[float, "float32"]
    values: tuple[float, ...]


class Inner(msgspec.Struct, frozen=True, gc=False):
    __ros_name__: ClassVar[str] = "other_msgs/msg/Inner"
    small: Annotated[int, "int8"]
    text: str


class Everything(msgspec.Struct, frozen=True, gc=False):
    crc: Annotated[int, "uint32"]
    spare: Annotated[int, "uint32"]
    colour: Colour
    narrow_colour: Annotated[Colour, "uint8"]
    text: str
    joints: tuple[float, float, float, float, float, float]
    flags: tuple[bool, bool, bool]
    samples: tuple[Stamped[SensorWrench], ...]
    inner: Inner
    pair: tuple[Inner, Inner]
    names: tuple[str, ...]
    colours: tuple[Colour, ...]
    shorts: tuple[Annotated[int, "int16"], ...]
    blob: bytes
    halves: Annotated[tuple[Annotated[float, "float32"], ...], 4]
    tail: bool


SMALL = CdrType(Small, "push_msgs/msg/Small")
EVERYTHING = CdrType(Everything, "push_msgs/msg/Everything")


def everything(rng: random.Random) -> Everything:
    def text() -> str:
        return "".join(rng.choice("abcxyz_ \N{GREEK SMALL LETTER THETA}") for _ in range(rng.randrange(9)))

    def inner() -> Inner:
        return Inner(rng.randrange(-128, 128), text())

    def number() -> float:
        return rng.choice((rng.gauss(0, 1e3), 0.0, -0.0, math.inf, -math.inf, 5e-324))

    def some(make) -> tuple:
        return tuple(make() for _ in range(rng.randrange(4)))

    return Everything(
        rng.getrandbits(32),
        rng.getrandbits(32),
        rng.choice(tuple(Colour)),
        rng.choice(tuple(Colour)),
        text(),
        tuple(number() for _ in range(6)),
        tuple(rng.random() < 0.5 for _ in range(3)),
        some(
            lambda: Stamped(
                SensorWrench(*(number() for _ in range(6))),
                rng.getrandbits(40),
                -rng.getrandbits(50),
                number(),
            )
        ),
        inner(),
        (inner(), inner()),
        some(text),
        some(lambda: rng.choice(tuple(Colour))),
        some(lambda: rng.randrange(-32768, 32768)),
        rng.randbytes(rng.randrange(12)),
        tuple(rng.randrange(-1000, 1000) / 8 for _ in range(4)),
        rng.random() < 0.5,
    )


def test_bytes_of_a_small_message_computed_by_hand():
    payload = SMALL.encode(Small(True, 0x0102, 1.0, "ab", -2.0, (0.5,)))
    expected = bytes.fromhex(
        "00010000"  # plain CDR, little-endian
        "01 00 0201 00000000"  # bool, 1 pad, uint16 at 2, 4 pad
        "000000000000f03f"  # float64 1.0 at 8
        "03000000 616200 00"  # at 16: three bytes with the NUL, then 1 pad
        "000000c0"  # float32 -2.0 at 24
        "01000000"  # one element at 28
        "000000000000e03f"  # 0.5 at 32, no pad
    )
    assert payload == expected
    assert SMALL.decode(expected) == Small(True, 0x0102, 1.0, "ab", -2.0, (0.5,))


def test_an_empty_sequence_has_no_padding_behind_its_count():
    assert SMALL.encode(Small(False, 0, 0.0, "", 0.0, ()))[4:] == bytes(16) + bytes.fromhex(
        "01000000 00 000000 00000000 00000000"
    )


def test_everything_survives_the_way_out_and_back():
    rng = random.Random(1)
    for _ in range(300):
        value = everything(rng)
        payload = EVERYTHING.encode(value)
        back = EVERYTHING.decode(payload)
        assert back == value
        assert isinstance(back.colour, Colour)
        assert EVERYTHING.encode(back) == payload


def test_everything_reads_the_same_in_two_other_decoders():
    rng = random.Random(2)
    mcap_ros2 = generate_dynamic(EVERYTHING.name, EVERYTHING.schema_text)[EVERYTHING.name]
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(EVERYTHING.schema_text, EVERYTHING.name))
    for _ in range(60):
        value = everything(rng)
        payload = EVERYTHING.encode(value)
        assert plain(mcap_ros2(payload)) == plain(value)
        foreign = store.deserialize_cdr(payload, EVERYTHING.name)
        assert plain(foreign) == plain(value)
        assert bytes(store.serialize_cdr(foreign, EVERYTHING.name)) == payload


def plain(value):
    """The same plain lists for our Structs, rosbags' dataclasses and mcap-ros2-support's slotted objects."""
    names = getattr(value, "__struct_fields__", None) or getattr(value, "__slots__", None)
    if names is None and dataclasses.is_dataclass(value):
        names = [
            field.name
            for field in dataclasses.fields(value)
            if not (field.name.isupper() or field.name.startswith("__"))
        ]
    if names is not None:
        return [plain(getattr(value, name)) for name in names]
    if isinstance(value, str):
        return value
    if hasattr(value, "__len__"):
        return [plain(item) for item in value]
    return float(value)  # every number in these tests is exact as a double


HEADER = ros.Header(ros.Time(-5, 999_999_999), "world")
POSE = ros.Pose(ros.Point(1.5, -2.5, 0.25), ros.Quaternion(0.1, 0.2, 0.3, 0.9))
TWIST = ros.Twist(ros.Vector3(0.1, 0.2, 0.3), ros.Vector3(-1.0, -2.0, -3.0))
STANDARD = [
    (ros.STRING, ros.String("line\nline")),
    (ros.POSE_STAMPED, ros.PoseStamped(HEADER, POSE)),
    (ros.TWIST_STAMPED, ros.TwistStamped(HEADER, TWIST)),
    (ros.WRENCH_STAMPED, ros.WrenchStamped(HEADER, ros.Wrench(TWIST.linear, TWIST.angular))),
    (ros.JOINT_STATE, ros.JointState(HEADER, ("shoulder", "elbow"), (1.0, 2.0), (0.5, -0.5), ())),
    (ros.JOINT_STATE, ros.JointState(HEADER, (), (), (), ())),
    (
        ros.ODOMETRY,
        ros.Odometry(
            HEADER,
            "base_link",
            ros.PoseWithCovariance(POSE, tuple(float(i) for i in range(36))),
            ros.TwistWithCovariance(TWIST, (0.0,) * 36),
        ),
    ),
    (ros.PATH, ros.Path(HEADER, (ros.PoseStamped(HEADER, POSE),) * 3)),
    (
        ros.TF_MESSAGE,
        ros.TFMessage(
            (ros.TransformStamped(HEADER, "ball", ros.Transform(ros.Vector3(1.0, 2.0, 3.0), POSE.orientation)),) * 2
        ),
    ),
    (ros.LOG, ros.Log(HEADER.stamp, 30, "safety", "force lost", "supervisor.py", "supervise", 77)),
    (
        ros.DIAGNOSTIC_ARRAY,
        ros.DiagnosticArray(
            HEADER, (ros.DiagnosticStatus(2, "ft300", "no frames", "ttyUSB0", (ros.KeyValue("crc_errors", "3"),)),)
        ),
    ),
]


@pytest.mark.parametrize(("cdr_type", "value"), STANDARD, ids=lambda part: getattr(part, "name", ""))
def test_standard_types_are_byte_exact_to_rosbags_own_definitions_and_to_mcap_ros2(cdr_type, value):
    payload = cdr_type.encode(value)
    humble = get_typestore(Stores.ROS2_HUMBLE)
    foreign = humble.deserialize_cdr(payload, cdr_type.name)
    assert plain(foreign) == plain(value)
    assert bytes(humble.serialize_cdr(foreign, cdr_type.name)) == payload
    from_schema = get_types_from_msg(cdr_type.schema_text, cdr_type.name)
    for name, (_, fields) in from_schema.items():
        assert fields == humble.fielddefs[name][1], name
    decoded = generate_dynamic(cdr_type.name, cdr_type.schema_text)[cdr_type.name](payload)
    assert plain(decoded) == plain(value)
    assert bytes(serialize_dynamic(cdr_type.name, cdr_type.schema_text)[cdr_type.name](decoded)) == payload
    assert cdr_type.decode(payload) == value


def test_every_bit_of_a_double_survives():
    rng = random.Random(3)
    doubles = [0x7FF0000000000001, 0xFFF8000000000123, 0x8000000000000000, 1] + [
        rng.getrandbits(64) for _ in range(500)
    ]
    for bits in doubles:
        payload = SMALL.encode(Small(False, 0, struct.unpack("<d", struct.pack("<Q", bits))[0], "", 0.0, ()))
        assert payload[12:20] == struct.pack("<Q", bits)
        assert SMALL.encode(SMALL.decode(payload)) == payload


def test_rubbish_is_refused_or_reads_as_exactly_itself():
    rng = random.Random(4)
    payload = EVERYTHING.encode(everything(rng))
    refused = 0
    for _ in range(3000):
        damaged = bytearray(payload)
        for _ in range(rng.randrange(1, 4)):
            damaged[rng.randrange(len(damaged))] ^= 1 << rng.randrange(8)
        try:
            value = EVERYTHING.decode(bytes(damaged))
        except LogDamaged:
            refused += 1
        else:
            assert EVERYTHING.encode(value) == bytes(damaged)
    assert refused > 500
    for end in range(len(payload)):
        with pytest.raises(LogDamaged):
            EVERYTHING.decode(payload[:end])
    with pytest.raises(LogDamaged, match="left over"):
        EVERYTHING.decode(payload + b"\x00")


class Flags(msgspec.Struct, frozen=True):
    """Bools in a row: not a byte of padding between them, wherever they begin."""

    text: str
    one: bool
    two: bool
    last: Annotated[int, "uint8"]


class Switches(msgspec.Struct, frozen=True):
    """Bools and nothing else."""

    one: bool
    two: bool


def test_a_bool_of_two_among_bools_alone_is_refused():
    switches = CdrType(Switches, "push_msgs/msg/Switches")
    assert switches.decode(b"\0\1\0\0\1\0") == Switches(True, False)
    for payload in (b"\0\1\0\0\2\0", b"\0\1\0\0\1\xff"):
        with pytest.raises(LogDamaged):
            switches.decode(payload)


class Padded(msgspec.Struct, frozen=True):
    """Padding and no bool: 0 to 7 bytes before the double, by the length of the text."""

    text: str
    byte: Annotated[int, "uint8"]
    number: float


@pytest.mark.parametrize("length", range(8))
def test_a_bool_of_two_and_padding_that_is_not_zero_are_refused_wherever_they_stand(length):
    """CDR knows bools of 0 and 1 and says nothing of padding; a log reads as exactly what would be written again."""
    flags, padded = CdrType(Flags, "push_msgs/msg/Flags"), CdrType(Padded, "push_msgs/msg/Padded")
    payload = flags.encode(Flags("x" * length, True, False, 7))
    for at in (-3, -2):
        with pytest.raises(LogDamaged):
            flags.decode(payload[:at] + b"\x02" + payload[at + 1 :])
    payload = padded.encode(Padded("x" * length, 7, 1.5))
    padding = len(payload) - 4 - (4 + length + 1) - 1 - 8
    assert 0 <= padding < 8
    for at in range(-8 - padding, -8):
        with pytest.raises(LogDamaged):
            padded.decode(payload[:at] + b"\x01" + payload[at + 1 :])


def test_a_huge_count_is_refused_before_anything_is_made():
    payload = bytearray(SMALL.encode(Small(False, 0, 0.0, "", 0.0, (1.0,))))
    payload[-12:-8] = b"\xff\xff\xff\xff"
    with pytest.raises(LogDamaged, match="cannot fit"):
        SMALL.decode(bytes(payload))


def test_big_endian_and_unknown_enum_values_are_refused():
    payload = bytearray(EVERYTHING.encode(everything(random.Random(5))))
    with pytest.raises(LogDamaged, match="little-endian"):
        EVERYTHING.decode(b"\x00\x00" + bytes(payload[2:]))
    payload[12] = 2
    with pytest.raises(LogDamaged, match="Colour"):
        EVERYTHING.decode(bytes(payload))


@pytest.mark.parametrize(
    "value",
    [
        Small(True, 70000, 0.0, "", 0.0, ()),
        Small(True, 0, "x", "", 0.0, ()),
        Small(True, 0, 0.0, None, 0.0, ()),
        Small(True, 0, 0.0, "\ud800", 0.0, ()),
    ],
)
def test_values_that_do_not_fit_are_a_value_error_that_names_the_type(value):
    with pytest.raises(ValueError, match="push_msgs/msg/Small"):
        SMALL.encode(value)


def test_fixed_arrays_must_have_their_length():
    value = everything(random.Random(6))
    with pytest.raises(ValueError, match="array of 5 elements instead of 6"):
        EVERYTHING.encode(msgspec.structs.replace(value, joints=(1.0,) * 5))
    with pytest.raises(ValueError, match="array of 1 elements instead of 2"):
        EVERYTHING.encode(msgspec.structs.replace(value, pair=value.pair[:1]))


class WithDict(msgspec.Struct):
    counters: dict[str, int]


class WithMixedTuple(msgspec.Struct):
    pair: tuple[int, str]


class WithWrongWidth(msgspec.Struct):
    x: Annotated[float, "int32"]


class Empty(msgspec.Struct):
    pass


class WithUnitInName(msgspec.Struct):
    force_N: float
    pose_m: float


class SameNameInRos(msgspec.Struct):
    f_n: float
    f_N: float


class Underscore(msgspec.Struct):
    from_: float


def test_field_names_are_lower_case_in_the_schema_because_other_parsers_insist():
    cdr_type = CdrType(WithUnitInName, "push_msgs/msg/WithUnitInName")
    assert cdr_type.schema_text == "float64 force_n\nfloat64 pose_m\n"
    decode = generate_dynamic(cdr_type.name, cdr_type.schema_text)[cdr_type.name]
    assert decode(cdr_type.encode(WithUnitInName(2.5, 1.0))).force_n == 2.5


@pytest.mark.parametrize("bad", [WithDict, WithMixedTuple, WithWrongWidth, Empty, SameNameInRos, Underscore])
def test_types_without_a_ros_form_are_refused_when_declared(bad):
    with pytest.raises(TypeError):
        CdrType(bad, "push_msgs/msg/Bad")
