"""What the FT 300 driver makes of bytes and times: stamps, gaps, rate, and a line that dies. No device, no waiting."""

from __future__ import annotations

import errno
import itertools
import termios
from types import SimpleNamespace

import pytest
import serial

from robot_io.ft300.driver import Ft300
from robot_io.ft300.serial_link import SerialLine
from robot_io.messages import LinkState

PACKET = bytes.fromhex("20 4E D2 04 D2 E9 10 27 64 00 32 FB 8A 0C 0C 17")
OVER_RANGE = bytes.fromhex("20 4E 31 75 00 00 00 00 00 00 00 00 00 00 64 21")
MS = 1_000_000


class ScriptedLine:
    """Stands in for the serial line: gives what the test puts in, raises what the test puts in."""

    def __init__(self):
        self.script = []
        self.written = []

    def read_to_boundary(self, _pending, _unit):
        if not self.script:
            return b""
        item = self.script.pop(0)
        if isinstance(item, Exception):
            raise item
        return item

    def set_wake_bytes(self, _count):
        pass

    def make_quiet(self, _limit_s):
        return True

    def close(self):
        pass


class Bench:
    def __init__(self):
        self.now_ns = 1_000 * MS
        self.line = ScriptedLine()
        self.sensor = Ft300("/dev/none", clock=lambda: self.now_ns)
        self.sensor._line = self.line
        self.sensor._state = LinkState.UP
        self.sensor._streaming = True

    def drain_at(self, now_ms, *items):
        self.now_ns = now_ms * MS
        self.line.script = list(items)
        return [sample.received_ns // MS for sample in self.sensor.drain()]


def test_a_single_packet_is_stamped_when_it_is_read():
    bench = Bench()
    assert bench.drain_at(1_010, PACKET) == [1_010]
    assert bench.drain_at(1_015) == []
    assert bench.drain_at(1_021, PACKET) == [1_021]


def test_packets_of_a_burst_are_dated_back_by_ten_milliseconds_each():
    bench = Bench()
    bench.drain_at(1_000, PACKET)
    assert bench.drain_at(1_042, PACKET * 4) == [1_012, 1_022, 1_032, 1_042]
    assert bench.sensor.health().counters["bursts"] == 1


def test_dating_back_never_passes_the_sample_before():
    bench = Bench()
    bench.drain_at(1_000, PACKET)
    assert bench.drain_at(1_016, PACKET * 4) == [1_000, 1_000, 1_006, 1_016]


def test_a_packet_in_pieces_is_stamped_by_its_last_byte():
    bench = Bench()
    assert bench.drain_at(1_000, PACKET[:9]) == []
    assert bench.drain_at(1_004, PACKET[9:]) == [1_004]


def test_sequence_counts_packets_and_shows_what_was_dropped():
    bench = Bench()
    bench.drain_at(1_000, PACKET)
    bench.now_ns = 20_000 * MS
    bench.line.script = [PACKET * 250] * 4
    samples = bench.sensor.drain()
    assert len(samples) == 512
    assert samples[-1].seq == 1_000
    assert samples[0].seq == 1_000 - 511
    assert bench.sensor.health().counters["overflow"] == 1_000 - 512
    bench.line.script = [PACKET] * 10
    assert len(bench.sensor.drain()) == 4  # bounded reads; the rest comes next time
    assert len(bench.sensor.drain()) == 4


def test_gaps_and_rate():
    bench = Bench()
    for now_ms in range(1_000, 1_200, 10):
        bench.drain_at(now_ms, PACKET)
    assert bench.sensor.health().rate_hz == pytest.approx(100.0)
    assert bench.sensor.health().counters["long_gaps"] == 0
    bench.drain_at(1_230, PACKET)
    assert bench.sensor.health().counters["max_gap_us"] == 40_000
    assert bench.sensor.health().counters["long_gaps"] == 1
    bench.now_ns = 2_231 * MS
    assert bench.sensor.health().rate_hz == 0.0
    assert bench.sensor.health().state is LinkState.UP  # silence is for safety to judge


def test_values_beyond_the_range_are_counted_and_passed_on():
    bench = Bench()
    bench.line.script = [OVER_RANGE, PACKET]
    samples = bench.sensor.drain()
    assert [sample.value.fx for sample in samples] == [300.01, 12.34]
    assert bench.sensor.health().counters["beyond_range"] == 1


FAILURES = [
    OSError(errno.EIO, "Input/output error"),
    OSError(errno.ENODEV, "No such device"),
    OSError(errno.EAGAIN, "Resource temporarily unavailable"),
    serial.SerialException("device disconnected"),
    serial.SerialTimeoutException("Write timeout"),
    serial.PortNotOpenError(),
    termios.error(errno.EIO, "Input/output error"),
    ValueError("I/O operation on closed file"),
    ConnectionResetError(errno.ECONNRESET, "Connection reset by peer"),
]


@pytest.mark.parametrize("failure", FAILURES, ids=repr)
def test_every_way_a_line_dies_is_lost_with_its_cause_and_stays_lost(failure):
    bench = Bench()
    assert bench.drain_at(1_000, PACKET * 2, failure) == [990, 1_000]
    health = bench.sensor.health()
    assert health.state is LinkState.LOST
    assert str(failure) in health.cause
    assert health.counters["packets_ok"] == 2
    assert bench.drain_at(1_020, PACKET) == []
    assert bench.sensor.health().state is LinkState.LOST
    bench.sensor.stop()
    bench.sensor.close()
    assert bench.sensor.health().state is LinkState.CLOSED


@pytest.mark.parametrize("failure", FAILURES, ids=repr)
def test_stop_and_close_never_raise(failure):
    def fail(*_args):
        raise failure

    for method in ("set_wake_bytes", "make_quiet", "close"):
        bench = Bench()
        setattr(bench.line, method, fail)
        bench.sensor.stop()
        bench.sensor.stop()
        bench.sensor.close()
        bench.sensor.close()
        assert bench.sensor.fileno() == -1


def test_packets_before_the_failure_are_delivered():
    bench = Bench()
    bench.now_ns = 1_100 * MS
    bench.line.script = [PACKET * 3, OSError(errno.EIO, "Input/output error")]
    samples = bench.sensor.drain()
    assert [after.seq - before.seq for before, after in itertools.pairwise(samples)] == [1, 1]
    assert bench.sensor.health().state is LinkState.LOST


# --- silence of the line -----------------------------------------------------------------------------------------


class TimedLine(SerialLine):
    """A line on which bytes come at given times (ms), and a clock that only waiting moves."""

    def __init__(self, monkeypatch, *arrivals_ms):
        self.now_ms = 0.0
        self.arrivals = list(arrivals_ms)
        self.bursts = []
        self.serial = SimpleNamespace(write=lambda data: self.bursts.append((self.now_ms, data)))
        clock = SimpleNamespace(monotonic=lambda: self.now_ms / 1000, sleep=lambda s: self.pass_ms(s * 1000))
        monkeypatch.setattr("robot_io.ft300.serial_link.time", clock)

    def pass_ms(self, time_ms):
        self.now_ms += time_ms

    def wait_readable(self, timeout_ms):
        until_ms = self.now_ms + timeout_ms
        self.now_ms = min([until_ms, *(max(at, self.now_ms) for at in self.arrivals)])

    def read_now(self, limit=4096):
        come = [at for at in self.arrivals if at <= self.now_ms]
        del self.arrivals[: len(come)]
        return b"." * len(come)


@pytest.mark.parametrize(("heard_at_ms", "silent"), [(1, False), (60, False), (94, False), (106, True)])
def test_silence_is_100_ms_without_a_byte(monkeypatch, heard_at_ms, silent):
    line = TimedLine(monkeypatch, heard_at_ms)
    assert line.is_silent() is silent
    assert line.now_ms == (pytest.approx(100.0, abs=5.0) if silent else heard_at_ms)


def test_a_sensor_is_quiet_100_ms_after_its_last_byte(monkeypatch):
    """A gap of 90 ms is none: packets may wait that long in an adapter."""
    line = TimedLine(monkeypatch, 10, 20, 110, 200)
    assert line.make_quiet(1.0)
    assert line.now_ms == pytest.approx(300.0, abs=6.0)
    assert {data for _, data in line.bursts} == {b"\xff" * 20}


def test_a_sensor_that_talks_every_90_ms_is_not_quiet_in_time(monkeypatch):
    line = TimedLine(monkeypatch, *range(0, 2000, 90))
    assert not line.make_quiet(1.0)
    assert line.now_ms == pytest.approx(1000.0, abs=6.0)
