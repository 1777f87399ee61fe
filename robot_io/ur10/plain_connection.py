"""A plain TCP connection to a UR controller on which every step has a deadline: dashboard lines and RTDE frames.

Sources: RTDE guide (framing, protocol 2), dashboard server manuals CB3 and e-Series.
"""

from __future__ import annotations

import re
import socket
import struct
import time

from robot_io.errors import DeviceError, DeviceProtocolError, DeviceUnreachable

RTDE_PORT = 30004
DASHBOARD_PORT = 29999
STEP_TIMEOUT_S = 1.0
GREETING = "Connected: Universal Robots Dashboard Server"

_MOST_SKIPPED = 10
_ADVICE_CABLE = "Check that the robot is switched on, the cable and the address"


class PlainConnection:
    """A TCP connection on which every step has a deadline."""

    def __init__(self, host: str, port: int, deadline_s: float) -> None:
        self.where = f"{host}:{port}"
        self._deadline_s = deadline_s
        self._unread = b""
        try:
            self._socket = socket.create_connection((host, port), timeout=self._left_s())
        except TimeoutError as error:
            raise DeviceUnreachable("no answer to the connection", where=self.where, do=_ADVICE_CABLE) from error
        except (OSError, UnicodeError) as error:
            raise DeviceUnreachable(f"cannot connect ({_reason(error)})", where=self.where, do=_ADVICE_CABLE) from error

    def __enter__(self) -> PlainConnection:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the connection; idempotent."""
        self._socket.close()

    def give_time(self, seconds: float) -> None:
        """Let the next steps take this long from now on."""
        self._deadline_s = time.monotonic() + seconds

    def detach(self) -> tuple[socket.socket, bytes]:
        """Return the socket and what was received and not yet read; without deadlines from now on."""
        unread, self._unread = self._unread, b""
        return self._socket, unread

    def send(self, data: bytes) -> None:
        """Send all of `data`."""
        self._socket.settimeout(self._left_s())
        try:
            self._socket.sendall(data)
        except OSError as error:
            raise self._silent("the connection broke") from error

    def ask(self, line: str) -> str:
        """Send a dashboard command and return its one line of reply."""
        self.send(line.encode() + b"\n")
        return self.read_line()

    def ask_value(self, line: str, prefix: str) -> str:
        """Ask and return what follows `prefix` in the reply."""
        reply = self.ask(line)
        if not reply.startswith(prefix):
            raise not_a_robot(self.where, f"answered {reply[:80]!r} to `{line}`")
        return reply.removeprefix(prefix)

    def read_line(self) -> str:
        """Return the next line without its end."""
        while b"\n" not in self._unread:
            if len(self._unread) > 4096:
                raise not_a_robot(self.where, "sent a line without end")
            self._unread += self._receive()
        line, _, self._unread = self._unread.partition(b"\n")
        return re.sub(r"[^ -~]", "?", line.decode("ascii", "replace").strip())

    def read_frame(self, kind: str) -> bytes:
        """Return the payload of the next RTDE frame of type `kind`; text messages before it are skipped."""
        for _ in range(_MOST_SKIPPED):
            header = self._read(3)
            length, got = struct.unpack(">HB", header)
            if length < 3 or chr(got) not in (kind, "M"):
                raise not_a_robot(self.where, f"sent bytes {header.hex()} where an RTDE reply was due")
            body = self._read(length - 3)
            if chr(got) == kind:
                return body
        raise not_a_robot(self.where, "sent only text messages")

    def _read(self, count: int) -> bytes:
        while len(self._unread) < count:
            self._unread += self._receive()
        data, self._unread = self._unread[:count], self._unread[count:]
        return data

    def _receive(self) -> bytes:
        if time.monotonic() > self._deadline_s:
            raise self._silent("it answers too slowly")
        self._socket.settimeout(self._left_s())
        try:
            data = self._socket.recv(4096)
        except TimeoutError as error:
            raise self._silent(f"it accepts the connection and sends nothing for {STEP_TIMEOUT_S:g} s") from error
        except OSError as error:
            raise self._silent(f"the connection broke ({_reason(error)})") from error
        if not data:
            raise self._silent("it closed the connection")
        return data

    def _left_s(self) -> float:
        return max(0.01, min(STEP_TIMEOUT_S, self._deadline_s - time.monotonic()))

    def _silent(self, what: str) -> DeviceUnreachable:
        return DeviceUnreachable(
            what, where=self.where, do="Restart the controller if this stays, and check that nothing else holds it"
        )


def _reason(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error) or type(error).__name__


def not_a_robot(where: str, what: str) -> DeviceError:
    """Return the error of something at the address that does not behave as a UR controller."""
    return DeviceProtocolError(
        f"something there is not a UR controller: it {what}", where=where, do="Check the address of the arm"
    )
