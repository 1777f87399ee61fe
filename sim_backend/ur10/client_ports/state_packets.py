"""The robot-state packet of the ports 30001 and 30002 as bytes, ten times a second.

Source: Universal Robots client interface manual, versions 3.2 to 5.x; constants of a healthy robot at rest where
nothing is modelled. Kinematics and configuration are in a connection's first packet only. Parts that the manual gives
to UR's own software alone are left out but for the calibration data of the primary port.

packet: int32 length (of all) | uint8 16 | parts; part: int32 length (of it) | uint8 kind | the rows below
"""

from __future__ import annotations

import struct
import zlib

from sim_backend.ur10.client_ports.layout import Layout, Row, always
from sim_backend.ur10.controller import UrController
from sim_backend.ur10.models import ALPHA_RAD, UrModel, Version
from sim_backend.ur10.modes import RobotMode, RuntimeState, SafetyMode, joint_mode
from sim_backend.ur10.motion.limits import position_limits, speed_limits

_PACKET = struct.Struct(">iB")
_ROBOT_STATE = 16
_NONE6 = (0.0,) * 6
_FLANGE_REACH_M = 0.25
"""The tool's equivalent radius."""

_EMERGENCY = (SafetyMode.SYSTEM_EMERGENCY_STOP, SafetyMode.ROBOT_EMERGENCY_STOP)
_ROBOT_TYPE = {"UR5": 1, "UR10": 2, "UR3": 3, "UR16": 4}

_MODE: tuple[Row, ...] = (
    ("timestamp", "uint64", lambda r: r.time_ns),
    ("real robot connected", "bool", always(True)),
    ("real robot enabled", "bool", always(True)),
    ("robot power on", "bool", lambda r: r.robot_mode >= RobotMode.POWER_ON),
    ("emergency stopped", "bool", lambda r: r.safety_mode in _EMERGENCY),
    ("protective stopped", "bool", lambda r: r.safety_mode == SafetyMode.PROTECTIVE_STOP),
    ("program running", "bool", lambda r: r.runtime_state == RuntimeState.PLAYING),
    ("program paused", "bool", lambda r: r.runtime_state == RuntimeState.PAUSED),
    ("robot mode", "int8", lambda r: r.robot_mode),
    ("control mode", "uint8", always(0)),
    ("target speed fraction", "double", lambda r: r.speed_fraction),
    ("speed scaling", "double", lambda r: r.speed_scaling),
    ("target speed fraction limit", "double", always(1.0)),
)
_MODE_SINCE_3_5: tuple[Row, ...] = (*_MODE, ("UR only", "uint8", always(0)))

_CARTESIAN: tuple[Row, ...] = (
    ("x, y, z, rx, ry, rz", "double[6]", lambda r: r.tcp_pose),
    ("TCP offset", "double[6]", lambda r: r.tcp_offset),
)
_CALIBRATION: tuple[Row, ...] = (("UR only", "double[6]", always(_NONE6)),)
_MASTERBOARD: tuple[Row, ...] = (
    ("digital input bits", "uint32", always(0)),
    ("digital output bits", "uint32", lambda r: r.io.digital_out),
    ("analog input range 0", "uint8", always(1)),
    ("analog input range 1", "uint8", always(1)),
    ("analog input 0", "double", always(0.0)),
    ("analog input 1", "double", always(0.0)),
    ("analog output domain 0", "uint8", lambda r: r.io.analog_domain[0]),
    ("analog output domain 1", "uint8", lambda r: r.io.analog_domain[1]),
    ("analog output 0", "double", lambda r: r.io.analog_out[0]),
    ("analog output 1", "double", lambda r: r.io.analog_out[1]),
    ("masterboard temperature", "float", always(36.0)),
    ("robot voltage 48 V", "float", always(48.0)),
    ("robot current", "float", always(0.8)),
    ("IO current", "float", always(0.0)),
    ("safety mode", "uint8", lambda r: r.safety_mode),
    ("in reduced mode", "uint8", lambda r: r.safety_mode == SafetyMode.REDUCED),
    ("euromap67 installed", "uint8", always(0)),
    ("UR only", "uint32", always(0)),
)
_MASTERBOARD_E_SERIES: tuple[Row, ...] = (
    *_MASTERBOARD,
    ("operational mode selector", "uint8", always(1)),
    ("three position enabling device", "uint8", always(1)),
    ("UR only", "uint8", always(1)),
)
_TOOL: tuple[Row, ...] = (
    ("analog input range 2", "uint8", always(1)),
    ("analog input range 3", "uint8", always(1)),
    ("analog input 2", "double", always(0.0)),
    ("analog input 3", "double", always(0.0)),
    ("tool voltage 48 V", "float", always(48.0)),
    ("tool output voltage", "uint8", always(0)),
    ("tool current", "float", always(0.0)),
    ("tool temperature", "float", always(36.0)),
    ("tool mode", "uint8", always(253)),
)
_FORCE_MODE: tuple[Row, ...] = (("wrench", "double[6]", always(_NONE6)), ("dexterity", "double", always(0.5)))
_ADDITIONAL: tuple[Row, ...] = (
    ("teach button pressed", "bool", lambda r: r.teach_button),
    ("teach button enabled", "bool", always(True)),
)
_ADDITIONAL_E_SERIES: tuple[Row, ...] = (
    *_ADDITIONAL,
    ("IO enabled freedrive", "bool", always(False)),
    ("UR only", "uint8", always(1)),
)


def _joint_rows(i: int) -> tuple[Row, ...]:
    return (
        ("q actual", "double", lambda r: r.reported_q[i]),
        ("q target", "double", lambda r: r.motion.target[i]),
        ("qd actual", "double", lambda r: r.motion.velocity[i]),
        ("I actual", "float", always((0.05, 4.6, 2.4, 0.4, 0.05, 0.02)[i])),
        ("V actual", "float", always(47.5)),
        ("T motor", "float", always((31.0, 32.0, 32.0, 34.0, 35.0, 35.0)[i])),
        ("T micro", "float", always(0.0)),
        ("joint mode", "uint8", lambda r: joint_mode(r.robot_mode, r.safety_mode)),
    )


_JOINTS: tuple[Row, ...] = tuple(row for i in range(6) for row in _joint_rows(i))


def _kinematics(model: UrModel) -> tuple[Row, ...]:
    """Return the arm's calibration: the published parameters, and a checksum of them for each joint."""
    theta = (0.0,) * 6
    checksums = [zlib.crc32(struct.pack(">4d", theta[i], model.a_m[i], model.d_m[i], ALPHA_RAD[i])) for i in range(6)]
    return (
        ("checksum", "uint32[6]", always(checksums)),
        ("DH theta", "double[6]", always(theta)),
        ("DH a", "double[6]", always(model.a_m)),
        ("DH d", "double[6]", always(model.d_m)),
        ("DH alpha", "double[6]", always(ALPHA_RAD)),
        ("calibration status", "uint32", always(0)),
    )


def _configuration(model: UrModel) -> tuple[Row, ...]:
    e_series = model.generation == "e-Series"
    limits: list[Row] = []
    for turn in position_limits(model):
        limits += [("joint minimum", "double", always(-turn)), ("joint maximum", "double", always(turn))]
    for speed in speed_limits(model):
        limits += [("joint speed limit", "double", always(speed)), ("joint acceleration limit", "double", always(40.0))]
    return (
        *limits,
        ("v joint default", "double", always(1.05)),
        ("a joint default", "double", always(1.4)),
        ("v tool default", "double", always(0.25)),
        ("a tool default", "double", always(1.2)),
        ("equivalent radius", "double", always(_FLANGE_REACH_M)),
        ("DH a", "double[6]", always(model.a_m)),
        ("DH d", "double[6]", always(model.d_m)),
        ("DH alpha", "double[6]", always(ALPHA_RAD)),
        ("DH theta", "double[6]", always(_NONE6)),
        ("masterboard version", "int32", always(6 if e_series else 4)),
        ("controller box type", "int32", always(4 if e_series else 0)),
        ("robot type", "int32", always(_ROBOT_TYPE[model.dashboard_name])),
        ("robot sub type", "int32", always(3 if e_series else 1)),
    )


class StatePackets:
    """The robot-state packets of one controller."""

    def __init__(self, model: UrModel, version: Version) -> None:
        e_series = version[0] >= 5
        self._mode = Layout(_MODE_SINCE_3_5 if version >= (3, 5, 0, 0) else _MODE)
        self._joints = Layout(_JOINTS)
        self._cartesian = Layout(_CARTESIAN)
        self._kinematics = Layout(_kinematics(model))
        self._calibration = Layout(_CALIBRATION)
        self._masterboard = Layout(_MASTERBOARD_E_SERIES if e_series else _MASTERBOARD)
        self._tool = Layout(_TOOL)
        self._configuration = Layout(_configuration(model))
        self._force_mode = Layout(_FORCE_MODE)
        self._additional = Layout(_ADDITIONAL_E_SERIES if e_series else _ADDITIONAL)

    def packet(self, robot: UrController, *, primary: bool, first: bool) -> bytes:
        """Return the packet of now for a port, with what only a connection's `first` packet has."""
        parts = [(0, self._mode), (1, self._joints), (4, self._cartesian)]
        if first:
            parts.append((5, self._kinematics))
        if primary:
            parts.append((9, self._calibration))
        parts += [(3, self._masterboard), (2, self._tool)]
        if first:
            parts.append((6, self._configuration))
        parts += [(7, self._force_mode), (8, self._additional)]
        body = b"".join(_PACKET.pack(_PACKET.size + layout.size, kind) + layout.pack(robot) for kind, layout in parts)
        return _PACKET.pack(_PACKET.size + len(body), _ROBOT_STATE) + body
