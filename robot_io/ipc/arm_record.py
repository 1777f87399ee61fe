"""The arm's record as the payload of a `SharedRecord`: fixed size, written by the arm's own process."""

from __future__ import annotations

import struct

from robot_io.messages import ArmRecord, JointState

_LAYOUT = struct.Struct("<12d5q2d6q3q2qqq")
ARM_RECORD_BYTES = _LAYOUT.size


def pack_arm_record(record: ArmRecord) -> bytes:
    """Return the record as the payload of a `SharedRecord` (ARM_RECORD_BYTES long)."""
    joints = record.joints
    return _LAYOUT.pack(
        *joints.position,
        *joints.velocity,
        joints.robot_mode,
        joints.safety_mode,
        joints.safety_bits,
        joints.robot_status_bits,
        joints.runtime_state,
        joints.speed_scaling,
        joints.controller_time_s,
        *record.joint_modes,
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
    joints = JointState(v[0:6], v[6:12], v[12], v[13], v[14], v[15], v[16], v[17], v[18])
    return ArmRecord(joints, v[19:25], v[25], v[26], v[27], v[28], v[29], bool(v[30]), v[31])
