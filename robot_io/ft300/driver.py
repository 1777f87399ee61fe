"""Driver of the Robotiq FT 300 force-torque sensor (also FT 150 and FT 300-S, which speak the same protocol).

The sensor uses Modbus RTU until it is told to stream; then it sends 100 packets a second and answers nothing
until it hears 0xFF for long enough. Values are raw: bias and tool weight are in them. A sample is stamped when
its last byte was read, 8.3 ms of line time (and up to the USB adapter's latency timer) after it was measured.
A lost line is reported by `health`; only a fresh `open` brings it back, and the bias may have changed by then.
"""

from __future__ import annotations

from collections import deque
from typing import ClassVar

import msgspec

from robot_io.clock import NS_PER_MS, NS_PER_S, ClockNs, monotonic_ns
from robot_io.driver import DriverBase, SensorFacts
from robot_io.errors import DeviceNotReady, DeviceUnreachable
from robot_io.ft300.codec import PACKET_BYTES, StreamParser, beyond_range, wrench_from_counts
from robot_io.ft300.modbus import POWER_CYCLE, Ft300Registers
from robot_io.ft300.serial_link import LINE_ERRORS, SerialLine
from robot_io.messages import DeviceHealth, DeviceInfo, LinkState, SensorWrench, Stamped
from robot_io.rig.declared import FT300_FACTS

START_ATTEMPTS = 2
FIRST_PACKET_LIMIT_S = 0.5
STOP_LIMIT_S = 1.0

PERIOD_NS = 10 * NS_PER_MS
LONG_GAP_NS = 35 * NS_PER_MS
"""A 16 ms latency timer alone gives gaps of up to 32 ms; a longer one is a packet that never came."""
MAX_READS_PER_DRAIN = 4
MAX_SAMPLES_PER_DRAIN = 512
RATE_SAMPLES = 101
NOT_STREAMING = "it does not stream: call start()"


class Ft300Reading(msgspec.Struct, frozen=True, gc=False):
    """What `Ft300.probe` reads."""

    info: DeviceInfo
    """Identity: model, firmware and serial number."""
    wrench: SensorWrench
    """One raw wrench."""
    acceleration_g: tuple[float, float, float]
    """Acceleration in g along x, y, z of the SENSOR frame; NaN where the sensor does not give it."""


class Ft300(DriverBase):
    """An FT 300 on a serial line: 100 samples a second of force (N) and torque (N*m), raw, in the SENSOR frame.

    port: a device path (best one of /dev/serial/by-id), a pty, or `socket://host:port` for a serial server.
    clock: stamps the samples, in ns; CLOCK_MONOTONIC unless a test brings its own.

    Nothing is opened before `open`. For one thread at a time, and it starts none; to wait for samples, `select` on the
    driver itself.
    """

    facts: ClassVar[SensorFacts] = FT300_FACTS
    """What the sensor declares of itself: range, rate, resolution and noise, from its data sheet."""

    def __init__(self, port: str, *, clock: ClockNs = monotonic_ns) -> None:
        self._port = port
        self._where = f"ft300 {port}"
        self._clock = clock
        self._line: SerialLine | None = None
        self._streaming = False
        self._state = LinkState.CLOSED
        self._cause = "not opened"
        self._parser = StreamParser()
        self._held: list[Stamped[SensorWrench]] = []
        self._next_seq = 0
        self._last_ns = 0
        self._stamps: deque[int] = deque(maxlen=RATE_SAMPLES)
        self._counted = dict.fromkeys(
            ("bursts", "empty_reads", "overflow", "long_gaps", "max_gap_us", "beyond_range"), 0
        )

    def open(self) -> DeviceInfo:
        """Open the port, stop a stream left running, identify the sensor.

        Takes 0.2 s, 0.5 s when it streamed, 1.2 s when nothing answers, 5 s at most. Raises DeviceUnreachable
        (port missing, busy or forbidden; no answer), DeviceProtocolError (another device) or UsageError (no port).
        """
        self.close()
        self._state, self._cause = LinkState.OPENING, "opening"
        self._held = []
        try:
            self._line = SerialLine(self._port)
            self._line.prefer_low_latency()
            info = Ft300Registers(self._line).identify()
        except LINE_ERRORS as error:
            self._release(str(error))
            raise self._went_away("while opening", error) from error
        except BaseException as error:
            self._release(str(error))
            raise
        self._state, self._cause = LinkState.UP, ""
        return info

    def start(self) -> None:
        """Start the stream; return once packets arrive.

        Takes 50 ms, 3.5 s at most. Raises DeviceNotReady (not open; no packet after two tries) or
        DeviceUnreachable (the line went away).
        """
        line = self._opened()
        if self._streaming:
            return
        self._streaming = True
        try:
            for attempt in range(START_ATTEMPTS):
                if attempt:
                    line.set_wake_bytes(1)
                    line.make_quiet(STOP_LIMIT_S)
                if self._packets_come(line):
                    return
        except LINE_ERRORS as error:
            self._lose(error)
            raise self._went_away("at the start", error) from error
        self.stop()
        raise DeviceNotReady("it identified itself but sends no packets", where=self._where, do=POWER_CYCLE)

    def fileno(self) -> int:
        """Return the descriptor to wait for (-1 when closed). It stays readable while LOST: stop waiting then."""
        return self._line.fileno() if self._line is not None else -1

    def drain(self) -> tuple[Stamped[SensorWrench], ...]:
        """Return all new samples, oldest first: N and N*m in the SENSOR frame. Never blocks, never raises.

        Of n packets found at once the k-th is stamped (n-1-k)*10 ms before the newest, but never before its
        predecessor. At most 512 samples come at once; older ones are dropped, counted as `overflow`,
        and missing in `seq`.
        """
        if self._streaming and self._line is not None and self._state is LinkState.UP:
            try:
                self._collect(self._line)
            except LINE_ERRORS as error:
                self._lose(error)
        samples, self._held = self._held, []
        self._counted["overflow"] += max(len(samples) - MAX_SAMPLES_PER_DRAIN, 0)
        return tuple(samples[-MAX_SAMPLES_PER_DRAIN:])

    def health(self) -> DeviceHealth:
        """Return link state, its cause, counters, and the rate (Hz) over the last 100 samples (0 after 1 s without).

        Counters since the driver was made: `packets_ok`, `crc_fail`, `junk_bytes`, `resyncs`, `bursts` (several
        packets in one read), `empty_reads`, `overflow` (samples dropped), `long_gaps` (over 35 ms), `max_gap_us`,
        `beyond_range`. An open sensor that does not stream is UP, and its cause says that `start` is missing.
        """
        parser = self._parser
        counters = {
            "packets_ok": parser.packets_ok,
            "crc_fail": parser.crc_fail,
            "junk_bytes": parser.junk_bytes,
            "resyncs": parser.resyncs,
            **self._counted,
        }
        cause = self._cause
        if self._state is LinkState.UP and not self._streaming:
            cause = cause or NOT_STREAMING
        return DeviceHealth(self._state, cause, counters, self._rate_hz())

    def probe(self) -> Ft300Reading:
        """Read identity, wrench and acceleration by polled registers; nothing is started.

        A closed port is opened for it and closed again; a stream found running there is stopped. Raises as
        `open`, and DeviceNotReady while this driver streams.
        """
        if self._line is None:
            try:
                return self._read_registers(self.open())
            finally:
                self.close()
        self._opened()
        if self._streaming:
            raise DeviceNotReady("it cannot be polled while it streams", where=self._where, do="Stop it first")
        return self._read_registers(None)

    def stop(self) -> None:
        """Stop the stream, so that the next client finds a sensor that answers. At most 1.1 s; never raises."""
        if not self._streaming or self._line is None:
            return
        self._streaming = False
        if self._state is not LinkState.UP:
            return
        try:
            self._line.set_wake_bytes(1)
            if not self._line.make_quiet(STOP_LIMIT_S):
                self._cause = "it did not stop streaming on request"
        except LINE_ERRORS as error:
            self._lose(error)

    def close(self) -> None:
        """Stop the stream and release the port. At most 1.5 s; never raises."""
        self.stop()
        if self._state is not LinkState.CLOSED:
            self._release(self._cause or "closed")

    def _opened(self) -> SerialLine:
        if self._line is None or self._state is not LinkState.UP:
            raise DeviceNotReady(f"it is not open ({self._cause})", where=self._where, do="Open it first")
        return self._line

    def _read_registers(self, info: DeviceInfo | None) -> Ft300Reading:
        registers = Ft300Registers(self._opened())
        try:
            return Ft300Reading(info or registers.identify(), registers.wrench(), registers.acceleration_g())
        except LINE_ERRORS as error:
            self._lose(error)
            raise self._went_away("while reading", error) from error

    def _packets_come(self, line: SerialLine) -> bool:
        line.set_wake_bytes(1)
        Ft300Registers(line).ask_for_stream()
        line.set_wake_bytes(PACKET_BYTES)
        self._parser.clear()
        self._stamps.clear()
        self._last_ns = self._clock()
        deadline_ns = monotonic_ns() + int(FIRST_PACKET_LIMIT_S * NS_PER_S)
        while not self._held and monotonic_ns() < deadline_ns:
            line.wait_readable(10)
            self._collect(line)
        return bool(self._held)

    def _collect(self, line: SerialLine) -> None:
        """Read what is there and hold its samples, also those found before the line failed (LINE_ERRORS)."""
        found = []
        try:
            for _ in range(MAX_READS_PER_DRAIN):
                data = line.read_to_boundary(self._parser.pending_bytes, PACKET_BYTES)
                if not data:
                    break
                found += self._parser.feed(data)
        finally:
            now_ns = self._clock()
            self._counted["empty_reads"] += not found
            self._counted["bursts"] += len(found) > 1
            for newer, counts in zip(range(len(found) - 1, -1, -1), found, strict=True):
                self._counted["beyond_range"] += beyond_range(counts)
                self._hold(wrench_from_counts(counts), max(now_ns - newer * PERIOD_NS, self._last_ns))

    def _hold(self, wrench: SensorWrench, stamp_ns: int) -> None:
        if self._stamps:
            gap_ns = stamp_ns - self._last_ns
            self._counted["long_gaps"] += gap_ns > LONG_GAP_NS
            self._counted["max_gap_us"] = max(self._counted["max_gap_us"], gap_ns // 1000)
        self._held.append(Stamped(wrench, self._next_seq, stamp_ns))
        self._stamps.append(stamp_ns)
        self._next_seq += 1
        self._last_ns = stamp_ns

    def _rate_hz(self) -> float:
        if len(self._stamps) < 2 or self._clock() - self._last_ns > NS_PER_S:
            return 0.0
        span_ns = self._last_ns - self._stamps[0]
        return (len(self._stamps) - 1) * NS_PER_S / span_ns if span_ns > 0 else 0.0

    def _lose(self, error: Exception) -> None:
        self._state, self._cause = LinkState.LOST, f"the line is gone: {error}"

    def _went_away(self, when: str, error: Exception) -> DeviceUnreachable:
        return DeviceUnreachable(
            f"the line went away {when} ({error})", where=self._where, do="Check cable and adapter, then open it again"
        )

    def _release(self, cause: str) -> None:
        if self._line is not None:
            try:
                self._line.close()
            except LINE_ERRORS as error:
                cause = f"{cause} (closing failed: {error})"
            self._line = None
        self._streaming = False
        self._state, self._cause = LinkState.CLOSED, cause
