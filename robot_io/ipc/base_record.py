"""The base's record as the payload of a `SharedRecord`: fixed size, written by the gate."""

from __future__ import annotations

import struct

from robot_io.messages import BaseRecord, BaseStatus, BodyTwist, Pose2D

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
