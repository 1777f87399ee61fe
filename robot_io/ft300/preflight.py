"""Look at an FT 300 without starting its stream: it is sent the bytes that stop one, and requests to read.

What a USB adapter's latency timer does shows in how bytes arrive: with 1 ms they trickle in as they cross the line,
with 16 ms they come in bunches 16 ms apart. So it can be told where the system does not say it.
"""

from __future__ import annotations

import itertools
import os
import statistics
import struct
import time
from pathlib import Path
from typing import Self

import msgspec

from robot_io.clock import NS_PER_MS, NS_PER_S, monotonic_ns
from robot_io.errors import DeviceUnreachable
from robot_io.ft300.codec import (
    Counts,
    StreamParser,
    counts_from_registers,
    crc16_modbus,
    wrench_from_counts,
)
from robot_io.ft300.modbus import MODE_CHANGE_S, READ_HOLDING, REG_WRENCH, SLAVE_ID, Ft300Registers
from robot_io.ft300.serial_link import ANSWER_TIMEOUT_S, LINE_ERRORS, SYSFS_TTY, SerialLine
from robot_io.messages import DeviceInfo, SensorWrench

FIRST_BYTE_S = 0.15
"""A streaming sensor sends every 10 ms, in bunches 16 ms apart at the worst."""
QUIET_WITHIN_S = 3.0
PAUSE_S = 0.003
"""Between an answer and the next request: 3.5 characters at least."""
FEWEST_GAPS = 8

_ASK_WRENCH = struct.pack(">BBHH", SLAVE_ID, READ_HOLDING, REG_WRENCH, 6)
_ASK = _ASK_WRENCH + struct.pack("<H", crc16_modbus(_ASK_WRENCH))
_ANSWER_HEAD = bytes((SLAVE_ID, READ_HOLDING, 12))
_ANSWER_BYTES = 17


class Heard(msgspec.Struct, frozen=True):
    """A stream that was found running."""

    packets: int
    damaged: int
    """Runs of bytes that belong to no packet, beyond the first."""
    span_s: float
    """From the first packet to the last."""
    bunches_ms: float | None
    """Time between two arrivals; None where there were too few."""

    @property
    def rate_hz(self) -> float:
        """Packets a second."""
        return (self.packets - 1) / self.span_s if self.packets > 1 and self.span_s > 0.0 else 0.0


class Polled(msgspec.Struct, frozen=True):
    """Readings that were asked for one by one."""

    asked: int
    answered: int
    damaged: int
    """Answers with a wrong checksum or of another form; those missing are neither."""
    fresh: int
    """Answers that differ from the one before."""
    span_s: float
    readings: tuple[SensorWrench, ...]
    bunches_ms: float | None
    """Time between two arrivals within an answer; None where there were too few."""


class Ft300Preflight:
    """An FT 300's line, looked at step by step: `listen`, `quiet`, `echoes`, `identify`, `poll`; then `close`.

    Raises DeviceUnreachable (port missing, busy or forbidden) and UsageError as `Ft300.open`; every later step
    DeviceUnreachable where the line goes away.
    """

    def __init__(self, port: str) -> None:
        self._port = port
        self._line = SerialLine(port)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Release the port; never raises."""
        try:
            self._line.close()
        except LINE_ERRORS:
            return

    def listen(self, for_s: float) -> Heard | None:
        """Return what a running stream says in `for_s`, None where nothing comes within 0.15 s; sends nothing."""
        try:
            self._line.flush_input()
            return self._listen(for_s)
        except LINE_ERRORS as error:
            raise self._gone(error) from error

    def _listen(self, for_s: float) -> Heard | None:
        parser, arrivals, stamps = StreamParser(), list[int](), list[int]()
        began_ns = monotonic_ns()
        until_ns = began_ns + int(for_s * NS_PER_S)
        while (now_ns := monotonic_ns()) < until_ns:
            if not arrivals and now_ns - began_ns > FIRST_BYTE_S * NS_PER_S:
                return None
            self._line.wait_readable(20)
            data = self._line.read_now()
            if data:
                arrivals.append(monotonic_ns())
                stamps += [arrivals[-1]] * len(parser.feed(data))
        if not arrivals:
            return None
        gaps = [b - a for a, b in itertools.pairwise(arrivals)]
        span_s = (stamps[-1] - stamps[0]) / NS_PER_S if stamps else 0.0
        return Heard(parser.packets_ok, max(0, parser.resyncs - 1), span_s, _typical_ms(gaps))

    def quiet(self) -> bool:
        """Send the bytes that stop a stream until it is silent; False when it is not within 3 s."""
        try:
            silent = self._line.make_quiet(QUIET_WITHIN_S)
            self._line.wait_sent()
            time.sleep(MODE_CHANGE_S)
            self._line.flush_input()
        except LINE_ERRORS as error:
            raise self._gone(error) from error
        return silent

    def echoes(self) -> bool:
        """Return whether the adapter sends back what is sent: twenty of the bytes that stop a stream."""
        try:
            return self._line.echoes()
        except LINE_ERRORS as error:
            raise self._gone(error) from error

    def identify(self) -> DeviceInfo:
        """Return who it is. Raises DeviceUnreachable (no answer) or DeviceProtocolError (another device)."""
        try:
            return Ft300Registers(self._line).identify()
        except LINE_ERRORS as error:
            raise self._gone(error) from error

    def poll(self, for_s: float) -> Polled:
        """Ask for the wrench (N, N*m, raw, SENSOR frame) over and over for `for_s`."""
        try:
            return self._poll(for_s)
        except LINE_ERRORS as error:
            raise self._gone(error) from error

    def _poll(self, for_s: float) -> Polled:
        asked = answered = damaged = fresh = 0
        counts: list[Counts] = []
        gaps: list[int] = []
        before = b""
        began_s = time.monotonic()
        while time.monotonic() - began_s < for_s:
            asked += 1
            answer, between = self._ask_once()
            if _is_whole(answer):
                answered += 1
                fresh += answer != before
                before = answer
                counts.append(counts_from_registers(struct.unpack(">6H", answer[3:15])))
                gaps += between
            elif answer:
                damaged += 1
            time.sleep(PAUSE_S)
        span_s = time.monotonic() - began_s
        return Polled(
            asked, answered, damaged, fresh, span_s, tuple(map(wrench_from_counts, counts)), _typical_ms(gaps)
        )

    def _ask_once(self) -> tuple[bytes, list[int]]:
        """Return one answer, b"" where none came in time, and the times (ns) between the arrivals of its parts."""
        self._line.flush_input()
        self._line.serial.write(_ASK)
        answer, arrivals = b"", list[int]()
        until_s = time.monotonic() + ANSWER_TIMEOUT_S
        while len(answer) < _ANSWER_BYTES and time.monotonic() < until_s:
            self._line.wait_readable(5)
            data = self._line.read_now()
            if data:
                answer += data
                arrivals.append(monotonic_ns())
        return answer, [b - a for a, b in itertools.pairwise(arrivals)]

    def _gone(self, error: Exception) -> DeviceUnreachable:
        return DeviceUnreachable(
            f"the line went away ({error})", where=f"ft300 {self._port}", do="Check cable and adapter"
        )


def latency_timer_ms(port: str) -> int | None:
    """Return the latency timer of the port's USB adapter as the system says it, None where it says none."""
    timer = SYSFS_TTY / Path(os.path.realpath(port)).name / "device" / "latency_timer"
    try:
        return int(timer.read_text())
    except (OSError, ValueError):
        return None


def _is_whole(answer: bytes) -> bool:
    if len(answer) != _ANSWER_BYTES or not answer.startswith(_ANSWER_HEAD):
        return False
    return crc16_modbus(answer[:-2]) == int.from_bytes(answer[-2:], "little")


def _typical_ms(gaps_ns: list[int]) -> float | None:
    return statistics.median(gaps_ns) / NS_PER_MS if len(gaps_ns) >= FEWEST_GAPS else None
