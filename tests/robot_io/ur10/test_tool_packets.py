"""Packets of the arm's own force sensor to readings, and jumps of its bias: bytes and numbers, no socket."""

import math
import struct

import pytest

from robot_io.ur10.tool_packets import BiasWatch, Packet, PacketParser, in_flange

READING = (1.0, 2.0, -15.0, 0.1, 0.2, 0.3)
NOTHING = (0.0,) * 6


def test_the_flange_of_the_outstretched_arm() -> None:
    """All joints zero, from UR's drawing: flange z to -y, x to +x, y to +z of the base (+90 degrees about x)."""
    assert in_flange((0.0,) * 6, (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)) == pytest.approx((1.0, 3.0, -2.0, 4.0, 6.0, -5.0))


def test_a_joint_turns_the_base_under_the_flange() -> None:
    """Base joint at +90 degrees: what was along the base's y is along x of the arm, and so on."""
    q = (math.pi / 2, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert in_flange(q, (0.0, 1.0, 0.0, 0.0, 0.0, 0.0)) == pytest.approx((1.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    assert in_flange(q, (1.0, 0.0, 0.0, 0.0, 0.0, 0.0)) == pytest.approx((0.0, 0.0, 1.0, 0.0, 0.0, 0.0))


def test_the_held_pose_points_forward() -> None:
    """docs/frames-and-signs.md: in the held pose z points forward; the arm stands turned by +90 degrees on the base.

    So forward is -y of the arm's base, and up is its z: x of the flange is (0, sin a, cos a) in the BODY frame.
    """
    held, a = (1.5708, -0.1745, 1.5708, -1.3963, 1.5708, 1.31), math.pi / 2 - 1.31
    forward, up = (0.0, -1.0, 0.0), (0.0, 0.0, 1.0)
    assert in_flange(held, (*forward, 0.0, 0.0, 0.0))[:3] == pytest.approx((0.0, 0.0, 1.0), abs=1e-3)
    assert in_flange(held, (*up, 0.0, 0.0, 0.0))[:3] == pytest.approx((math.cos(a), math.sin(a), 0.0), abs=1e-3)


def packets(count: int, raw=READING, force=READING) -> list[Packet]:
    return [Packet(float(i), raw, force) for i in range(count)]


def test_bytes_in_any_pieces_are_the_same_packets() -> None:
    frame = struct.pack(">HBB", 156, ord("U"), 1) + struct.pack(">19d", 5.0, *(0.0,) * 6, *(0.0,) * 6, *READING)
    for size in (1, 7, 155, 156, 400):
        parser = PacketParser(with_raw=True)
        stream = frame * 3
        found = [one for i in range(0, len(stream), size) for one in parser.feed(stream[i : i + size])]
        assert [(one.controller_s, one.raw) for one in found] == [(5.0, READING)] * 3


@pytest.mark.parametrize("data", ["0000", "000055", "ffff55", "000341", "00045501"])
def test_what_cannot_be_a_packet_is_refused(data: str) -> None:
    with pytest.raises(ValueError):
        PacketParser(with_raw=True).feed(bytes.fromhex(data).ljust(4, b"\0"))


@pytest.mark.parametrize(("off_N", "lasting", "jumps"), [(2.9, 200, 0), (3.1, 49, 0), (3.1, 50, 1), (40.0, 120, 1)])
def test_a_jump_lasts_and_is_counted_once(off_N: float, lasting: int, jumps: int) -> None:
    watch = BiasWatch()
    for packet in packets(100) + packets(lasting, force=(READING[0] + off_N, *READING[1:])):
        watch.take(packet)
    assert watch.jumps == jumps


def test_a_force_is_no_jump() -> None:
    """Both readings change alike, however suddenly: 40 N within one packet."""
    watch = BiasWatch()
    hit = (READING[0], READING[1], READING[2] - 40.0, *READING[3:])
    for packet in packets(100) + packets(200, raw=hit, force=hit):
        watch.take(packet)
    assert watch.jumps == 0


def test_a_reading_that_is_no_number_is_not_the_watchs_business() -> None:
    watch = BiasWatch()
    for packet in packets(100) + packets(200, raw=(math.nan,) * 6):
        watch.take(packet)
    assert watch.jumps == 0


@pytest.mark.parametrize(
    ("before", "after", "jumps"),
    [
        (READING, NOTHING, 1),
        ((3.1, 0.0, 0.0, 0.0, 0.0, 0.0), (0.9, 0.0, 0.0, 0.09, 0.0, 0.0), 1),
        ((0.0, 0.0, 0.0, 0.31, 0.0, 0.0), NOTHING, 1),
        ((2.9, 0.0, 0.0, 0.29, 0.0, 0.0), NOTHING, 0),
        (READING, (1.1, 0.0, 0.0, 0.0, 0.0, 0.0), 0),
        (READING, (0.0, 0.0, 0.0, 0.0, 0.11, 0.0), 0),
    ],
)
def test_without_raw_readings_a_zeroing_is_a_fall_to_nothing(before, after, jumps: int) -> None:
    watch = BiasWatch()
    for packet in packets(50, raw=None, force=before) + packets(50, raw=None, force=after):
        watch.take(packet)
    assert watch.jumps == jumps


def test_a_force_that_fades_is_no_zeroing() -> None:
    """From 15 N to nothing within 6 packets, as when an object slides off."""
    watch = BiasWatch()
    fading = [packets(1, raw=None, force=(0.0, 0.0, -15.0 + 2.5 * n, 0.0, 0.0, 0.0))[0] for n in range(7)]
    for packet in packets(50, raw=None, force=fading[0].force) + fading + packets(50, raw=None, force=NOTHING):
        watch.take(packet)
    assert watch.jumps == 0
