"""The emulated sensor's bytes against frames computed by hand from Robotiq's manual, and its model of the line."""

from __future__ import annotations

import libscrc
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot_io.clock import NS_PER_MS
from sim_backend.ft300 import wire
from sim_backend.ft300.line import WireDirection, last_delivery_ns, next_delivery_ns
from sim_backend.ft300.registers import SensorRegisters

WRENCH = (12.34, -56.78, 100.00, 0.100, -1.230, 3.210)


def registers() -> SensorRegisters:
    sensor = SensorRegisters("FTS-1.2.3", "FTA-12345", 2018, (0.0, 0.0, -1.0))
    sensor.counts = wire.to_counts(WRENCH)
    return sensor


@pytest.mark.parametrize(
    ("request_hex", "answer_hex"),
    [
        ("09 03 00 B4 00 06 84 A6", "09 03 0C 04 D2 E9 D2 27 10 00 64 FB 32 0C 8A AE A5"),
        ("09 03 00 B4 00 01 C5 64", "09 03 02 04 D2 DB 18"),
        ("09 03 01 F4 00 01 C5 4C", "09 03 02 46 54 6A 1A"),
        ("09 03 01 F4 00 03 44 8D", "09 03 06 46 54 53 01 02 03 78 3A"),
        ("09 03 02 02 00 01 25 3A", "09 03 02 07 E2 DB FC"),
        ("09 03 01 FE 00 04 25 4D", "09 03 08 46 54 41 00 30 39 00 00 FE 74"),
        ("09 03 00 BE 00 03 64 A7", "09 03 06 00 00 00 00 FC 18 07 BF"),
        ("09 10 01 9A 00 01 02 02 00 CD CA", "09 10 01 9A 00 01 21 52"),
    ],
)
def test_requests_get_the_manuals_answers(request_hex, answer_hex):
    found = wire.RequestScanner().feed(bytes.fromhex(request_hex))
    assert len(found) == 1
    assert registers().serve(found[0]).answer.hex(" ").upper() == answer_hex


def test_unknown_register_is_an_illegal_address():
    request = wire.framed(bytes.fromhex("09 03 00 00 00 01"))[:-2]
    reply = registers().serve(request)
    assert reply.is_refusal
    assert reply.answer == bytes.fromhex("09 83 02 41 33")


def test_only_the_output_register_can_be_written():
    assert registers().serve(bytes.fromhex("09 10 01 9B 00 01 02 02 00")).is_refusal
    assert registers().serve(bytes.fromhex("09 06 01 9A 02 00")).is_refusal
    assert registers().serve(bytes.fromhex("09 03 00 B4 00 00")).is_refusal
    assert registers().serve(bytes.fromhex("09 10 01 9A 00 01 02 02 00")).selected == 0x0200


@pytest.mark.parametrize(
    ("wrench", "packet_hex"),
    [
        ((0.0,) * 6, "20 4E 00 00 00 00 00 00 00 00 00 00 00 00 62 AF"),
        (WRENCH, "20 4E D2 04 D2 E9 10 27 64 00 32 FB 8A 0C 0C 17"),
        ((-20.68, 21.95, -48.70, -0.097, 1.172, -0.321), "20 4E EC F7 93 08 FA EC 9F FF 94 04 BF FE 4F 8B"),
        ((200.0, -56.78, 100.0, 0.1, -1.23, 3.21), "20 4E 20 4E D2 E9 10 27 64 00 32 FB 8A 0C C2 C8"),
        ((82.0, 0.78, 100.0, 0.1, -1.23, 3.21), "20 4E 08 20 4E 00 10 27 64 00 32 FB 8A 0C 0D 97"),
        ((300.0, -300.0, 300.0, 30.0, -30.0, 30.0), "20 4E 30 75 D0 8A 30 75 30 75 D0 8A 30 75 E1 08"),
    ],
)
def test_packets_are_the_manuals(wrench, packet_hex):
    assert wire.stream_packet(wire.to_counts(wrench)).hex(" ").upper() == packet_hex


def test_counts_are_clipped_at_int16():
    assert wire.to_counts((1e6, -1e6, 327.68, 99.0, -99.0, 32.768)) == (32767, -32768, 32767, 32767, -32768, 32767)


@given(st.binary(max_size=40))
def test_crc_agrees_with_a_library(data):
    assert wire.crc_bytes(data) == libscrc.modbus(data).to_bytes(2, "little")


@pytest.mark.parametrize("run", [1, 2, 3, 17, 1100])
def test_a_request_glued_to_stop_bytes_is_heard(run):
    scanner = wire.RequestScanner()
    request = bytes.fromhex("09 03 01 F4 00 01 C5 4C")
    assert scanner.feed(b"\xff" * run + request) == [request[:-2]]
    assert scanner.junk_bytes == run


def test_a_request_is_heard_behind_the_beginning_of_others_and_in_pieces():
    request = bytes.fromhex("09 10 01 9A 00 01 02 02 00 CD CA")
    for junk in (b"\x09", b"\x09\x03", b"\x09\x10\x01", b"\x09\x09\x03\x00", b"\x09\x10\x01\x9a\x00\x01\x04"):
        scanner = wire.RequestScanner()
        heard = [message for byte in junk + request + request for message in scanner.feed(bytes([byte]))]
        assert request[:-2] in heard
    assert wire.RequestScanner().feed(bytes.fromhex("0A 03 01 F4 00 01 C5 7F")) == []  # another slave's


def test_the_line_carries_1920_bytes_a_second():
    line = WireDirection(paced=True)
    line.put(b"x" * 16, 1_000)
    assert line.take(1_000 + 520_832) == b""
    assert line.take(1_000 + 520_833) == b"x"
    assert line.is_busy(1_000 + 8_333_000)
    assert len(line.take(1_000 + 8_333_333)) == 15
    assert not line.is_busy(1_000 + 8_333_333)
    line.put(b"yy", 2_000)  # while busy until 8.33 ms: it queues behind
    assert line.next_began_ns() == 1_000 + 8_333_328
    assert line.take(9 * NS_PER_MS) == b"y"
    assert line.taken_ns() == 1_000 + 17 * 520_833
    assert line.taken_ns(2) == 1_000 + 15 * 520_833


def test_the_line_has_room_for_4096_bytes_before_a_writer_waits():
    line = WireDirection(paced=True)
    line.put(b"x" * 4000, 0)
    assert line.room == 96
    line.put(b"x" * 200, 0)  # closing a port sends all that was written
    assert line.room < 0


def test_a_sender_that_falls_silent_ends_with_the_byte_on_the_line():
    line = WireDirection(paced=True)
    line.put(b"0123456789abcdef", 1_000)
    line.cut(1_000 + 3 * 520_833 + 1)  # the fourth byte is on its way
    assert line.take(10**9) == b"0123"
    assert not line.is_busy(1_000 + 4 * 520_833)
    line.cut(10**9)
    line.put(b"x", 10**9)
    assert line.take(10**9 + 520_833) == b"x"


@pytest.mark.parametrize(
    ("arrival", "latency", "delivered"),
    [
        (5_300_000, 0, 5_300_000),
        (5_300_000, 1, 6_000_000),
        (6_000_000, 1, 6_000_000),
        (5_300_000, 16, 16_000_000),
        (16_000_001, 16, 32_000_000),
    ],
)
def test_the_adapter_delivers_when_its_timer_fires(arrival, latency, delivered):
    assert next_delivery_ns(arrival, latency) == delivered


def test_the_adapters_timer_runs_from_the_opening_of_its_port():
    since = 5_300_000
    assert next_delivery_ns(5_300_001, 16, since) == 21_300_000
    assert next_delivery_ns(21_300_000, 16, since) == 21_300_000
    assert last_delivery_ns(37_299_999, 16, since) == 21_300_000
    assert last_delivery_ns(37_300_000, 16, since) == 37_300_000
    assert last_delivery_ns(7, 0, since) == 7
