"""The base as the control process sees it: frames to the gate, one shared record back.

Control never holds the base's connection. It sends one fixed frame a tick over a SEQPACKET socket and reads
the newest record the gate has published; both ends judge the other by age and content only.
"""

from __future__ import annotations

import socket

from robot_io.clock import ClockNs, monotonic_ns
from robot_io.ipc.gate_frame import GateFrame, pack_frame
from robot_io.ipc.record import BASE_RECORD, TypedRecord
from robot_io.messages import NO_BASE, BaseRecord, BodyTwist


class GateLink:
    """Control's end of the link to the gate."""

    def __init__(self, gate: socket.socket, record_fd: int, clock: ClockNs = monotonic_ns) -> None:
        """Take over both descriptors; the socket is made non-blocking."""
        self._gate = gate
        self._gate.setblocking(False)
        self._record = TypedRecord(record_fd, BASE_RECORD)
        self._clock = clock
        self._seq = 0
        self.alive = True
        """False once the gate is gone or no longer reads."""

    def command(self, twist: BodyTwist, *, tick: int, mode: int) -> None:
        """Send one frame (BODY frame, m/s, rad/s); never blocks, never raises when the gate is gone."""
        self._seq += 1
        try:
            self._gate.send(pack_frame(GateFrame(self._seq, tick, self._clock(), mode, twist)))
        except OSError:  # EPIPE: it is gone. EAGAIN: it does not read, and its own silence rule stops the base.
            self.alive = False

    def read(self) -> BaseRecord:
        """Return the newest record of the gate (NO_BASE before the first)."""
        found = self._record.read()
        return NO_BASE if found is None else found[1]

    def close(self) -> None:
        """Close both ends: the gate takes the EOF for the end of control. Idempotent."""
        self._gate.close()
        self._record.close()
