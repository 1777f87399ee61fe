"""The records of arm and base between processes: every field survives, and all messages take the same room."""

import math
import os
from pathlib import Path

import msgspec
import pytest

from robot_io.cdr.cdr_type import CdrType
from robot_io.errors import LogDamaged
from robot_io.ipc.record import ARM_RECORD, BASE_RECORD, TypedRecord
from robot_io.messages import (
    NO_ARM,
    NO_BASE,
    ArmError,
    ArmRecord,
    BaseRecord,
    BaseStatus,
    BodyTwist,
    JointState,
    LinkState,
    Pose2D,
)

BASE = BaseRecord(
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
    travel_m=1.13,
    moving_s=11.4,
    object_pose=Pose2D(2.25, -1.5, 0.75),
    object_received_ns=115,
    lag_ns=116,
    pose_stamp_ns=117,
    odometry_stamp_ns=118,
)
ARM = ArmRecord(
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


def test_every_field_of_the_base_survives_and_no_two_are_mixed_up() -> None:
    assert all(getattr(BASE, name) != getattr(NO_BASE, name) for name in BaseRecord.__struct_fields__)
    assert through(BASE_RECORD, BASE) == BASE
    swapped = msgspec.structs.replace(BASE, status=BaseStatus(False, True, 20.0))
    assert through(BASE_RECORD, swapped).status == BaseStatus(False, True, 20.0)


def test_every_field_of_the_arm_survives() -> None:
    assert all(getattr(ARM, name) != getattr(NO_ARM, name) for name in ArmRecord.__struct_fields__)
    assert through(ARM_RECORD, ARM) == ARM


def test_nothing_but_nan_and_zero_is_known_before_anything_arrived() -> None:
    base, arm = through(BASE_RECORD, NO_BASE), through(ARM_RECORD, NO_ARM)
    assert all(map(math.isnan, (base.pose.x, base.odometry.omega, base.status.battery_v)))
    assert not base.pose_valid
    assert (arm.link, arm.published_ns, arm.changed_ns) == (LinkState.CLOSED, 0, 0)
    assert arm == NO_ARM


@pytest.mark.parametrize(("message_type", "values"), [(BASE_RECORD, (BASE, NO_BASE)), (ARM_RECORD, (ARM, NO_ARM))])
def test_all_messages_take_the_same_room(message_type, values) -> None:
    assert message_type.fixed_size
    assert len({len(message_type.encode(value)) for value in values}) == 1


def test_the_newest_wins_with_its_number_in_every_view() -> None:
    record = TypedRecord.create("test", BASE_RECORD)
    other = TypedRecord(os.dup(record.fd), BASE_RECORD)
    assert (other.read(), other.count) == (None, 0)
    record.publish(BASE)
    record.publish(msgspec.structs.replace(BASE, accepted_seq=109))
    assert other.read() == (2, msgspec.structs.replace(BASE, accepted_seq=109))
    assert other.count == 2
    for view in (record, other):
        view.close()
        view.close()
        assert view.fd == -1


class Words(msgspec.Struct, frozen=True):
    number: int
    text: str


class Sequence(msgspec.Struct, frozen=True):
    numbers: tuple[float, ...]


@pytest.mark.parametrize("struct_type", [Words, Sequence])
def test_a_type_of_varying_size_is_refused(struct_type) -> None:
    varying = CdrType(struct_type, "test_msgs/msg/Varying")
    assert not varying.fixed_size
    with pytest.raises(TypeError, match="test_msgs/msg/Varying has no fixed size"):
        TypedRecord.create("test", varying)


def test_a_short_payload_is_refused() -> None:
    with pytest.raises(LogDamaged):
        ARM_RECORD.decode(ARM_RECORD.encode(ARM)[:-1])


def test_control_never_reads_where_the_object_is() -> None:
    """Its pose is in the record for the workspace only; the law has nothing but the force."""
    fields = [name for name in BaseRecord.__struct_fields__ if "slider" in name or "object" in name]
    assert fields == ["object_pose", "object_received_ns"]
    sources = list((Path(__file__).parents[3] / "control").rglob("*.py"))
    assert len(sources) > 10
    assert not [path.name for path in sources if any(field in path.read_text("utf-8") for field in fields)]


def through(message_type, value):
    record = TypedRecord.create("test", message_type)
    try:
        record.publish(value)
        found = record.read()
        assert found is not None
        return found[1]
    finally:
        record.close()
