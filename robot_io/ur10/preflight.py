"""Look at a UR10 with plain sockets before the ur_rtde wheel touches it.

The wheel blocks for ever on a controller that accepts and stays silent, and aborts on one that sends
something else. Every step here has a deadline of 1 s, all together under 3.5 s, and nothing is sent that could
move the arm: two RTDE questions and five dashboard questions.
Sources: RTDE guide (framing, protocol 2), dashboard server manual CB3.
"""

from __future__ import annotations

import re
import socket
import struct
import time

from robot_io.errors import DeviceError, DeviceNotReady, DeviceProtocolError, DeviceUnreachable
from robot_io.messages import DeviceInfo

RTDE_PORT = 30004
DASHBOARD_PORT = 29999
STEP_TIMEOUT_S = 1.0
TOTAL_TIMEOUT_S = 3.3
MODEL = "UR10"
MAJOR = 3
MIN_MINOR = 15
GREETING = "Connected: Universal Robots Dashboard Server"

_ASK_PROTOCOL_2 = bytes.fromhex("0005560002")
_ASK_VERSION = bytes.fromhex("000376")
_ADVICE_CABLE = "Check that the robot is switched on, the cable and the address"


def preflight(host: str) -> DeviceInfo:
    """Identify the controller at `host` and require it ready to hold: RUNNING, safety NORMAL or REDUCED.

    Takes at most 3.5 s. Raises DeviceUnreachable (no answer in time), DeviceProtocolError (not a UR10 of CB3
    3.15 or newer 3.x), DeviceNotReady (not running, or stopped by safety).
    """
    deadline_s = time.monotonic() + TOTAL_TIMEOUT_S
    version = _read_version(host, deadline_s)
    _check_version(host, version)
    with _Connection(host, DASHBOARD_PORT, deadline_s) as dashboard:
        greeting = dashboard.read_line()
        if not greeting.startswith(GREETING):
            raise _not_a_robot(dashboard.where, f"greeted with {greeting[:80]!r}")
        model = dashboard.ask("get robot model")
        if model != MODEL:
            raise DeviceProtocolError(
                f"this is a {model[:40]!r}, not a {MODEL}", where=host, do="Give the address of the UR10"
            )
        serial = dashboard.ask("get serial number")
        _check_ready(host, dashboard)
    return DeviceInfo("ur10", host, model, ".".join(map(str, version)), serial if serial.isdigit() else "")


def is_program_running(host: str) -> bool:
    """Ask the dashboard whether a program plays. Raises DeviceUnreachable or DeviceProtocolError."""
    with _Connection(host, DASHBOARD_PORT, time.monotonic() + 2 * STEP_TIMEOUT_S) as dashboard:
        dashboard.read_line()
        answer = dashboard.ask("running")
    if answer not in ("Program running: true", "Program running: false"):
        raise _not_a_robot(f"{host}:{DASHBOARD_PORT}", f"answered {answer[:80]!r} to `running`")
    return answer.endswith("true")


def _read_version(host: str, deadline_s: float) -> tuple[int, int, int, int]:
    with _Connection(host, RTDE_PORT, deadline_s) as rtde:
        rtde.send(_ASK_PROTOCOL_2)
        accepted = rtde.read_frame("V")
        if accepted != b"\x01":
            raise DeviceProtocolError(
                "it does not speak RTDE protocol 2", where=rtde.where, do="A CB3 controller needs PolyScope 3.15"
            )
        rtde.send(_ASK_VERSION)
        body = rtde.read_frame("v")
        if len(body) != 16:
            raise _not_a_robot(rtde.where, f"gave a version of {len(body)} bytes")
        major, minor, bugfix, build = struct.unpack(">4I", body)
        return major, minor, bugfix, build


def _check_version(host: str, version: tuple[int, int, int, int]) -> None:
    major, minor = version[:2]
    if major != MAJOR or minor < MIN_MINOR:
        raise DeviceProtocolError(
            f"the controller runs PolyScope {'.'.join(map(str, version))}, this driver needs {MAJOR}.{MIN_MINOR} "
            f"or a newer {MAJOR}.x",
            where=host,
            do="Update the controller, or use a UR10 with a CB3 controller",
        )


def _check_ready(host: str, dashboard: _Connection) -> None:
    robot_mode = dashboard.ask_value("robotmode", "Robotmode: ")
    safety_mode = dashboard.ask_value("safetymode", "Safetymode: ")
    if safety_mode not in ("NORMAL", "REDUCED"):
        raise DeviceNotReady(
            f"the arm is stopped by safety ({safety_mode})",
            where=host,
            do="Clear the stop at the teach pendant, look at why it happened, and try again",
        )
    if robot_mode != "RUNNING":
        raise DeviceNotReady(
            f"the arm is not running (robot mode {robot_mode})",
            where=host,
            do="Switch the arm on and release the brakes at the teach pendant",
        )


class _Connection:
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

    def __enter__(self) -> _Connection:
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()

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
            raise _not_a_robot(self.where, f"answered {reply[:80]!r} to `{line}`")
        return reply.removeprefix(prefix)

    def read_line(self) -> str:
        """Return the next line without its end."""
        while b"\n" not in self._unread:
            if len(self._unread) > 4096:
                raise _not_a_robot(self.where, "sent a line without end")
            self._unread += self._receive()
        line, _, self._unread = self._unread.partition(b"\n")
        return re.sub(r"[^ -~]", "?", line.decode("ascii", "replace").strip())

    def read_frame(self, kind: str) -> bytes:
        """Return the payload of the next RTDE frame of type `kind`; text messages before it are skipped."""
        for _ in range(10):
            header = self._read(3)
            length, got = struct.unpack(">HB", header)
            if length < 3 or chr(got) not in "VvM":
                raise _not_a_robot(self.where, f"sent bytes {header.hex()} where an RTDE reply was due")
            body = self._read(length - 3)
            if chr(got) == kind:
                return body
        raise _not_a_robot(self.where, "sent only text messages")

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


def _not_a_robot(where: str, what: str) -> DeviceError:
    return DeviceProtocolError(
        f"something there is not a UR controller: it {what}", where=where, do="Check the address of the arm"
    )
