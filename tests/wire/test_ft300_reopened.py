"""The emulated sensor's port closed and opened again: closing a real one waits until all of it is sent."""

from __future__ import annotations

import os
import select
import time

import pytest

from tests.how_many import mostly_long
from tests.wire.ft300_process import ft300_process, until
from tests.wire.test_ft300_pty import FIRMWARE, PACKET, READ_FIRMWARE, START, open_port, read_for

BYTES_PER_S = 1920
"""19200 baud, ten bits a byte."""


def stop_and_ask(path: str) -> bytes:
    """Send 50 x 0xFF, close, open again, ask: as clients do that leave the Modbus part to a library."""
    fd = open_port(path)
    os.write(fd, b"\xff" * 50)
    os.close(fd)
    fd = open_port(path)
    os.write(fd, READ_FIRMWARE)
    answer = read_for(fd, len(FIRMWARE), 1.0)
    os.close(fd)
    return answer


def stream_again(path: str) -> None:
    fd = open_port(path)
    os.write(fd, START)
    assert PACKET * 2 in read_for(fd, 16 * 4)
    os.close(fd)


@pytest.mark.parametrize(("latency_ms", "fewest"), [pytest.param(1, 20, marks=pytest.mark.long), (16, 19)])
def test_a_stop_then_a_new_connection_then_a_question(latency_ms, fewest):
    with ft300_process(latency_ms=latency_ms) as emulator:
        answers = []
        for number in range(20):
            stream_again(emulator.port)
            time.sleep(0.0013 * number)  # at any place of a packet
            answers.append(stop_and_ask(emulator.port))
    assert answers.count(FIRMWARE) >= fewest, answers


def test_bytes_take_their_time_although_the_port_is_closed_meanwhile():
    with ft300_process() as emulator:
        fd = open_port(emulator.port)
        os.write(fd, b"\xff" * 960)
        sent_s = time.monotonic()
        os.close(fd)
        fd = open_port(emulator.port)
        os.write(fd, READ_FIRMWARE)
        assert read_for(fd, len(FIRMWARE)) == FIRMWARE
        assert time.monotonic() - sent_s > (960 + len(READ_FIRMWARE)) / BYTES_PER_S
        os.close(fd)


@pytest.mark.long
def test_a_port_that_stays_closed_still_sends_everything():
    with ft300_process(streaming=True, knobs={"stop_bytes": 6000}) as emulator:
        fd = open_port(emulator.port)
        sent_s = time.monotonic()
        os.write(fd, b"\xff" * 3000)
        os.write(fd, b"\xff" * 3000)  # more than the emulated line holds at once
        os.close(fd)
        assert until(lambda: emulator.counters()["stops"] == 1, 10.0)
        assert time.monotonic() - sent_s > 6000 / BYTES_PER_S


@pytest.mark.parametrize("latency_ms", mostly_long((1, 16), 16))
def test_what_arrived_before_a_port_was_opened_is_not_delivered_after_it(latency_ms):
    """Each packet of the ramp carries its own number."""
    with ft300_process(streaming=True, ramp=True, latency_ms=latency_ms) as emulator:
        for number in range(10):
            fd = open_port(emulator.port)
            read_for(fd, 48)  # and what comes behind is left unread
            time.sleep(0.02)
            os.close(fd)
            time.sleep(0.0017 * number)
            sampled = emulator.counters()["samples"]
            fd = open_port(emulator.port)
            data = read_for(fd, 64)
            os.close(fd)
            first = data.find(b"\x20\x4e")
            # The one on the line when the port was opened comes in part; the next began after that.
            assert int.from_bytes(data[first + 2 : first + 4], "little") >= sampled, (number, data)


def test_a_second_one_that_opens_and_closes_the_port_disturbs_nobody():
    with ft300_process(streaming=True) as emulator:
        fd = open_port(emulator.port)
        assert PACKET * 2 in read_for(fd, 16 * 4)
        for _ in range(30):
            os.close(open_port(emulator.port))
            time.sleep(0.005)
        data = b""
        while select.select([fd], [], [], 0)[0]:
            data += os.read(fd, 4096)
        os.close(fd)
        whole = data.count(PACKET)
        assert whole >= 10
        assert len(data) - 16 * whole < 32  # nothing is missing between the packets
        assert emulator.counters()["attaches"] == 1
