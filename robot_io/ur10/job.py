"""What the arm's process is told when it starts, and what it reports: one JSON object in, JSON lines out.

in (stdin):         ArmJob
out (status_fd):    {"event": "ready", "info": {DeviceInfo}, "realtime": true|false}
                    {"event": "error", "kind": "DeviceUnreachable", "error": {"code", "what", "where", "do"}}
"""

from __future__ import annotations

import json
from typing import Literal

import msgspec

from robot_io.errors import DeviceError, DeviceNotReady, DeviceProtocolError, DeviceUnreachable, PushError
from robot_io.messages import DeviceInfo, Joints

Hold = Literal["monitor", "servo"]

DEFAULT_PRIORITY = 81
"""SCHED_FIFO priority of the arm's publishing thread, where the system allows it."""

_KINDS: dict[str, type[DeviceError]] = {
    kind.__name__: kind for kind in (DeviceError, DeviceUnreachable, DeviceProtocolError, DeviceNotReady)
}


class ArmJob(msgspec.Struct, frozen=True):
    """How to hold which arm (angles in rad), and where to write."""

    host: str
    hold: Hold
    record_fd: int
    parent_pid: int
    held_pose_rad: Joints | None = None
    """Where the arm must be for active holding; None: wherever it is."""
    held_pose_tolerance_rad: float = 0.05
    status_fd: int | None = None
    realtime_priority: int = DEFAULT_PRIORITY


class ArmReady(msgspec.Struct, frozen=True):
    """The arm's process publishes."""

    info: DeviceInfo
    realtime: bool


def ready_line(info: DeviceInfo, realtime: bool) -> bytes:
    """Return the status line of a process that publishes."""
    event = {"event": "ready", "info": msgspec.to_builtins(info), "realtime": realtime}
    return json.dumps(event).encode() + b"\n"


def error_line(error: PushError) -> bytes:
    """Return the status line of a process that gives up."""
    event = {"event": "error", "kind": type(error).__name__, "error": error.as_json()}
    return json.dumps(event).encode() + b"\n"


def parse_status(line: bytes) -> ArmReady:
    """Return what a status line says. Raises the error it reports, or DeviceError when it makes no sense."""
    try:
        event = json.loads(line)
        if event["event"] == "ready":
            return ArmReady(msgspec.convert(event["info"], DeviceInfo), bool(event["realtime"]))
        kind = _KINDS.get(event["kind"], DeviceError)
        raise kind(event["error"]["what"], where=event["error"]["where"], do=event["error"]["do"])
    except (ValueError, KeyError, TypeError, msgspec.ValidationError) as error:
        raise DeviceError(f"the arm's process reported {line[:100]!r}", do="This is a defect of the program") from error
