import struct

import pytest

from robot_io.ipc.arm_record import ARM_RECORD_BYTES, pack_arm_record, unpack_arm_record
from robot_io.ipc.record import SharedRecord
from robot_io.messages import NO_ARM, ArmError, ArmRecord, JointState, LinkState

RECORD = ArmRecord(
    joints=JointState(
        position=(1.0, 2.0, 3.0, 4.0, 5.0, 6.0),
        velocity=(0.1, 0.2, 0.3, 0.4, 0.5, 0.6),
        state=6,
        device_state=0x404_00_02_03_07,
        controller_time_s=1234.008,
    ),
    packets=77,
    published_ns=2**62 + 1,
    changed_ns=2**62,
    link=LinkState.UP,
    error=ArmError.NOT_FINITE,
    servo=True,
    child_pid=4321,
)


def test_every_field_survives_the_shared_record() -> None:
    shared = SharedRecord.create("arm-test", ARM_RECORD_BYTES)
    try:
        shared.publish(pack_arm_record(RECORD))
        newest = shared.read()
        assert newest is not None
        assert unpack_arm_record(newest[1]) == RECORD
    finally:
        shared.close()


def test_layout_starts_with_the_joints_as_little_endian_doubles() -> None:
    assert struct.unpack_from("<6d", pack_arm_record(RECORD)) == RECORD.joints.position


def test_a_short_payload_is_refused() -> None:
    with pytest.raises(struct.error):
        unpack_arm_record(pack_arm_record(RECORD)[:-1])


def test_the_record_before_the_first_is_closed_and_infinitely_old() -> None:
    assert NO_ARM.link == LinkState.CLOSED
    assert NO_ARM.published_ns == 0
    assert NO_ARM.changed_ns == 0
    assert unpack_arm_record(pack_arm_record(NO_ARM)) == NO_ARM
