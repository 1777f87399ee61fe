"""The arm's record as the payload of a `SharedRecord`: fixed size, written by the arm's own process."""

from __future__ import annotations

import struct

from robot_io.messages import ArmRecord, JointState

_LAYOUT = struct.Struct("<12d2qd3q2qqq")
ARM_RECORD_BYTES = _LAYOUT.size


def pack_arm_record(record: ArmRecord) -> bytes:
    """Return the record as the payload of a `SharedRecord` (ARM_RECORD_BYTES long)."""
    joints = record.joints
    return _LAYOUT.pack(
        *joints.position,
        *joints.velocity,
        joints.state,
        joints.device_state,
        joints.controller_time_s,
        record.packets,
        record.published_ns,
        record.changed_ns,
        record.link,
        record.error,
        record.servo,
        record.child_pid,
    )


def unpack_arm_record(payload: bytes) -> ArmRecord:
    """Return the record held in a payload of ARM_RECORD_BYTES bytes."""
    v = _LAYOUT.unpack(payload)
    joints = JointState(v[0:6], v[6:12], v[12], v[13], v[14])
    return ArmRecord(joints, v[15], v[16], v[17], v[18], v[19], bool(v[20]), v[21])
