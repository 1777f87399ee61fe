"""The base as the control process sees it: one fixed-size record, written by the gate.

The reader judges by content and age only: every part carries the CLOCK_MONOTONIC time at which it arrived, and
`published_ns` is old when the gate is gone or frozen. The pushed object's pose is not here, on purpose: control
cannot use what it cannot see.
"""

from __future__ import annotations

import struct
from typing import ClassVar

import msgspec

from robot_io.messages import BaseStatus, BodyTwist, Pose2D

_NAN = float("nan")


class BaseRecord(msgspec.Struct, frozen=True, gc=False):
    """Newest state of the base: m, rad, m/s, rad/s; times in CLOCK_MONOTONIC ns, 0 where there is none yet."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/BaseRecord"
    pose: Pose2D = Pose2D(_NAN, _NAN, _NAN)
    """Pose of the base (not of its markers) in the WORLD frame."""
    pose_valid: bool = False
    """False: the newest pose message was no usable pose (null, no unit quaternion, another frame)."""
    pose_received_ns: int = 0
    pose_seq: int = 0
    """Counts pose messages, valid or not."""
    odometry: BodyTwist = BodyTwist(_NAN, _NAN, _NAN)
    """Measured velocity in the BODY frame; NaN where the message held null."""
    odometry_received_ns: int = 0
    odometry_seq: int = 0
    status: BaseStatus = BaseStatus(False, False, _NAN)
    status_received_ns: int = 0
    newest_inbound_ns: int = 0
    """When the newest message of any topic arrived."""
    newest_pong_ns: int = 0
    """When the bridge last answered a ping: proves its I/O thread only."""
    accepted_seq: int = 0
    """Sequence number of the last frame of control that the gate accepted."""
    verdict: int = 0
    """The gate's verdict on the newest frame it read (0: accepted)."""
    sent: BodyTwist = BodyTwist()
    """What really went out last."""
    sent_ns: int = 0
    latched: bool = False
    """The gate sends nothing but zero until it is restarted."""
    latch_cause: int = 0
    published_ns: int = 0
    """When this record was written."""


NO_BASE = BaseRecord()
"""What a reader holds before the first record."""

_LAYOUT = struct.Struct("<3d3q3d2q2qdq2q2q3dq3q")
BASE_RECORD_BYTES = _LAYOUT.size


def pack_base_record(record: BaseRecord) -> bytes:
    """Return the record as the payload of a `SharedRecord` (BASE_RECORD_BYTES long)."""
    pose, odometry, status, sent = record.pose, record.odometry, record.status, record.sent
    return _LAYOUT.pack(
        pose.x,
        pose.y,
        pose.yaw,
        record.pose_valid,
        record.pose_received_ns,
        record.pose_seq,
        odometry.vx,
        odometry.vy,
        odometry.omega,
        record.odometry_received_ns,
        record.odometry_seq,
        status.stop_engaged,
        status.drivers_active,
        status.battery_v,
        record.status_received_ns,
        record.newest_inbound_ns,
        record.newest_pong_ns,
        record.accepted_seq,
        record.verdict,
        sent.vx,
        sent.vy,
        sent.omega,
        record.sent_ns,
        record.latched,
        record.latch_cause,
        record.published_ns,
    )


def unpack_base_record(payload: bytes) -> BaseRecord:
    """Return the record held in a payload of BASE_RECORD_BYTES bytes."""
    v = _LAYOUT.unpack(payload)
    return BaseRecord(
        pose=Pose2D(*v[0:3]),
        pose_valid=bool(v[3]),
        pose_received_ns=v[4],
        pose_seq=v[5],
        odometry=BodyTwist(*v[6:9]),
        odometry_received_ns=v[9],
        odometry_seq=v[10],
        status=BaseStatus(bool(v[11]), bool(v[12]), v[13]),
        status_received_ns=v[14],
        newest_inbound_ns=v[15],
        newest_pong_ns=v[16],
        accepted_seq=v[17],
        verdict=v[18],
        sent=BodyTwist(*v[19:22]),
        sent_ns=v[22],
        latched=bool(v[23]),
        latch_cause=v[24],
        published_ns=v[25],
    )
