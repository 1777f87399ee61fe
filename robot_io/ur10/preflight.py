"""Look at a UR10 with plain sockets before the ur_rtde wheel touches it.

The wheel blocks for ever on a controller that accepts and stays silent, and aborts on one that sends
something else. Every step here has a deadline of 1 s, all together under 3.5 s, and nothing is sent that could
move the arm: two RTDE questions and five dashboard questions.
Sources: RTDE guide (framing, protocol 2), dashboard server manual CB3.
"""

from __future__ import annotations

import struct
import time

from robot_io.errors import DeviceNotReady, DeviceProtocolError
from robot_io.messages import DeviceInfo
from robot_io.ur10.plain_connection import (
    DASHBOARD_PORT,
    GREETING,
    RTDE_PORT,
    STEP_TIMEOUT_S,
    PlainConnection,
    not_a_robot,
)

TOTAL_TIMEOUT_S = 3.3
MODEL = "UR10"
MAJOR = 3
MIN_MINOR = 15

ASK_PROTOCOL_2 = bytes.fromhex("0005560002")
_ASK_VERSION = bytes.fromhex("000376")


def preflight(host: str) -> DeviceInfo:
    """Identify the controller at `host` and require it ready to hold: RUNNING, safety NORMAL or REDUCED.

    Takes at most 3.5 s. Raises DeviceUnreachable (no answer in time), DeviceProtocolError (not a UR10 of CB3
    3.15 or newer 3.x), DeviceNotReady (not running, or stopped by safety).
    """
    deadline_s = time.monotonic() + TOTAL_TIMEOUT_S
    version = read_version(host, deadline_s)
    check_version(host, version)
    with PlainConnection(host, DASHBOARD_PORT, deadline_s) as dashboard:
        greeting = dashboard.read_line()
        if not greeting.startswith(GREETING):
            raise not_a_robot(dashboard.where, f"greeted with {greeting[:80]!r}")
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
    with PlainConnection(host, DASHBOARD_PORT, time.monotonic() + 2 * STEP_TIMEOUT_S) as dashboard:
        dashboard.read_line()
        answer = dashboard.ask("running")
    if answer not in ("Program running: true", "Program running: false"):
        raise not_a_robot(f"{host}:{DASHBOARD_PORT}", f"answered {answer[:80]!r} to `running`")
    return answer.endswith("true")


def read_version(host: str, deadline_s: float) -> tuple[int, int, int, int]:
    """Return the controller's version by RTDE. Raises DeviceUnreachable or DeviceProtocolError."""
    with PlainConnection(host, RTDE_PORT, deadline_s) as rtde:
        rtde.send(ASK_PROTOCOL_2)
        accepted = rtde.read_frame("V")
        if accepted != b"\x01":
            raise DeviceProtocolError(
                "it does not speak RTDE protocol 2", where=rtde.where, do="A CB3 controller needs PolyScope 3.15"
            )
        rtde.send(_ASK_VERSION)
        body = rtde.read_frame("v")
        if len(body) != 16:
            raise not_a_robot(rtde.where, f"gave a version of {len(body)} bytes")
        major, minor, bugfix, build = struct.unpack(">4I", body)
        return major, minor, bugfix, build


def check_version(host: str, version: tuple[int, int, int, int]) -> None:
    """Raise DeviceProtocolError for a controller other than CB3 with PolyScope 3.15 or a newer 3.x."""
    major, minor = version[:2]
    if major != MAJOR or minor < MIN_MINOR:
        raise DeviceProtocolError(
            f"the controller runs PolyScope {'.'.join(map(str, version))}, this driver needs {MAJOR}.{MIN_MINOR} "
            f"or a newer {MAJOR}.x",
            where=host,
            do="Update the controller, or use a UR10 with a CB3 controller",
        )


def _check_ready(host: str, dashboard: PlainConnection) -> None:
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
