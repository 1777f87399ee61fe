import math

import msgspec

from robot_io.ipc.base_record import BASE_RECORD_BYTES, pack_base_record, unpack_base_record
from robot_io.ipc.record import SharedRecord
from robot_io.messages import NO_BASE, BaseRecord, BaseStatus, BodyTwist, Pose2D

FULL = BaseRecord(
    pose=Pose2D(1.25, -2.5, 3.0),
    pose_valid=True,
    pose_received_ns=101,
    pose_seq=102,
    odometry=BodyTwist(0.1, -0.2, 0.3),
    odometry_received_ns=103,
    odometry_seq=104,
    status=BaseStatus(True, False, 25.5),
    status_received_ns=105,
    newest_inbound_ns=106,
    newest_pong_ns=107,
    accepted_seq=108,
    verdict=9,
    sent=BodyTwist(0.4, 0.5, -0.6),
    sent_ns=110,
    latched=True,
    latch_cause=11,
    published_ns=112,
)


def test_every_field_survives_packing_and_no_two_are_mixed_up():
    assert all(getattr(FULL, name) != getattr(NO_BASE, name) for name in BaseRecord.__struct_fields__)
    payload = pack_base_record(FULL)
    assert len(payload) == BASE_RECORD_BYTES
    assert unpack_base_record(payload) == FULL


def test_status_flags_are_not_swapped():
    record = msgspec.structs.replace(FULL, status=BaseStatus(False, True, 20.0))
    assert unpack_base_record(pack_base_record(record)).status == BaseStatus(False, True, 20.0)


def test_nan_stays_nan_before_anything_arrived():
    record = unpack_base_record(pack_base_record(NO_BASE))
    assert math.isnan(record.pose.x)
    assert math.isnan(record.odometry.omega)
    assert not record.pose_valid


def test_passes_through_a_shared_record():
    shared = SharedRecord.create("base", BASE_RECORD_BYTES)
    shared.publish(pack_base_record(FULL))
    got = shared.read()
    assert got is not None
    assert unpack_base_record(got[1]) == FULL
    shared.close()


def test_the_object_is_not_in_the_record():
    assert not [name for name in BaseRecord.__struct_fields__ if "slider" in name or "object" in name]
