"""What the arm's process publishes of a driver that says what no driver may say."""

from __future__ import annotations

import pytest

from control.ft_input import ft_input
from robot_io.ipc.record import ARM_RECORD, TypedRecord
from robot_io.messages import NO_ARM, ZERO_JOINTS, ArmState, DeviceHealth, JointState, LinkState, Stamped
from tools.run.arm_process import publish


class Driver:
    def __init__(self, state: int, link: int = LinkState.UP) -> None:
        self.state, self.link = state, link

    def drain(self) -> tuple[Stamped[JointState], ...]:
        return (Stamped(JointState(ZERO_JOINTS, ZERO_JOINTS, self.state, 7, 1.5), 3, 1),)

    def health(self) -> DeviceHealth:
        return DeviceHealth(self.link, "", {}, 125.0)


@pytest.mark.parametrize(("state", "published"), [
    (int(ArmState.HOLDING), ArmState.HOLDING), (-1, ArmState.UNKNOWN), (256, ArmState.UNKNOWN), (255, 255),
])  # fmt: skip
def test_a_state_that_no_record_holds_is_unknown_and_the_process_goes_on(state, published):
    record = TypedRecord.create("arm", ARM_RECORD)
    publish(Driver(state), record, NO_ARM, servo=False)
    _, newest = record.read()
    assert newest.joints.state == published


@pytest.mark.parametrize("link", [-1, 256, 2**62])
def test_a_link_that_no_record_holds_is_lost(link):
    record = TypedRecord.create("arm", ARM_RECORD)
    publish(Driver(int(ArmState.HOLDING), link), record, NO_ARM, servo=True)
    _, newest = record.read()
    assert (newest.link, newest.servo) == (LinkState.LOST, False)
    lost = ft_input((), DeviceHealth(link, "", {}, 100.0), 0)
    assert lost.link == LinkState.LOST
