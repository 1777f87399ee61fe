"""What the processes of `push watch` tell the one that shows it: msgpack, one report in each packet."""

from __future__ import annotations

import contextlib
import socket

import msgspec

from robot_io.messages import ArmRecord, BaseFeed, BaseRecord, JointState, SensorWrench, Stamped
from robot_io.tick import ControlState, FtReading


class DeviceReport(msgspec.Struct, frozen=True, tag=True):
    """What a device gave since the last report, and how it is."""

    device: str
    """ft, arm or base."""
    state: str
    """opening, up or lost."""
    cause: str = ""
    """Why it is not up, in words."""
    ft: tuple[Stamped[SensorWrench], ...] = ()
    arm: tuple[Stamped[JointState], ...] = ()
    base: tuple[Stamped[BaseFeed], ...] = ()


class RunReport(msgspec.Struct, frozen=True, tag=True):
    """What the newest tick of a run holds, and all readings of the sensor since the last report."""

    now_ns: int
    readings: tuple[FtReading, ...]
    ft_link: int
    arm: ArmRecord
    base: BaseRecord
    control: ControlState
    mode: int
    paused: bool
    faults: tuple[str, ...]


class RunEnded(msgspec.Struct, frozen=True, tag=True):
    """The run's log grows no more: why, in words. Comes from the process's status, which is never lost."""

    text: str


Report = DeviceReport | RunReport | RunEnded

_DECODER: msgspec.msgpack.Decoder[Report] = msgspec.msgpack.Decoder(Report)
_MOST_BYTES = 1 << 18


class ReportSender:
    """The sending end; a report that does not fit now is lost, never waited for."""

    def __init__(self, sender: socket.socket) -> None:
        self._socket = sender
        self._socket.setblocking(False)

    def send(self, report: Report) -> None:
        """Send one report."""
        with contextlib.suppress(OSError):
            self._socket.send(msgspec.msgpack.encode(report))


class ReportReader:
    """The receiving end of any number of senders."""

    def __init__(self, receiver: socket.socket) -> None:
        self._socket = receiver
        self._socket.setblocking(False)

    def fileno(self) -> int:
        """Return the descriptor that is readable when a report waits."""
        return self._socket.fileno()

    def read(self) -> list[Report]:
        """Return all reports that wait. Never blocks."""
        found: list[Report] = []
        with contextlib.suppress(OSError):
            while packet := self._socket.recv(_MOST_BYTES):
                found.append(_DECODER.decode(packet))
        return found

    def close(self) -> None:
        """Close it; idempotent."""
        self._socket.close()


def report_link() -> tuple[ReportReader, socket.socket]:
    """Return a reader, and the socket for its senders."""
    near, far = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    return ReportReader(near), far
