"""What the arm's process publishes of a driver that says what no driver may say."""

from __future__ import annotations

import pytest

from robot_io.ipc.record import ARM_RECORD, TypedRecord
from robot_io.messages import NO_ARM, ZERO_JOINTS, ArmState, DeviceHealth, JointState, LinkState, Stamped
from tools.run.arm_process import publish


class Driver:
    def __init__(self, state: int) -> None:
        self.state = state

    def drain(self) -> tuple[Stamped[JointState], ...]:
        return (Stamped(JointState(ZERO_JOINTS, ZERO_JOINTS, self.state, 7, 1.5), 3, 1),)

    def health(self) -> DeviceHealth:
        return DeviceHealth(LinkState.UP, "", {}, 125.0)


@pytest.mark.parametrize(("state", "published"), [
    (int(ArmState.HOLDING), ArmState.HOLDING), (-1, ArmState.UNKNOWN), (256, ArmState.UNKNOWN), (255, 255),
])  # fmt: skip
def test_a_state_that_no_record_holds_is_unknown_and_the_process_goes_on(state, published):
    record = TypedRecord.create("arm", ARM_RECORD)
    publish(Driver(state), record, NO_ARM, servo=False)
    _, newest = record.read()
    assert newest.joints.state == published
