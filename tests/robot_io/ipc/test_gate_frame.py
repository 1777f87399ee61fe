"""The frame from control to gate: its bytes, and that nothing damaged is taken for one."""

import math
import struct
import zlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot_io.ipc.gate_frame import FRAME_BYTES, GateFrame, pack_frame, unpack_frame
from robot_io.messages import BodyTwist

FRAME = GateFrame(258, 1000, 123_456_789_012, 2, BodyTwist(0.1, -0.05, 0.025))


def test_the_bytes_are_those_of_the_layout():
    body = (
        b"PUSH" + b"\x01\x00" + b"\x02\x00" + b"\x02\x01\0\0\0\0\0\0" + b"\xe8\x03\0\0\0\0\0\0"
        + (123_456_789_012).to_bytes(8, "little") + struct.pack("<3d", 0.1, -0.05, 0.025)
    )  # fmt: skip
    assert pack_frame(FRAME) == body + zlib.crc32(body).to_bytes(4, "little")
    assert len(pack_frame(FRAME)) == FRAME_BYTES == 60


number = st.floats(allow_nan=False)


@given(
    st.integers(0, 2**64 - 1), st.integers(0, 2**64 - 1), st.integers(-(2**63), 2**63 - 1), st.integers(0, 65535),
    number, number, number,
)  # fmt: skip
def test_what_goes_in_comes_out(seq, tick, sent_ns, mode, vx, vy, omega):
    frame = GateFrame(seq, tick, sent_ns, mode, BodyTwist(vx, vy, omega))
    assert unpack_frame(pack_frame(frame)) == frame


def test_what_is_no_number_comes_out_as_it_is_for_the_gate_to_judge():
    frame = unpack_frame(pack_frame(GateFrame(1, 1, 1, 0, BodyTwist(math.nan, math.inf, -math.inf))))
    assert math.isnan(frame.twist.vx)
    assert (frame.twist.vy, frame.twist.omega) == (math.inf, -math.inf)


def test_one_wrong_bit_anywhere_is_no_frame():
    good = pack_frame(FRAME)
    for bit in range(8 * len(good)):
        bad = bytearray(good)
        bad[bit // 8] ^= 1 << bit % 8
        assert unpack_frame(bytes(bad)) is None


@pytest.mark.parametrize("payload", [b"", b"P", pack_frame(FRAME)[:-1], pack_frame(FRAME) + b"\0", b"\0" * 60])
def test_another_length_or_nothing_is_no_frame(payload):
    assert unpack_frame(payload) is None


@pytest.mark.parametrize("head", [b"PUSH\x02\x00", b"PULL\x01\x00"])
def test_another_magic_or_version_is_no_frame_though_its_sum_is_right(head):
    body = head + pack_frame(FRAME)[6:-4]
    assert unpack_frame(body + zlib.crc32(body).to_bytes(4, "little")) is None
