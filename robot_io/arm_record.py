"""The arm as the control process sees it: one fixed-size record, written by the arm's own process.

The reader judges by content and age only. `published_ns` is old when the writing process is gone, frozen or
hung; `changed_ns` is old when the process runs and the controller no longer sends. Neither needs a special
case for how it happened.
"""

from __future__ import annotations

import struct
from enum import IntEnum
from typing import ClassVar

import msgspec

from robot_io.messages import Joints, JointState

ZERO_JOINTS: Joints = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class ArmError(IntEnum):
    """What the arm's process found wrong, for the log and the operator; safety judges the data itself."""

    NONE = 0
    LINK_LOST = 1
    """The RTDE connection is gone."""
    TIME_WENT_BACK = 2
    """The controller's clock jumped back: it was restarted."""
    NOT_FINITE = 3
    """The newest packet holds NaN or infinity; passed on as it is, and over with the next good packet."""
    SERVO_STOPPED = 4
    """Active holding ended by itself: the control script no longer runs, or refused the target."""
    SERVO_NOT_HOLDING = 5
    """Active holding was given up: the joints were too far from the held target."""
    SERVO_STALE = 6
    """Active holding was given up: no new packet for too long."""


class ArmRecord(msgspec.Struct, frozen=True, gc=False):
    """Newest state of the arm: joints (rad, rad/s), times in CLOCK_MONOTONIC ns, 0 where there is none yet."""

    __ros_name__: ClassVar[str] = "push_msgs/msg/ArmRecord"
    joints: JointState = JointState(ZERO_JOINTS, ZERO_JOINTS, -1, 0, 0, 0, 0, 0.0, 0.0)
    joint_modes: tuple[int, int, int, int, int, int] = (0, 0, 0, 0, 0, 0)
    """Mode of each joint (253: running)."""
    packets: int = 0
    """How many packets of the controller were seen; the sequence number of `joints`."""
    published_ns: int = 0
    """When this record was written."""
    changed_ns: int = 0
    """When the controller's time stamp was last seen to change."""
    link: int = 0
    """A `LinkState`."""
    error: int = 0
    """An `ArmError`."""
    servo: bool = False
    """The arm is held actively (`hold = "servo"`) and so far without a fault."""
    child_pid: int = 0


NO_ARM = ArmRecord()
"""What a reader holds before the first record."""

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
