"""Look at a UR arm with plain sockets before the ur_rtde wheel touches it.

The wheel blocks for ever on a controller that accepts and stays silent, and aborts on one that sends
something else. Every step here has a deadline of 1 s, all together under 3.5 s, and nothing is sent that could
move the arm: two RTDE questions and five dashboard questions.
Sources: RTDE guide (framing, protocol 2), dashboard server manuals CB3 and e-Series.
"""

from __future__ import annotations

import struct
import time

from robot_io.errors import DeviceNotReady, DeviceProtocolError
from robot_io.messages import DeviceInfo
from robot_io.ur10.generation import DASHBOARD_TEXT_LIMIT, Generation, Version, generation_of, model_of
from robot_io.ur10.plain_connection import (
    DASHBOARD_PORT,
    GREETING,
    RTDE_PORT,
    STEP_TIMEOUT_S,
    PlainConnection,
    not_a_robot,
)

TOTAL_TIMEOUT_S = 3.3

_ASK_PROTOCOL_2 = bytes.fromhex("0005560002")
_ASK_VERSION = bytes.fromhex("000376")


def preflight(host: str, model: str = "") -> tuple[DeviceInfo, Generation]:
    """Identify the controller at `host` and require it ready to hold: RUNNING, safety NORMAL or REDUCED.

    model: which arm it must be (`UR10e`); empty for any. Takes at most 3.5 s. Raises DeviceUnreachable (no answer in
    time), DeviceProtocolError (no UR of CB3 3.15 or e-Series 5.4 or newer, another model), DeviceNotReady (not running,
    or stopped by safety).
    """
    deadline_s = time.monotonic() + TOTAL_TIMEOUT_S
    version = read_version(host, deadline_s)
    generation = generation_of(host, version)
    with PlainConnection(host, DASHBOARD_PORT, deadline_s) as dashboard:
        greeting = dashboard.read_line()
        if not greeting.startswith(GREETING):
            raise not_a_robot(dashboard.where, f"greeted with {greeting[:80]!r}")
        found = model_of(host, generation, dashboard.ask("get robot model"), model)
        serial = dashboard.ask("get serial number")
        _check_ready(host, dashboard, generation)
    number = ".".join(map(str, version))
    return DeviceInfo(found.lower(), host, found, number, serial if serial.isdigit() else ""), generation


def is_program_running(host: str) -> bool:
    """Ask the dashboard whether a program plays. Raises DeviceUnreachable or DeviceProtocolError."""
    with PlainConnection(host, DASHBOARD_PORT, time.monotonic() + 2 * STEP_TIMEOUT_S) as dashboard:
        dashboard.read_line()
        answer = dashboard.ask("running")
    if answer not in ("Program running: true", "Program running: false"):
        raise not_a_robot(f"{host}:{DASHBOARD_PORT}", f"answered {answer[:80]!r} to `running`")
    return answer.endswith("true")


def read_version(host: str, deadline_s: float) -> Version:
    """Return the controller's version by RTDE. Raises DeviceUnreachable or DeviceProtocolError."""
    with PlainConnection(host, RTDE_PORT, deadline_s) as rtde:
        return begin_rtde(rtde)


def begin_rtde(rtde: PlainConnection) -> Version:
    """Agree on protocol 2 and return the controller's version. Raises DeviceUnreachable or DeviceProtocolError."""
    rtde.send(_ASK_PROTOCOL_2)
    if rtde.read_frame("V") != b"\x01":
        raise DeviceProtocolError(
            "it does not speak RTDE protocol 2", where=rtde.where, do="It needs PolyScope 3.15 (CB3) or 5.4 (e-Series)"
        )
    rtde.send(_ASK_VERSION)
    body = rtde.read_frame("v")
    if len(body) != 16:
        raise not_a_robot(rtde.where, f"gave a version of {len(body)} bytes")
    major, minor, bugfix, build = struct.unpack(">4I", body)
    return major, minor, bugfix, build


def safety_of(dashboard: PlainConnection, generation: Generation) -> str:
    """Return what the dashboard calls the safety state: NORMAL, PROTECTIVE_STOP, AUTOMATIC_MODE_SAFEGUARD_STOP, ..."""
    question = generation.safety_question
    return dashboard.ask_value(question, f"{question.capitalize()}: ")[:DASHBOARD_TEXT_LIMIT]


def _check_ready(host: str, dashboard: PlainConnection, generation: Generation) -> None:
    robot_mode = dashboard.ask_value("robotmode", "Robotmode: ")
    safety_mode = safety_of(dashboard, generation)
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
