"""What the processes of a run are made of: event loop, ring, shared record, status lines, gate frames."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robot_io._lazy import exports

if TYPE_CHECKING:
    from robot_io.ipc.event_loop import EventLoop
    from robot_io.ipc.gate_frame import GateFrame
    from robot_io.ipc.gate_link import GateLink
    from robot_io.ipc.record import SharedRecord
    from robot_io.ipc.ring import Ring
    from robot_io.ipc.status import StatusPipe, StatusReader

__all__ = ["EventLoop", "GateFrame", "GateLink", "Ring", "SharedRecord", "StatusPipe", "StatusReader"]

__getattr__, __dir__ = exports(
    __name__,
    {
        "EventLoop": "event_loop",
        "GateFrame": "gate_frame",
        "GateLink": "gate_link",
        "Ring": "ring",
        "SharedRecord": "record",
        "StatusPipe": "status",
        "StatusReader": "status",
    },
)
