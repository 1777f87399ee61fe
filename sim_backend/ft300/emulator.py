"""An FT 300 on a pty, byte for byte: Modbus slave, data stream, line speed, USB latency timer, and faults.

Runs inside an `EventLoop`: one thread, nothing blocks. Samples are taken on the sensor's own clock (rate error
and phase) from an `FtSource`. Where Robotiq's documentation says nothing, a knob (`Ft300Knobs`)
holds the assumption.
"""

from __future__ import annotations

import termios

from robot_io.clock import NS_PER_MS, NS_PER_S, monotonic_ns
from robot_io.ipc.event_loop import EventLoop
from sim_backend.ft300 import wire
from sim_backend.ft300.knobs import Ft300Knobs, damaged, is_every_nth
from sim_backend.ft300.line import BYTE_NS, WireDirection, last_delivery_ns, next_delivery_ns
from sim_backend.ft300.pty import READ_BYTES, PtyPort
from sim_backend.ft300.registers import OUTPUT_STREAM, SensorRegisters
from sim_backend.ft300.timers import NamedTimers, nanoseconds
from sim_backend.world.plant import FtSource

RX_STEP_NS = 2 * NS_PER_MS
REQUEST_PAUSE_NS = 10 * NS_PER_MS
"""An incomplete request is discarded after this long without a byte."""
TOO_LATE_NS = 50 * NS_PER_MS
"""After a pause of the host longer than this, missed samples are skipped, not sent in a burst."""


class Ft300Emulator:
    """An FT 300 at `port`, fed by `source`.

    rate_hz, phase: samples at (k + phase) / rate_hz of the monotonic clock. latency_ms: 0, 1 or 16. streaming:
    starts in stream mode, as after a client crash. link: a stable name for the pty. `knobs` may be replaced
    while it runs (`paced` excepted), and so may `source`.
    """

    def __init__(
        self,
        loop: EventLoop,
        source: FtSource,
        *,
        rate_hz: float = 100.016,
        phase: float = 0.37,
        latency_ms: int = 1,
        streaming: bool = False,
        link: str | None = None,
        firmware: str = "FTS-1.2.3",
        serial: str = "FTA-12345",
        year: int = 2018,
        acceleration_g: tuple[float, float, float] = (0.0, 0.0, -1.0),
        knobs: Ft300Knobs | None = None,
    ) -> None:
        self.knobs = knobs or Ft300Knobs()
        self.latency_ms = latency_ms
        self.source = source
        self._period_ns = NS_PER_S / rate_hz
        self._phase = phase
        self._streams_at_boot = streaming
        self._streaming = streaming
        self._registers = SensorRegisters(firmware, serial, year, acceleration_g)
        self._port = PtyPort(loop, self._on_bytes, self._on_opened, link)
        self._to_host = WireDirection(paced=self.knobs.paced)
        self._to_sensor = WireDirection(paced=self.knobs.paced)
        self._scanner = wire.RequestScanner()
        self._baud_fits = False
        self._sample_index = 0
        self._timers = NamedTimers(loop)
        self._stop_bytes_seen = 0
        self._modbus_from_ns = 0
        self._stalled_until_ns = 0
        self._heard_until_ns = 0
        self._opened_ns = 0
        self._packets = 0
        self._answers = 0
        self._counted = dict.fromkeys(
            ("samples", "samples_skipped", "packets_sent", "packets_withheld", "bytes_delivered", "bytes_lost",
             "bytes_garbled", "requests", "starts", "stops"), 0
        )  # fmt: skip

    @property
    def port(self) -> str:
        """Path of the pty's slave ("" while hung up)."""
        return self._port.path

    @property
    def counters(self) -> dict[str, int]:
        """Event counts so far, by name."""
        return {**self._counted, "attaches": self._port.attaches, "junk_bytes": self._scanner.junk_bytes}

    @property
    def streaming(self) -> bool:
        """Return whether the sensor is in stream mode."""
        return self._streaming

    def start(self) -> None:
        """Create the pty and start measuring."""
        self._port.open()
        now_ns = monotonic_ns()
        self._registers.counts = wire.to_counts(self.source.read_ft(now_ns))
        self._sample_index = int(now_ns / self._period_ns - self._phase) + 1
        self._timers.at("sample", self._sample_ns(), self._on_sample)

    def close(self) -> None:
        """Remove the pty and stop; idempotent."""
        self._timers.cancel_all()
        self._port.close()

    def keep_streaming(self) -> None:
        """Be found streaming, as after a client that crashed."""
        self._streaming = True

    def become(self, firmware: str) -> None:
        """Be another device, with this firmware."""
        self._registers = SensorRegisters(firmware, "FTA-12345", 2018, (0.0, 0.0, -1.0))

    def stall(self, duration_s: float) -> None:
        """Send and receive nothing for a while, then continue as if nothing had happened."""
        self._stalled_until_ns = monotonic_ns() + int(duration_s * NS_PER_S)

    def hang_up(self, return_after_s: float | None = None, *, power_cycled: bool = False) -> None:
        """Unplug the adapter and plug it in again later, on another pty under the same link.

        The sensor has its own power supply: without `power_cycled` it keeps its state.
        """
        self._port.close()
        self._to_host.clear()
        self._to_sensor.clear()
        self._scanner.clear()
        if power_cycled:
            self._streaming = self._streams_at_boot
            self._registers.output = 0
        if return_after_s is not None:
            self._timers.at("return", monotonic_ns() + int(return_after_s * NS_PER_S), lambda _: self._port.open())

    # The sensor's own clock: it measures whether or not anyone is connected.

    def _sample_ns(self) -> int:
        return round((self._sample_index + self._phase) * self._period_ns)

    def _on_sample(self, sample_ns: int) -> None:
        self._registers.counts = wire.to_counts(self.source.read_ft(sample_ns))
        self._check_baud()
        self._counted["samples"] += 1
        if self._streaming and not self._is_stalled(sample_ns):
            self._send_packet(sample_ns)
        self._sample_index += 1
        late_ns = monotonic_ns() - self._sample_ns()
        if late_ns > TOO_LATE_NS:
            skipped = int(late_ns / self._period_ns) + 1
            self._sample_index += skipped
            self._counted["samples_skipped"] += skipped
        self._timers.at("sample", self._sample_ns(), self._on_sample)

    def _send_packet(self, sample_ns: int) -> None:
        self._packets += 1
        knobs = self.knobs
        if self._to_host.is_busy(sample_ns) or is_every_nth(self._packets, knobs.drop_packet_every):
            self._counted["packets_withheld"] += 1
            return
        self._counted["packets_sent"] += 1
        self._send(damaged(wire.stream_packet(self._registers.counts), self._packets, knobs), sample_ns)

    # From the sensor to the host: line, adapter, pty.

    def _send(self, data: bytes, at_ns: int) -> None:
        self._to_host.put(data, at_ns)
        self._schedule_delivery()

    def _schedule_delivery(self, *, anew: bool = False) -> None:
        # While nobody is connected, one wake-up per packet is enough.
        arrival_ns = self._to_host.next_ns() if self._port.attached else self._to_host.free_ns
        if len(self._to_host) and arrival_ns is not None and (anew or "deliver" not in self._timers):
            due_ns = next_delivery_ns(arrival_ns, self.latency_ms, self._opened_ns)
            self._timers.at("deliver", due_ns, self._on_delivery)

    def _on_delivery(self, deadline_ns: int) -> None:
        self._port.look()
        self._hear_due()  # a stop that has been heard by now ends what is delivered
        self._lose_what_came_before()
        # Everything due by now: after a late wake-up, all that the adapter would have delivered meanwhile.
        due_ns = last_delivery_ns(monotonic_ns(), self.latency_ms, self._opened_ns)
        began_ns = self._to_host.next_began_ns() or deadline_ns
        data = self._to_host.take(max(due_ns, deadline_ns))
        if self.knobs.collisions and self._to_sensor.free_ns > began_ns:
            data = self._garbled(data)
        if not self._baud_fits:
            data = self._garbled(data)
        taken = self._port.write(data)
        self._counted["bytes_delivered"] += taken
        self._counted["bytes_lost"] += len(data) - taken
        self._schedule_delivery()

    def _garbled(self, data: bytes) -> bytes:
        self._counted["bytes_garbled"] += len(data)
        return bytes(byte * 167 + 13 & 0xFF for byte in data)

    def _check_baud(self) -> None:
        self._baud_fits = bool(self._port.path) and self._port.baud_is(termios.B19200)

    # From the host to the sensor.

    def _on_bytes(self, data: bytes) -> None:
        self._check_baud()
        if not self._baud_fits:
            data = self._garbled(data)
        if self.knobs.echo:
            self._port.write(data)
        self._to_sensor.put(data, monotonic_ns())
        if self._to_sensor.room < READ_BYTES:
            self._port.pause()
        self._schedule_hearing()

    def _on_opened(self) -> None:
        """Take the port for open from when all that was written before has been sent: a real one is not closed before,
        and not within the byte that is then on its way to the host. Opening resets the adapter.
        """
        now_ns, sent_ns = monotonic_ns(), self._to_sensor.free_ns
        self._opened_ns = now_ns if sent_ns <= now_ns else sent_ns + BYTE_NS
        self._lose_what_came_before()
        self._schedule_delivery(anew=True)

    def _lose_what_came_before(self) -> None:
        self._counted["bytes_lost"] += len(self._to_host.take(self._opened_ns))

    def _schedule_hearing(self) -> None:
        if len(self._to_sensor) and "hear" not in self._timers:
            heard_ns = min(self._to_sensor.free_ns, monotonic_ns() + RX_STEP_NS)
            self._timers.at("hear", heard_ns, self._on_hearing)

    def _on_hearing(self, _deadline_ns: int) -> None:
        self._hear_due()
        self._schedule_hearing()

    def _hear_due(self) -> None:
        now_ns = monotonic_ns()
        began_ns = self._to_sensor.next_began_ns()
        data = self._to_sensor.take(now_ns)
        if self._to_sensor.room >= READ_BYTES:
            self._port.resume()
        if data and began_ns is not None and not self._is_stalled(now_ns):
            self._hear(data, began_ns, now_ns)

    def _hear(self, data: bytes, began_ns: int, now_ns: int) -> None:
        # Pauses are measured on the line: late processing on this host is not a pause of the client.
        pause_ns = began_ns - self._heard_until_ns
        self._heard_until_ns = min(self._to_sensor.free_ns, now_ns)
        if self._streaming:
            data = self._find_stop(data, now_ns)
        if data and now_ns >= self._modbus_from_ns:
            if pause_ns > REQUEST_PAUSE_NS:
                self._scanner.clear()
            for request in self._scanner.feed(data):
                self._counted["requests"] += 1
                self._serve(request, self._to_sensor.taken_ns())

    def _find_stop(self, data: bytes, now_ns: int) -> bytes:
        """Count 0xFF; a streaming sensor ignores everything else. Return the bytes after the stop."""
        for index, byte in enumerate(data, 1):
            self._stop_bytes_seen = self._stop_bytes_seen + 1 if byte == wire.STOP_BYTE else 0
            if self._stop_bytes_seen >= self.knobs.stop_bytes:
                self._streaming = False
                self._to_host.cut(self._to_sensor.taken_ns(len(data) - index))
                self._registers.output = 0
                self._counted["stops"] += 1
                self._modbus_from_ns = now_ns + nanoseconds(self.knobs.mode_change_ms)
                return data[index:]
        return b""

    def _serve(self, request: bytes, heard_ns: int) -> None:
        reply = self._registers.serve(request)
        selected = reply.selected
        if selected is not None:
            self._timers.at(
                "answer",
                heard_ns + nanoseconds(self.knobs.ack_delay_ms),
                lambda at_ns: self._select(selected, reply.answer, at_ns),
            )
        elif self.knobs.unknown == "exception" or not reply.is_refusal:
            answer = self._perhaps_damaged(reply.answer)
            self._timers.at(
                "answer", heard_ns + nanoseconds(self.knobs.answer_delay_ms), lambda at_ns: self._send(answer, at_ns)
            )

    def _perhaps_damaged(self, answer: bytes) -> bytes:
        self._answers += 1
        wrong = is_every_nth(self._answers, self.knobs.corrupt_answer_every)
        return answer[:-1] + bytes((answer[-1] ^ 0x10,)) if wrong else answer

    def _select(self, selected: int, answer: bytes, at_ns: int) -> None:
        self._registers.output = selected
        if self.knobs.ack:
            self._send(answer, at_ns)
        if selected == OUTPUT_STREAM:
            self._streaming = True
            self._stop_bytes_seen = 0
            self._counted["starts"] += 1

    def _is_stalled(self, now_ns: int) -> bool:
        return now_ns < self._stalled_until_ns
