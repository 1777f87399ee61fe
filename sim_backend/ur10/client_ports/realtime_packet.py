"""The packet of port 30003 as bytes: everything a control loop wants, once every control cycle.

Source: Universal Robots real-time client interface, versions 3.0 to 5.10. It grew at its end from version to version.

packet: int32 length (of all) | the rows below
"""

from __future__ import annotations

import struct

from sim_backend.ur10.client_ports.layout import Layout, Row, always
from sim_backend.ur10.controller import UrController
from sim_backend.ur10.models import Version
from sim_backend.ur10.modes import RobotMode, RuntimeState, joint_mode

_NONE6 = (0.0,) * 6

_PROGRAM_STATE = {
    RuntimeState.STOPPING: 0,
    RuntimeState.STOPPED: 1,
    RuntimeState.PLAYING: 2,
    RuntimeState.PAUSING: 3,
    RuntimeState.PAUSED: 4,
    RuntimeState.RESUMING: 5,
}


def _joint_modes(robot: UrController) -> tuple[float, ...]:
    return (float(joint_mode(robot.robot_mode, robot.safety_mode)),) * 6


_SINCE_3_0: tuple[Row, ...] = (
    ("time", "double", lambda r: r.time_s),
    ("q target", "double[6]", lambda r: r.motion.target),
    ("qd target", "double[6]", lambda r: r.motion.velocity),
    ("qdd target", "double[6]", always(_NONE6)),
    ("I target", "double[6]", always((0.0, 4.6, 2.4, 0.4, 0.0, 0.0))),
    ("M target", "double[6]", always((0.0, 60.0, 30.0, 4.0, 0.0, 0.0))),
    ("q actual", "double[6]", lambda r: r.reported_q),
    ("qd actual", "double[6]", lambda r: r.motion.velocity),
    ("I actual", "double[6]", always((0.05, 4.6, 2.4, 0.4, 0.05, 0.02))),
    ("I control", "double[6]", always((0.05, 4.6, 2.4, 0.4, 0.05, 0.02))),
    ("tool vector actual", "double[6]", lambda r: r.tcp_pose),
    ("TCP speed actual", "double[6]", lambda r: r.tcp_speed),
    ("TCP force", "double[6]", lambda r: r.tcp_force),
    ("tool vector target", "double[6]", lambda r: r.tcp_pose),
    ("TCP speed target", "double[6]", lambda r: r.tcp_speed),
    ("digital input bits", "double", always(0.0)),
    ("motor temperatures", "double[6]", always((31.0, 32.0, 32.0, 34.0, 35.0, 35.0))),
    ("controller timer", "double", always(0.4)),
    ("test value", "double", always(0.0)),
    ("robot mode", "double", lambda r: float(r.robot_mode)),
    ("joint modes", "double[6]", _joint_modes),
    ("safety mode", "double", lambda r: float(r.safety_mode)),
    ("UR only", "double[6]", always(_NONE6)),
    ("tool accelerometer", "double[3]", always((0.0, -9.8, 0.0))),
    ("UR only", "double[6]", always(_NONE6)),
    ("speed scaling", "double", lambda r: r.speed_scaling),
    ("linear momentum norm", "double", always(0.0)),
    ("UR only", "double", always(0.0)),
    ("UR only", "double", always(0.0)),
    ("V main", "double", always(48.0)),
    ("V robot", "double", lambda r: 48.0 if r.robot_mode >= RobotMode.POWER_ON else 0.0),
    ("I robot", "double", always(0.8)),
    ("V actual", "double[6]", always((47.5,) * 6)),
)
_ADDED: tuple[tuple[Version, tuple[Row, ...]], ...] = (
    (
        (3, 2, 0, 0),
        (
            ("digital outputs", "double", lambda r: float(r.io.digital_out)),
            ("program state", "double", lambda r: float(_PROGRAM_STATE[r.runtime_state])),
        ),
    ),
    (
        (3, 5, 0, 0),
        (("elbow position", "double[3]", always((0.0,) * 3)), ("elbow velocity", "double[3]", always((0.0,) * 3))),
    ),
    ((3, 10, 0, 0), (("safety status", "double", lambda r: float(r.safety_mode)),)),
    ((3, 14, 0, 0), (("UR only", "double[3]", always((0.0,) * 3)),)),
    (
        (3, 15, 0, 0),
        (
            ("payload mass", "double", lambda r: r.payload_kg),
            ("payload CoG", "double[3]", lambda r: r.payload_cog_m),
            ("payload inertia", "double[6]", always(_NONE6)),
        ),
    ),
)  # fmt: skip
_E_SERIES_SINCE = {(3, 10, 0, 0): (5, 4, 0, 0), (3, 14, 0, 0): (5, 9, 0, 0), (3, 15, 0, 0): (5, 10, 0, 0)}
"""The e-Series versions that brought the same; what came before 3.10 is in all of them."""


def realtime_layout(version: Version) -> Layout:
    """Return the rows that a version of PolyScope sends."""
    rows = list(_SINCE_3_0)
    for cb3, added in _ADDED:
        since = cb3 if version[0] < 5 else _E_SERIES_SINCE.get(cb3, (5, 0, 0, 0))
        if version >= since:
            rows += added
    return Layout(rows)


def realtime_packet(layout: Layout, robot: UrController) -> bytes:
    """Return the packet of this control cycle."""
    return struct.pack(">i", 4 + layout.size) + layout.pack(robot)
