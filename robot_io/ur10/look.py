"""What a UR controller says of itself, asked by plain sockets: nothing is sent that starts, moves or writes anything.

The dashboard is asked questions; the RTDE connection receives. To learn whether the inputs that active holding needs
are free, an RTDE connection asks for them, hears whether it may have them, and closes: no value is written.
Sources: RTDE guide, dashboard server manuals CB3 and e-Series.
"""

from __future__ import annotations

import socket
import struct
import time

import msgspec

from robot_io.errors import DeviceProtocolError, DeviceUnreachable
from robot_io.messages import Vector6
from robot_io.ur10.generation import Generation, generation_of
from robot_io.ur10.plain_connection import (
    DASHBOARD_PORT,
    GREETING,
    RTDE_PORT,
    STEP_TIMEOUT_S,
    PlainConnection,
    not_a_robot,
)
from robot_io.ur10.preflight import begin_rtde, safety_of
from robot_io.ur10.state import UrModes

SCRIPT_PORT = 30003
RECEIVE_S = 0.2
LOOK_WITHIN_S = 3.0
INPUTS = tuple([f"input_int_register_{i}" for i in range(8)] + [f"input_double_register_{i}" for i in range(18)])
"""What ur_rtde's control interface claims for active holding (without the external force)."""

_OUTPUTS = (
    "timestamp,actual_q,actual_qd,robot_mode,joint_mode,safety_mode,runtime_state,robot_status_bits,safety_status_bits"
)
_TYPES = "DOUBLE,VECTOR6D,VECTOR6D,INT32,VECTOR6INT32,INT32,UINT32,UINT32,UINT32"
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


def ask_dashboard(host: str, generation: Generation) -> DashboardWords:
    """Ask model, serial number, modes and whether a program runs. Raises DeviceUnreachable or DeviceProtocolError."""
    with PlainConnection(host, DASHBOARD_PORT, time.monotonic() + LOOK_WITHIN_S) as dashboard:
        greeting = dashboard.read_line()
        if not greeting.startswith(GREETING):
            raise not_a_robot(dashboard.where, f"greeted with {greeting[:80]!r}")
        return DashboardWords(
            dashboard.ask("get robot model"),
            dashboard.ask("get serial number"),
            dashboard.ask_value("robotmode", "Robotmode: "),
            safety_of(dashboard, generation),
            dashboard.ask_value("running", "Program running: ") == "true",
        )


def receive(host: str) -> list[ArmPacket]:
    """Return the packets of a fifth of a second, in a row. Raises DeviceUnreachable or DeviceProtocolError."""
    with PlainConnection(host, RTDE_PORT, time.monotonic() + LOOK_WITHIN_S) as rtde:
        rate_hz = generation_of(host, begin_rtde(rtde)).rate_hz
        ask_outputs(rtde, rate_hz, _OUTPUTS, _TYPES)
        ask_to_send(rtde)
        return [_packet(rtde.where, rtde.read_frame("U")) for _ in range(round(RECEIVE_S * rate_hz))]


def ask_outputs(rtde: PlainConnection, rate_hz: float, names: str, types: str = "") -> str:
    """Ask for the values of `names` at a rate and return their types. Raises DeviceProtocolError unless `types`."""
    rtde.send(_frame("O", struct.pack(">d", rate_hz) + names.encode()))
    given = rtde.read_frame("O")[1:].decode("ascii", "replace")
    if types and given != types:
        raise DeviceProtocolError(
            f"it gives {given[:120]!r} for the values asked for",
            where=rtde.where,
            do="PolyScope 3.15 (CB3) and 5.4 (e-Series) give them all",
        )
    return given


def ask_to_send(rtde: PlainConnection) -> None:
    """Have the values sent that were asked for. Raises DeviceUnreachable or DeviceProtocolError."""
    rtde.send(_frame("S", b""))
    if rtde.read_frame("S") != b"\x01":
        raise DeviceProtocolError("it does not start to send", where=rtde.where, do="Restart the controller")


def inputs_in_use(host: str) -> list[str]:
    """Return the inputs of active holding that another client holds; no value is written. Raises as `receive`."""
    with PlainConnection(host, RTDE_PORT, time.monotonic() + LOOK_WITHIN_S) as rtde:
        begin_rtde(rtde)
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
