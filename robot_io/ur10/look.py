"""What a UR controller says of itself, asked by plain sockets: nothing is sent that starts, moves or writes anything.

The dashboard is asked questions; the RTDE connection receives. To learn whether the inputs that active holding needs
are free, an RTDE connection asks for them, hears whether it may have them, and closes: no value is written.
Sources: RTDE guide, dashboard server manual CB3.
"""

from __future__ import annotations

import socket
import struct
import time

import msgspec

from robot_io.errors import DeviceProtocolError, DeviceUnreachable
from robot_io.messages import Vector6
from robot_io.ur10.plain_connection import (
    DASHBOARD_PORT,
    GREETING,
    RTDE_PORT,
    STEP_TIMEOUT_S,
    PlainConnection,
    not_a_robot,
)
from robot_io.ur10.preflight import ASK_PROTOCOL_2
from robot_io.ur10.state import UrModes

SCRIPT_PORT = 30003
PACKETS = 25
"""A fifth of a second at 125 Hz."""
LOOK_WITHIN_S = 3.0
INPUTS = tuple([f"input_int_register_{i}" for i in range(8)] + [f"input_double_register_{i}" for i in range(18)])
"""What ur_rtde's control interface claims for active holding (without the external force)."""

_OUTPUTS = (
    "timestamp,actual_q,actual_qd,robot_mode,joint_mode,safety_mode,runtime_state,robot_status_bits,safety_status_bits"
)
_TYPES = b"DOUBLE,VECTOR6D,VECTOR6D,INT32,VECTOR6INT32,INT32,UINT32,UINT32,UINT32"
_LAYOUT = struct.Struct(">d6d6di6iiIII")


class DashboardWords(msgspec.Struct, frozen=True):
    """What the dashboard says."""

    model: str
    serial: str
    robot_mode: str
    safety_mode: str
    program_running: bool


class ArmPacket(msgspec.Struct, frozen=True):
    """One packet of the controller: its clock in s, joints in rad and rad/s."""

    controller_s: float
    position: Vector6
    velocity: Vector6
    modes: UrModes


def ask_dashboard(host: str) -> DashboardWords:
    """Ask model, serial number, modes and whether a program runs. Raises DeviceUnreachable or DeviceProtocolError."""
    with PlainConnection(host, DASHBOARD_PORT, time.monotonic() + LOOK_WITHIN_S) as dashboard:
        greeting = dashboard.read_line()
        if not greeting.startswith(GREETING):
            raise not_a_robot(dashboard.where, f"greeted with {greeting[:80]!r}")
        return DashboardWords(
            dashboard.ask("get robot model"),
            dashboard.ask("get serial number"),
            dashboard.ask_value("robotmode", "Robotmode: "),
            dashboard.ask_value("safetymode", "Safetymode: "),
            dashboard.ask_value("running", "Program running: ") == "true",
        )


def receive(host: str) -> list[ArmPacket]:
    """Return 25 packets in a row. Raises DeviceUnreachable or DeviceProtocolError."""
    with _rtde(host) as rtde:
        rtde.send(_frame("O", struct.pack(">d", 125.0) + _OUTPUTS.encode()))
        answer = rtde.read_frame("O")
        if answer[1:] != _TYPES:
            raise DeviceProtocolError(
                f"it gives {answer[1:].decode('ascii', 'replace')[:120]!r} for the values asked for",
                where=rtde.where,
                do="A CB3 controller with PolyScope 3.15 gives them all",
            )
        rtde.send(_frame("S", b""))
        if rtde.read_frame("S") != b"\x01":
            raise DeviceProtocolError("it does not start to send", where=rtde.where, do="Restart the controller")
        return [_packet(rtde.where, rtde.read_frame("U")) for _ in range(PACKETS)]


def inputs_in_use(host: str) -> list[str]:
    """Return the inputs of active holding that another client holds; no value is written. Raises as `receive`."""
    with _rtde(host) as rtde:
        rtde.send(_frame("I", ",".join(INPUTS).encode()))
        answer = rtde.read_frame("I")
        types = answer[1:].decode("ascii", "replace").split(",")
        return [name for name, kind in zip(INPUTS, types, strict=False) if kind == "IN_USE"]


def accepts_scripts(host: str) -> None:
    """Connect to the script port and close it again; nothing is sent. Raises DeviceUnreachable."""
    try:
        socket.create_connection((host, SCRIPT_PORT), timeout=STEP_TIMEOUT_S).close()
    except OSError as error:
        raise DeviceUnreachable(
            f"cannot connect ({error})", where=f"{host}:{SCRIPT_PORT}", do="Check that nothing filters this port"
        ) from error


def _rtde(host: str) -> PlainConnection:
    rtde = PlainConnection(host, RTDE_PORT, time.monotonic() + LOOK_WITHIN_S)
    try:
        rtde.send(ASK_PROTOCOL_2)
        if rtde.read_frame("V") != b"\x01":
            raise DeviceProtocolError("it does not speak RTDE protocol 2", where=rtde.where)
    except BaseException:
        rtde.__exit__()
        raise
    return rtde


def _frame(kind: str, body: bytes) -> bytes:
    return struct.pack(">HB", 3 + len(body), ord(kind)) + body


def _packet(where: str, body: bytes) -> ArmPacket:
    if len(body) != 1 + _LAYOUT.size:
        raise not_a_robot(where, f"sent a packet of {len(body)} bytes")
    values = _LAYOUT.unpack_from(body, 1)
    q, qd = values[1:7], values[7:13]
    robot_mode, joint_modes, (safety_mode, runtime, status, bits) = values[13], values[14:20], values[20:24]
    modes = UrModes(robot_mode, safety_mode, bits, status, runtime, joint_modes)
    return ArmPacket(values[0], q, qd, modes)
