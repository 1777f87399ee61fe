"""The driver's stream parser against packets computed by hand from Robotiq's manual, and against any bytes at all."""

from __future__ import annotations

import random
import struct

import crcmod.predefined
import libscrc
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot_io.ft300.codec import (
    StreamParser,
    beyond_range,
    counts_from_registers,
    crc16_modbus,
    firmware_text,
    serial_text,
    wrench_from_counts,
)

PACKETS = {
    "all zero": ("20 4E 00 00 00 00 00 00 00 00 00 00 00 00 62 AF", (0, 0, 0, 0, 0, 0)),
    "a wrench": ("20 4E D2 04 D2 E9 10 27 64 00 32 FB 8A 0C 0C 17", (1234, -5678, 10000, 100, -1230, 3210)),
    "a real sensor at rest": (
        "20 4E EC F7 93 08 FA EC 9F FF 94 04 BF FE 4F 8B",
        (-2068, 2195, -4870, -97, 1172, -321),
    ),
    "header inside payload, Fx 200 N": (
        "20 4E 20 4E D2 E9 10 27 64 00 32 FB 8A 0C C2 C8",
        (20000, -5678, 10000, 100, -1230, 3210),
    ),
    "header across fields, Fx 82 N Fy 0.78 N": (
        "20 4E 08 20 4E 00 10 27 64 00 32 FB 8A 0C 0D 97",
        (8200, 78, 10000, 100, -1230, 3210),
    ),
    "bytes a terminal would act on": (
        "20 4E 0D 0A 11 13 FF FF 03 1A 1C 7F 0A 0D CF 13",
        (0x0A0D, 0x1311, -1, 0x1A03, 0x7F1C, 0x0D0A),
    ),
    "full range": ("20 4E 30 75 D0 8A 30 75 30 75 D0 8A 30 75 E1 08", (30000, -30000, 30000, 30000, -30000, 30000)),
}
FRAMES = [(bytes.fromhex(text), counts) for text, counts in PACKETS.values()]
GOOD = FRAMES[1]


@pytest.mark.parametrize(("frame", "counts"), FRAMES, ids=list(PACKETS))
def test_a_packet_is_found_at_every_split_point(frame, counts):
    for split in range(len(frame) + 1):
        parser = StreamParser()
        assert parser.feed(frame[:split]) + parser.feed(frame[split:]) == [counts]
        assert (parser.packets_ok, parser.crc_fail, parser.junk_bytes, parser.resyncs) == (1, 0, 0, 0)


@pytest.mark.parametrize(("frame", "counts"), FRAMES, ids=list(PACKETS))
@pytest.mark.parametrize("cut", range(1, 16))
def test_a_stream_joined_inside_a_packet_loses_only_that_packet(frame, counts, cut):
    parser = StreamParser()
    found = parser.feed(frame[cut:] + frame + frame + GOOD[0])
    assert found == [counts, counts, GOOD[1]]
    assert parser.junk_bytes == 16 - cut


def test_bytes_one_by_one_and_all_at_once_give_the_same():
    stream = b"".join(frame for frame, _ in FRAMES)
    parser = StreamParser()
    one_by_one = [counts for byte in stream for counts in parser.feed(bytes([byte]))]
    assert one_by_one == [counts for _, counts in FRAMES]
    assert StreamParser().feed(stream) == one_by_one


def test_a_lone_first_header_byte_is_kept_over_garbage():
    parser = StreamParser()
    assert parser.feed(b"\x01\x02\x20") == []
    assert parser.pending_bytes == 1
    assert parser.feed(GOOD[0][1:]) == [GOOD[1]]
    assert parser.junk_bytes == 2


def test_every_third_packet_corrupt_costs_exactly_those():
    bad = bytearray(FRAMES[3][0])  # with a header in its payload: it fails twice, and is one resync
    bad[9] ^= 0x10
    parser = StreamParser()
    found = parser.feed((GOOD[0] + GOOD[0] + bytes(bad)) * 20 + GOOD[0])
    assert found == [GOOD[1]] * 41
    assert parser.resyncs == 20
    assert parser.crc_fail == 40
    assert parser.junk_bytes == 320


@pytest.mark.parametrize("position", range(16))
def test_every_flipped_bit_is_refused_and_the_next_packet_survives(position):
    for bit in range(8):
        bad = bytearray(GOOD[0])
        bad[position] ^= 1 << bit
        assert StreamParser().feed(bytes(bad) + GOOD[0]) == [GOOD[1]]


def test_a_dropped_or_inserted_byte_costs_one_packet():
    for at in range(16):
        short = GOOD[0][:at] + GOOD[0][at + 1 :]
        long = GOOD[0][:at] + b"\x20" + GOOD[0][at:]
        assert StreamParser().feed(short + GOOD[0])[-1:] == [GOOD[1]]
        assert StreamParser().feed(long + GOOD[0])[-1:] == [GOOD[1]]
    assert StreamParser().feed(GOOD[0][:7] + GOOD[0][8:] + GOOD[0] * 2) == [GOOD[1]] * 2


def test_a_flood_of_garbage_keeps_the_buffer_small_and_the_packet_behind_it():
    noise = random.Random(7).randbytes(10_000)
    for flood in (noise, b"\x20\x4e" * 5_000, b"\x20" * 10_000, b"\xff" * 10_000):
        parser = StreamParser()
        assert parser.feed(flood) == []
        assert parser.pending_bytes <= 15
        assert parser.feed(b"\x00" * 16 + GOOD[0]) == [GOOD[1]]
        assert parser.junk_bytes == len(flood) + 16
        assert parser.resyncs == 1


def test_the_byte_order_of_the_stream_is_not_that_of_the_registers():
    registers = counts_from_registers([0x04D2, 0xE9D2, 0x2710, 0x0064, 0xFB32, 0x0C8A])
    assert registers == GOOD[1] == StreamParser().feed(GOOD[0])[0]
    swapped = struct.pack(">6h", *GOOD[1])
    other = b"\x20\x4e" + swapped
    other += crc16_modbus(other).to_bytes(2, "little")
    assert StreamParser().feed(other) != [GOOD[1]]
    crc_swapped = GOOD[0][:14] + GOOD[0][:13:-1]
    assert StreamParser().feed(crc_swapped) == []


def test_counts_become_newtons_and_newton_metres():
    wrench = wrench_from_counts(GOOD[1])
    assert (wrench.fx, wrench.fy, wrench.fz) == (12.34, -56.78, 100.0)
    assert (wrench.mx, wrench.my, wrench.mz) == (0.1, -1.23, 3.21)


def test_beyond_range_is_more_than_300_newton_or_30_newton_metre():
    assert not beyond_range((30000, -30000, 30000, 30000, -30000, 30000))
    for axis in range(6):
        for value in (30001, -30001):
            counts = [0] * 6
            counts[axis] = value
            assert beyond_range(tuple(counts))


def test_identity_registers_follow_the_manual():
    assert firmware_text([0x4654, 0x5301, 0x0203]) == "FTS-1.2.3"
    assert serial_text([0x4654, 0x4100, 0x3039, 0x0000]) == "FTA-12345"
    assert serial_text([0x4654, 0x4100, 0x0001, 0x0002]) == "FTA-131073"  # low word first
    assert serial_text([0x4654, 0x4100, 0, 0]) == ""
    assert firmware_text([0x0007, 0x1B01, 0x0203]) == "???-1.2.3"  # nothing that a terminal would act on


def test_clear_counts_what_it_forgets():
    parser = StreamParser()
    parser.feed(GOOD[0][:9])
    parser.clear()
    assert (parser.junk_bytes, parser.pending_bytes) == (9, 0)
    assert parser.feed(GOOD[0]) == [GOOD[1]]


def test_crc_known_values():
    assert crc16_modbus(b"123456789") == 0x4B37
    assert crc16_modbus(bytes.fromhex("09 03 00 B4 00 06")) == 0xA684


@given(st.binary(max_size=64))
def test_crc_agrees_with_two_libraries(data):
    expected = libscrc.modbus(data)
    assert crc16_modbus(data) == expected == crcmod.predefined.mkCrcFun("modbus")(data)


_pieces = st.lists(
    st.one_of(
        st.binary(max_size=20),
        st.sampled_from([frame for frame, _ in FRAMES]),
        st.builds(lambda frame, cut: frame[:cut], st.sampled_from([f for f, _ in FRAMES]), st.integers(0, 16)),
        st.just(b"\x20\x4e"),
        st.just(b"\x20"),
    ),
    max_size=12,
)


@given(_pieces, st.lists(st.integers(1, 23), min_size=1, max_size=8))
def test_any_bytes_in_any_chunks(pieces, chunk_sizes):
    stream = b"".join(pieces)
    whole, chunked = StreamParser(), StreamParser()
    expected = whole.feed(stream)
    found = []
    position = turn = 0
    while position < len(stream):
        size = chunk_sizes[turn % len(chunk_sizes)]
        found += chunked.feed(stream[position : position + size])
        assert chunked.pending_bytes <= 15
        position, turn = position + size, turn + 1
    assert found == expected
    for name in ("packets_ok", "crc_fail", "junk_bytes", "resyncs", "pending_bytes"):
        assert getattr(chunked, name) == getattr(whole, name)
    assert whole.junk_bytes + 16 * whole.packets_ok + whole.pending_bytes == len(stream)
    for counts in found:  # each one stood in the stream, with a CRC that another library accepts
        body = b"\x20\x4e" + struct.pack("<6h", *counts)
        assert body + libscrc.modbus(body).to_bytes(2, "little") in stream
