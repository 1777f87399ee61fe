"""The ring between two processes: order, wrapping, full, damaged counters, two real processes hammering."""

from __future__ import annotations

import os
import struct
import subprocess
import sys
import time
import zlib

import pytest

from robot_io.errors import LogDamaged
from robot_io.ipc.ring import Ring

PRODUCER = """
import random, sys, zlib
from robot_io.ipc.ring import Ring
ring, count = Ring(int(sys.argv[1])), int(sys.argv[2])
rng = random.Random(7)
for n in range(count):
    body = rng.randbytes(rng.choice((0, 1, 7, 8, 100, 1300, 3000)))
    payload = zlib.crc32(body).to_bytes(4, "little") + body
    while not ring.push(n % 250, n, payload):
        pass
"""


@pytest.fixture
def ring():
    ring = Ring.create("test", 4000)
    yield ring
    ring.close()


def test_records_come_out_in_order_with_every_length(ring):
    pushed = []
    for n in range(2000):
        record = (n, -n * 10**9, bytes([n % 256]) * (n % 41))
        pushed.append(record)
        assert ring.push(*record)
        if n % 7 == 0:
            assert ring.pop_all() == pushed
            pushed.clear()
    assert ring.pop_all() == pushed
    assert ring.pop_all() == []


def test_limit_leaves_the_rest(ring):
    for n in range(5):
        ring.push(n, n, b"x")
    assert [r.kind for r in ring.pop_all(3)] == [0, 1, 2]
    assert [r.kind for r in ring.pop_all(3)] == [3, 4]


def test_full_ring_drops_the_new_record_and_counts(ring):
    kept = 0
    while ring.push(1, kept, bytes(100)):
        kept += 1
    assert kept == ring.capacity // (16 + 104)
    assert not ring.push(1, 0, bytes(100))
    assert ring.dropped == 2
    assert [r.time_ns for r in ring.pop_all()] == list(range(kept))
    assert ring.push(1, 77, bytes(100))
    assert ring.pop_all() == [(1, 77, bytes(100))]


def test_a_record_as_large_as_the_ring_fits_and_a_larger_one_never(ring):
    assert ring.push(1, 2, bytes(ring.capacity - 16))
    assert len(ring.pop_all()[0].payload) == ring.capacity - 16
    assert not ring.push(1, 2, bytes(ring.capacity - 15))


def test_both_ends_share_one_descriptor(ring):
    other = Ring(os.dup(ring.fd))
    ring.push(3, 4, b"seen by the other end")
    assert other.pop_all() == [(3, 4, b"seen by the other end")]
    other.close()


@pytest.mark.parametrize("length", [25, 4000, 2**32 - 1])
def test_a_damaged_length_is_an_error_after_the_good_records_and_then_it_goes_on(ring, length):
    ring.push(1, 10, b"good")
    ring.push(2, 20, bytes(24))
    os.pwrite(ring.fd, struct.pack("<I", length), 192 + 24)
    assert ring.pop_all() == [(1, 10, b"good")]
    with pytest.raises(LogDamaged, match="not a record"):
        ring.pop_all()
    ring.push(3, 30, b"again")
    assert ring.pop_all() == [(3, 30, b"again")]


@pytest.mark.parametrize("head", [1, 8, 2**63, 2**64 - 8])
def test_a_damaged_head_is_an_error(ring, head):
    os.pwrite(ring.fd, struct.pack("<Q", head), 0)
    with pytest.raises(LogDamaged):
        ring.pop_all()
    assert ring.pop_all() == []


def test_a_descriptor_that_is_no_ring_is_refused():
    fd = os.memfd_create("empty")
    with pytest.raises(ValueError, match="not a ring"):
        Ring(fd)
    os.close(fd)


def test_two_processes_hammering_lose_and_tear_nothing():
    ring = Ring.create("hammer", 10_000)
    count = 30_000
    producer = subprocess.Popen([sys.executable, "-c", PRODUCER, str(ring.fd), str(count)], pass_fds=[ring.fd])
    try:
        seen = 0
        deadline = time.monotonic() + 60
        while seen < count and time.monotonic() < deadline:
            for kind, time_ns, payload in ring.pop_all(64):
                assert (kind, time_ns) == (seen % 250, seen)
                assert int.from_bytes(payload[:4], "little") == zlib.crc32(payload[4:])
                seen += 1
        assert seen == count
        assert producer.wait(10) == 0
        assert ring.pop_all() == []
    finally:
        producer.kill()
        producer.wait()
        ring.close()


def test_it_says_what_waits_and_what_was_taken(ring):
    assert (ring.consumed, ring.unread) == (0, 0)
    ring.push(1, 1, bytes(8))  # 16 bytes before a payload
    ring.push(1, 1, bytes(3))
    assert (ring.consumed, ring.unread) == (0, 48)
    ring.pop_all(1)
    assert (ring.consumed, ring.unread) == (24, 24)
    ring.pop_all()
    assert (ring.consumed, ring.unread) == (48, 0)
