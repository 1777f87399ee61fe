"""The force sensor at the flange of an e-Series arm, read over an RTDE connection of its own.

The connection only reads: it asks for outputs and claims no input, so the arm's own connection and any other client
are not disturbed. A reading is stamped when it was read. A restarted controller may have another bias, so a clock that
runs back is a lost link; only a fresh `open` brings it back.
"""

from __future__ import annotations

import socket
import time
from collections import deque
from collections.abc import Mapping
from typing import Any, ClassVar, Self

from robot_io.clock import NS_PER_S, monotonic_ns
from robot_io.driver import DriverBase, SensorFacts, no_more_options
from robot_io.errors import DeviceError, DeviceNotReady, DeviceProtocolError
from robot_io.messages import DeviceHealth, DeviceInfo, LinkState, SensorWrench, Stamped
from robot_io.rig.declared import TOOL_FORCE_FACTS
from robot_io.ur10.generation import E_SERIES, generation_of, model_of
from robot_io.ur10.look import ask_outputs, ask_to_send
from robot_io.ur10.plain_connection import DASHBOARD_PORT, GREETING, RTDE_PORT, PlainConnection, not_a_robot
from robot_io.ur10.preflight import begin_rtde
from robot_io.ur10.tool_packets import (
    RAW,
    TYPES_WITH_RAW,
    TYPES_WITHOUT_RAW,
    WITH_RAW,
    WITHOUT_RAW,
    BiasWatch,
    Packet,
    PacketParser,
)

OPEN_WITHIN_S = 3.0
MOST_READS = 8
READ_BYTES = 65536
MOST_SAMPLES = 2048
RATE_SAMPLES = 501
NOT_STREAMING = "it does not stream: call start()"


class UrToolForce(DriverBase):
    """The sensor of an e-Series arm: 500 readings a second of force (N) and torque (N*m) in the SENSOR frame.

    host: the arm's controller.
    model: which arm it must be (`"UR10e"`); empty for any.

    `ft_raw_wrench` where the controller has it (PolyScope 5.9), else `actual_TCP_force`. For one thread at a time, and
    it starts none; to wait for readings, `select` on the driver itself.
    """

    facts: ClassVar[SensorFacts] = TOOL_FORCE_FACTS["UR3e"]
    """Of the weakest model; a rig names its own."""

    def __init__(self, host: str, *, model: str = "") -> None:
        self.host = host
        self._where = f"ur-tool-force {host}"
        self._model = model
        self._rtde: PlainConnection | None = None
        self._socket: socket.socket | None = None
        self._state, self._cause = LinkState.CLOSED, "not opened"
        self._parser = PacketParser(with_raw=True)
        self._bias = BiasWatch()
        self._first = b""
        self._seq = -1
        self._controller_s = 0.0
        self._stamps: deque[int] = deque(maxlen=RATE_SAMPLES)
        self._packets_ok = 0

    @classmethod
    def from_rig(cls, address: str, options: Mapping[str, Any]) -> Self:
        """Return the sensor of the arm at `address`; `options` has the arm's `model`, and no others."""
        left = dict(options)
        model = left.pop("model", "")
        no_more_options("ur-tool-force", left)
        return cls(address, model=model)

    def open(self) -> DeviceInfo:
        """Identify the arm and ask for its readings; at most 3 s.

        Raises DeviceUnreachable, or DeviceProtocolError (no e-Series arm, another model, no UR at all).
        """
        self.close()
        deadline_s = time.monotonic() + OPEN_WITHIN_S
        rtde = PlainConnection(self.host, RTDE_PORT, deadline_s)
        try:
            version = begin_rtde(rtde)
            generation = generation_of(self.host, version)
            if generation != E_SERIES:
                raise DeviceProtocolError(
                    f"a {generation.name} arm has no force sensor: it estimates forces from motor currents",
                    where=self.host,
                    do='Use an e-Series arm, or a sensor at the wrist ([ft] kind = "robotiq-ft300")',
                )
            with PlainConnection(self.host, DASHBOARD_PORT, deadline_s) as dashboard:
                if not (greeting := dashboard.read_line()).startswith(GREETING):
                    raise not_a_robot(dashboard.where, f"greeted with {greeting[:80]!r}")
                model = model_of(self.host, generation, dashboard.ask("get robot model"), self._model)
                serial = dashboard.ask("get serial number")
            types = ask_outputs(rtde, generation.rate_hz, WITH_RAW)
            with_raw = types == TYPES_WITH_RAW
            if not with_raw:
                ask_outputs(rtde, generation.rate_hz, WITHOUT_RAW, TYPES_WITHOUT_RAW)
        except BaseException:
            rtde.close()
            raise
        self._rtde, self._parser = rtde, PacketParser(with_raw)
        self._state, self._cause = LinkState.UP, ""
        remarks = () if with_raw else (f"no {RAW} before PolyScope 5.9: it reads what the controller makes of it",)
        number = ".".join(map(str, version))
        return DeviceInfo("ur-tool-force", self.host, model, number, serial if serial.isdigit() else "", remarks)

    def start(self) -> None:
        """Have the readings sent; at most 1 s. Raises DeviceNotReady (not open), DeviceUnreachable."""
        if self._rtde is None or self._state is not LinkState.UP:
            raise DeviceNotReady(f"it is not open ({self._cause})", where=self._where, do="Open it first")
        if self._socket is not None:
            return
        try:
            self._rtde.give_time(OPEN_WITHIN_S)
            ask_to_send(self._rtde)
        except DeviceError as error:
            self._lose(error.what)
            raise
        self._socket, self._first = self._rtde.detach()
        self._socket.setblocking(False)
        self._bias, self._seq = BiasWatch(), -1
        self._stamps.clear()

    def fileno(self) -> int:
        """Return the descriptor to wait for (-1 while it does not stream)."""
        return self._socket.fileno() if self._socket is not None else -1

    def drain(self) -> tuple[Stamped[SensorWrench], ...]:
        """Return all new readings, oldest first: N and N*m in the SENSOR frame. Never blocks, never raises.

        Of n found at once the k-th is stamped (n-1-k)*2 ms before the newest, never before its predecessor. Those that
        the controller left out are missing in `seq`.
        """
        if self._socket is None or self._state is not LinkState.UP:
            return ()
        packets: list[Packet] = []
        try:
            packets += self._parser.feed(self._first)
            self._first = b""
            for _ in range(MOST_READS):
                data = self._socket.recv(READ_BYTES)
                if not data:
                    self._lose("the controller closed the connection")
                    break
                packets += self._parser.feed(data)
        except BlockingIOError:  # that was all for now
            pass
        except (OSError, ValueError) as error:
            self._lose(f"the connection broke: {error}")
        return self._stamped(packets[-MOST_SAMPLES:])

    def health(self) -> DeviceHealth:
        """Return link state, its cause, counters, and the rate (Hz) over the last second (0 after 1 s without).

        Counters since the driver was made: `packets_ok`; since `start`: `bias_jumps`.
        """
        cause = self._cause
        if self._state is LinkState.UP and self._socket is None:
            cause = NOT_STREAMING
        counters = {"packets_ok": self._packets_ok, "bias_jumps": self._bias.jumps}
        return DeviceHealth(self._state, cause, counters, self._rate_hz())

    def stop(self) -> None:
        """Stop the readings: the connection ends with them, as nothing else needs it. Never raises."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None
            if self._state is LinkState.UP:
                self._state, self._cause = LinkState.CLOSED, "stopped"

    def close(self) -> None:
        """Stop and release the connection. Never raises."""
        self.stop()
        if self._rtde is not None:
            self._rtde.close()
            self._rtde = None
        if self._state is not LinkState.CLOSED:
            self._state, self._cause = LinkState.CLOSED, self._cause or "closed"

    def _stamped(self, packets: list[Packet]) -> tuple[Stamped[SensorWrench], ...]:
        now_ns, samples = monotonic_ns(), []
        for older, packet in zip(range(len(packets) - 1, -1, -1), packets, strict=True):
            if self._seq >= 0 and packet.controller_s < self._controller_s:
                self._lose("the controller's clock ran back: it was restarted")
                break
            passed = (packet.controller_s - self._controller_s) * E_SERIES.rate_hz if self._seq >= 0 else 1.0
            self._seq += max(1, round(passed)) if passed < 1e6 else 1
            self._controller_s = packet.controller_s
            stamp_ns = now_ns - older * E_SERIES.cycle_ns
            stamp_ns = max(stamp_ns, self._stamps[-1]) if self._stamps else stamp_ns
            self._bias.take(packet)
            self._stamps.append(stamp_ns)
            samples.append(Stamped(packet.wrench, self._seq, stamp_ns, packet.controller_s))
        self._packets_ok += len(samples)
        return tuple(samples)

    def _rate_hz(self) -> float:
        if len(self._stamps) < 2 or monotonic_ns() - self._stamps[-1] > NS_PER_S:
            return 0.0
        span_ns = self._stamps[-1] - self._stamps[0]
        return (len(self._stamps) - 1) * NS_PER_S / span_ns if span_ns > 0 else 0.0

    def _lose(self, cause: str) -> None:
        self._state, self._cause = LinkState.LOST, cause
