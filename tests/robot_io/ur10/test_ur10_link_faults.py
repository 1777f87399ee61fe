"""What goes wrong between the controller and the arm's process, seen through the record alone."""

import math
import time

import pytest

from robot_io.messages import ArmError, ArmState, LinkState
from robot_io.ur10.driver import Ur10
from tests.how_many import mostly_long
from tests.wire.ur_process import EmulatorProcess, wait_until


@pytest.fixture
def robot():
    with EmulatorProcess() as emulator:
        yield emulator


@pytest.fixture
def arm(robot):
    with Ur10(robot.host) as driver:
        wait_until(lambda: driver.read().packets > 12, "packets flow")
        yield driver


def data_age_ms(arm: Ur10) -> float:
    return (time.monotonic_ns() - arm.read().changed_ns) / 1e6


def record_age_ms(arm: Ur10) -> float:
    return (time.monotonic_ns() - arm.read().published_ns) / 1e6


@pytest.mark.parametrize(
    "fault", mostly_long(("close_clients", "reset_clients", "close_rtde_clients"), "close_clients")
)
def test_a_closed_connection_is_lost_and_never_comes_back_by_itself(robot, arm, fault: str) -> None:
    robot.call(fault)
    wait_until(lambda: arm.read().link == LinkState.LOST, "the record says lost")
    assert arm.read().error == ArmError.LINK_LOST
    assert arm.health().state == LinkState.LOST
    assert arm.health().cause == "link_lost"
    wait_until(lambda: record_age_ms(arm) > 300, "and stays")
    assert robot.get("counters.rtde_clients") == 0
    assert robot.get("counters.rtde_accepted") == 2, "preflight and one receive interface"


def test_a_killed_controller(robot, arm) -> None:
    robot.kill()
    wait_until(lambda: arm.read().link == LinkState.LOST, "the record says lost")


def test_a_frozen_controller_makes_the_data_old_while_the_record_stays_fresh(robot, arm) -> None:
    robot.freeze_process()
    try:
        wait_until(lambda: data_age_ms(arm) > 300, "the data grows old")
        assert record_age_ms(arm) < 300, "the arm's process still publishes"
        assert arm.read().link == LinkState.UP
        packets = arm.read().packets
    finally:
        robot.thaw_process()
    wait_until(lambda: arm.read().packets > packets + 10, "a short freeze passes")


@pytest.mark.long
def test_muted_data_is_lost_in_the_end(robot, arm) -> None:
    robot.call("mute")
    wait_until(lambda: arm.read().link == LinkState.LOST, "the wheel gives up after 2.5 s", within_s=6)


def test_garbage_aborts_the_child_and_leaves_an_old_record(robot, arm) -> None:
    robot.call("send_garbage")
    wait_until(lambda: record_age_ms(arm) > 100, "the record grows old")
    wait_until(lambda: arm.health().state == LinkState.LOST, "the process is gone")
    assert "SIG" in arm.health().cause
    arm.drain()
    assert arm.drain() == ()
    arm.stop()
    arm.close()
    assert arm.open().model == "UR10", "a fresh start works"


def test_a_truncated_frame_is_at_most_one_strange_state(robot, arm) -> None:
    strange = []
    robot.call("truncate_data", 20)  # time stamp and a part of the first joints
    packets = arm.read().packets

    def ten_later() -> bool:
        record = arm.read()
        if record.joints.position != (1.5708, -0.1745, 1.5708, -1.3963, 1.5708, 1.31) and record not in strange:
            strange.append(record)
        return record.packets > packets + 10 or record_age_ms(arm) > 100

    wait_until(ten_later, "it goes on, or the child has died")
    assert len({record.packets for record in strange}) <= 1


def test_nan_is_passed_on_and_marked(robot, arm) -> None:
    robot.call("nan_joint", 3)
    wait_until(lambda: arm.read().error == ArmError.NOT_FINITE, "marked")
    position = arm.read().joints.position
    assert math.isnan(position[3])
    assert position[:3] == (1.5708, -0.1745, 1.5708)
    assert arm.read().link == LinkState.UP
    assert wait_until(arm.drain, "a sample")[0].value.position[4] == 1.5708
    robot.call("nan_joint", 3, False)
    wait_until(lambda: arm.read().error == ArmError.NONE, "over with the next good packet")


def test_time_going_back_is_a_restarted_controller(robot, arm) -> None:
    robot.call("jump_time", -500.0)
    wait_until(lambda: arm.read().error == ArmError.TIME_WENT_BACK, "noticed")
    assert arm.read().link == LinkState.LOST
    wait_until(lambda: record_age_ms(arm) > 100, "the child has ended")


def test_time_jumping_forward_is_passed_on(robot, arm) -> None:
    robot.call("jump_time", 500.0)
    wait_until(lambda: arm.read().joints.controller_time_s > 1500, "the new time arrives")
    assert arm.read().error == ArmError.NONE


def test_a_time_stamp_that_is_not_a_number_is_no_news(robot, arm) -> None:
    """NaN differs from NaN: data that stand still, or a link that is gone, would look fresh for ever."""
    robot.call("jump_time", math.nan)
    wait_until(lambda: arm.read().error == ArmError.NOT_FINITE, "marked")
    wait_until(lambda: data_age_ms(arm) > 300, "the data grow old")
    robot.call("close_clients")
    wait_until(lambda: arm.read().link == LinkState.LOST, "the loss is seen")


def test_dropped_packets_do_not_matter(robot, arm) -> None:
    packets = arm.read().packets
    robot.call("drop_data", 5)
    wait_until(lambda: arm.read().packets > packets + 10, "data goes on")
    assert arm.read().error == ArmError.NONE


def test_text_messages_do_not_matter(robot, arm) -> None:
    packets = arm.read().packets
    robot.call("send_text", "hello")
    wait_until(lambda: arm.read().packets > packets + 10, "data goes on")


@pytest.mark.parametrize(
    ("fault", "state", "bits", "mask"),
    [
        # device_state: safety bits (2 bytes), then robot status, runtime, safety and robot mode
        (("protective_stop",), ArmState.PROTECTIVE_STOP, 0x0404_00_00_03_07, 0xFFFF_00_00_FF_FF),
        (("emergency_stop",), ArmState.EMERGENCY_STOP, 0x04C0_00_00_07_03, 0xFFFF_00_00_FF_FF),
        pytest.param(
            ("safeguard_stop",),
            ArmState.PROTECTIVE_STOP,
            0x0410_00_00_05_00,
            0xFFFF_00_00_FF_00,
            marks=pytest.mark.long,
        ),
        pytest.param(("power_off",), ArmState.OFF, 0x0000_00_00_00_03, 0x0000_FF_00_00_FF, marks=pytest.mark.long),
        (("teach_button", True), ArmState.MOVING, 0x0000_05_00_00_00, 0x0000_FF_00_00_00),
        (("play_other_program",), ArmState.FOREIGN_PROGRAM, 0x0000_03_02_00_00, 0x0000_FF_FF_00_00),
    ],
)
def test_states_reach_the_record(robot, arm, fault, state: ArmState, bits: int, mask: int) -> None:
    robot.call(*fault)
    wait_until(lambda: arm.read().joints.state == state, f"the record shows {state.name}")
    assert arm.read().joints.device_state & mask == bits


def test_drift_reaches_the_record_and_is_not_corrected(robot, arm) -> None:
    robot.call("drift_rate", [0.05, 0, 0, 0, 0, 0])
    wait_until(lambda: arm.read().joints.position[0] > 1.5758, "the joint creeps")
    assert arm.read().joints.velocity[0] == pytest.approx(0.05)
    robot.call("drift_rate", [0.0] * 6)
    wait_until(lambda: arm.read().joints.velocity[0] == 0.0, "at rest")
    assert arm.read().joints.position[0] > 1.5758


WHEEL_WITH_A_DESTRUCTOR = """
import os, time
class RTDEReceiveInterface:
    def __init__(self, *_): self.began_s = time.monotonic()
    def __del__(self): os.mkdir(os.environ["DESTROYED"])  # no file: that would need a descriptor
    def getTimestamp(self): return min(time.monotonic() - self.began_s, float(os.environ["LASTS_S"]))
    def isConnected(self): return self.getTimestamp() < float(os.environ["LASTS_S"])
    def getActualQ(self): return [0.0] * 6
    getActualQd = getActualQ
    def getRobotMode(self): return 1
    getSafetyMode = getSafetyStatusBits = getRobotStatus = getRuntimeState = getSpeedScaling = getRobotMode
    def getJointMode(self): return [253] * 6
"""


@pytest.mark.parametrize("lasts_s", [0.3, 1e9])
def test_no_destructor_of_the_wheel_runs(robot, tmp_path, monkeypatch, lasts_s: float) -> None:
    """They sleep 0.5 s each, and crash on a dead link: neither a lost link nor a clean end may run them."""
    (tmp_path / "rtde_receive.py").write_text(WHEEL_WITH_A_DESTRUCTOR)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setenv("DESTROYED", str(tmp_path / "destroyed"))
    monkeypatch.setenv("LASTS_S", str(lasts_s))
    with Ur10(robot.host) as arm:
        if lasts_s < 1:
            wait_until(lambda: arm.read().link == LinkState.LOST, "the record says lost")
            wait_until(lambda: "link_lost" in arm.health().cause, "and why")
    assert not (tmp_path / "destroyed").exists()
