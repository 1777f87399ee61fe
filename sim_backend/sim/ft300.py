"""The force-torque sensor of level `sim`: the driver contract on a virtual clock, without a wire.

Like a real one (by default an FT 300) it samples on its own time grid, quantises, and delivers each
sample when its last byte would have been read. Not modelled: garbled packets, the adapter's bunching, opening and
closing times.
"""

from __future__ import annotations

from collections import deque

from robot_io.clock import NS_PER_MS, NS_PER_S, ClockNs
from robot_io.driver import DriverBase
from robot_io.errors import DeviceNotReady
from robot_io.messages import DeviceHealth, DeviceInfo, LinkState, SensorWrench, Stamped, Vector6
from sim_backend.world.plant import FtSource

LINE_NS = 16 * NS_PER_S // 1920
"""16 bytes at 1920 bytes a second."""
FT300_RESOLUTION: Vector6 = (0.01, 0.01, 0.01, 0.001, 0.001, 0.001)
FT300_LIMIT: Vector6 = (327.67, 327.67, 327.67, 32.767, 32.767, 32.767)
"""The range of an int16 in steps of the resolution."""
MAX_IN_FLIGHT = 512


class SimFt300(DriverBase):
    """Samples `source` at (k + phase) / rate_hz of `clock` (ns) and delivers them one line time + latency later.

    Drain it before other devices that share the world, so that each sample is read close to its own time.
    """

    def __init__(
        self,
        source: FtSource,
        clock: ClockNs,
        *,
        rate_hz: float = 100.016,
        phase: float = 0.37,
        latency_ms: int = 1,
        resolution: Vector6 = FT300_RESOLUTION,
        limit: Vector6 = FT300_LIMIT,
    ) -> None:
        self._source = source
        self._clock = clock
        self._rate_hz = rate_hz
        self._steps_per_unit = tuple(1.0 / step for step in resolution)
        self._limit = limit
        self._phase = phase
        self._age_ns = LINE_NS + latency_ms * NS_PER_MS
        self._state = LinkState.CLOSED
        self._streaming = False
        self._index = 0
        self._next_seq = 0
        self._in_flight: deque[Stamped[SensorWrench]] = deque()
        self._packets_ok = 0
        self._overflow = 0

    def open(self) -> DeviceInfo:
        """Identify the device; never fails."""
        self.close()
        self._state = LinkState.UP
        return DeviceInfo(device="ft300", where="sim", model="simulated FT 300")

    def start(self) -> None:
        """Start sampling at the next grid time. Raises DeviceNotReady when not open."""
        if self._state is not LinkState.UP:
            raise DeviceNotReady("it is not open", where="ft300 sim", do="Open it first")
        if self._streaming:
            return
        self._streaming = True
        self._index = int(self._clock() * self._rate_hz / NS_PER_S - self._phase)
        while self._sample_ns() < self._clock():
            self._index += 1

    def drain(self) -> tuple[Stamped[SensorWrench], ...]:
        """Return the samples that have arrived by now, oldest first: N, N*m in the SENSOR frame."""
        now_ns = self._clock()
        while self._streaming and (sample_ns := self._sample_ns()) <= now_ns:
            wrench = self._quantised(self._source.read_ft(sample_ns))
            self._in_flight.append(Stamped(wrench, self._next_seq, sample_ns + self._age_ns))
            self._index += 1
            self._next_seq += 1
            if len(self._in_flight) > MAX_IN_FLIGHT:
                self._in_flight.popleft()
                self._overflow += 1
        arrived = []
        while self._in_flight and self._in_flight[0].received_ns <= now_ns:
            arrived.append(self._in_flight.popleft())
        self._packets_ok += len(arrived)
        return tuple(arrived)

    def health(self) -> DeviceHealth:
        """Return link state, counters and the nominal rate."""
        cause = "" if self._streaming else "it does not stream: call start()"
        if self._state is not LinkState.UP:
            cause = "closed"
        counters = {"packets_ok": self._packets_ok, "overflow": self._overflow}
        return DeviceHealth(self._state, cause, counters, self._rate_hz if self._streaming else 0.0)

    def stop(self) -> None:
        """Stop sampling; samples still on the line are lost. Idempotent."""
        self._streaming = False
        self._in_flight.clear()

    def close(self) -> None:
        """Stop and close; idempotent."""
        self.stop()
        self._state = LinkState.CLOSED

    def _sample_ns(self) -> int:
        return round((self._index + self._phase) * NS_PER_S / self._rate_hz)

    def _quantised(self, wrench: Vector6) -> SensorWrench:
        """Return the wrench (N, N*m) in integer steps of the resolution, clipped at the limit of each axis."""
        fx, fy, fz, mx, my, mz = map(_rounded, wrench, self._steps_per_unit, self._limit)
        return SensorWrench(fx, fy, fz, mx, my, mz)


def _rounded(value: float, steps_per_unit: float, limit: float) -> float:
    return round(min(max(value, -limit), limit) * steps_per_unit) / steps_per_unit
