"""Active holding: begins only when safe, corrects drift, and is over for good with the first fault."""

import os
import signal
import time

import pytest

from robot_io.errors import DeviceNotReady
from robot_io.ipc.record import ARM_RECORD, TypedRecord
from robot_io.messages import ArmError, LinkState
from robot_io.ur10.driver import Ur10, spawn_arm
from robot_io.ur10.job import ArmJob
from tests.how_many import mostly_long
from tests.wire.ur_process import EmulatorProcess, wait_until

HELD = (1.5708, -0.1745, 1.5708, -1.3963, 1.5708, 1.31)
DRIFT = [0.005, -0.005, 0.005, -0.005, 0.005, -0.005]


@pytest.fixture
def robot():
    with EmulatorProcess() as emulator:
        yield emulator


@pytest.fixture
def arm(robot):
    with Ur10(robot.host, hold="servo", held_pose_rad=HELD) as driver:
        wait_until(lambda: driver.read().servo, "it holds")
        yield driver


def error_rad(arm: Ur10) -> float:
    return max(abs(q - held) for q, held in zip(arm.read().joints.position, HELD, strict=True))


def test_holds_against_a_step_of_drift(robot, arm) -> None:
    packets = arm.read().packets
    robot.call("drift_step", DRIFT)
    wait_until(lambda: error_rad(arm) > 0.001, "the drift is seen")
    wait_until(lambda: error_rad(arm) < 0.0002, "and corrected")
    wait_until(lambda: arm.read().packets > packets + 60, "for a while")
    assert error_rad(arm) < 0.0002
    assert arm.read().servo
    assert arm.read().error == ArmError.NONE


def test_the_same_drift_stays_without_active_holding(robot) -> None:
    with Ur10(robot.host) as arm:
        robot.call("drift_step", DRIFT)
        packets = arm.read().packets
        wait_until(lambda: arm.read().packets > packets + 60, "a while later")
        assert error_rad(arm) == pytest.approx(0.005)
        assert not arm.read().servo


def test_holds_against_slow_drift(robot, arm) -> None:
    robot.call("drift_rate", [0.001] * 6)
    packets = arm.read().packets
    wait_until(lambda: arm.read().packets > packets + 60, "half a second")
    assert error_rad(arm) < 0.0002


def test_the_watchdog_is_set_before_the_first_target(robot, arm) -> None:
    assert robot.get("controller.watchdog") is not None
    assert robot.get("counters.watchdog_trips") == 0


SLOW_PREPARATION = """
import sys
if "robot_io.ur10.child" in sys.orig_argv:
    import time
    from robot_io.ipc import process
    process.lock_memory = lambda: time.sleep(0.3)
"""


def test_the_watchdog_does_not_wait_for_slow_preparations(robot, tmp_path, monkeypatch) -> None:
    """Locking the memory of a process takes long on a busy host, longer than the watchdog waits."""
    (tmp_path / "sitecustomize.py").write_text(SLOW_PREPARATION)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    with Ur10(robot.host, hold="servo", held_pose_rad=HELD) as arm:
        wait_until(lambda: arm.read().servo, "it holds")
        packets = arm.read().packets
        wait_until(lambda: arm.read().packets > packets + 30, "for a while")
        assert arm.read().servo
    assert robot.get("counters.watchdog_trips") == 0


def test_told_to_end_while_it_begins_it_ends_its_script(robot, tmp_path, monkeypatch) -> None:
    """No watchdog is armed yet: a script left behind would play until somebody stops it at the pendant."""
    (tmp_path / "sitecustomize.py").write_text(SLOW_PREPARATION)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    record = TypedRecord.create("arm", ARM_RECORD)
    child = spawn_arm(ArmJob(robot.host, "servo", record.fd, os.getpid()))
    try:
        wait_until(lambda: robot.get("controller.runtime_state") == 2, "the script plays")
    finally:
        code = child.stop(5.0)
        child.close()
        record.close()
    assert code == 0
    wait_until(lambda: robot.get("controller.runtime_state") == 1, "the script has ended")
    assert robot.get("counters.watchdog_trips") == 0


def test_ends_by_stopping_its_script(robot) -> None:
    """Not by the watchdog; an overloaded host may starve the child for 0.1 s, hence three tries."""
    trips = []
    for _ in range(3):
        before = robot.get("counters.watchdog_trips")
        with Ur10(robot.host, hold="servo", held_pose_rad=HELD) as arm:
            wait_until(lambda arm=arm: arm.read().servo, "it holds")
        wait_until(lambda: robot.get("controller.runtime_state") == 1, "the program has ended")
        assert arm.health().state == LinkState.CLOSED
        trips.append(robot.get("counters.watchdog_trips") - before)
        if trips[-1] == 0:
            return
    pytest.fail(f"watchdog trips in three tries: {trips}")


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_a_dead_or_frozen_child_is_stopped_by_the_controller(robot, arm, number: signal.Signals) -> None:
    os.kill(arm.read().child_pid, number)
    wait_until(lambda: robot.get("counters.watchdog_trips") == 1, "the watchdog acts")
    assert robot.get("controller.runtime_state") == 1


def test_refuses_a_playing_program_and_leaves_it_playing(robot) -> None:
    robot.call("play_other_program", "theirs")
    wait_until(lambda: robot.get("controller.runtime_state") == 2, "it plays")
    with pytest.raises(DeviceNotReady, match="program is running"):
        Ur10(robot.host, hold="servo", held_pose_rad=HELD).open()
    assert robot.get("controller.runtime_state") == 2
    assert robot.get("controller.program.name") == "theirs"
    assert robot.get("requests.script_bytes") == 0
    assert robot.get("requests.input_setups") == 0
    assert "stop" not in robot.get("requests.dashboard_lines")


def test_refuses_a_paused_program(robot) -> None:
    robot.call("play_other_program", "theirs")
    wait_until(lambda: robot.get("controller.runtime_state") == 2, "it plays")
    robot.call("pause_program")
    with pytest.raises(DeviceNotReady, match="program is running"):
        Ur10(robot.host, hold="servo", held_pose_rad=HELD).open()
    assert robot.get("controller.runtime_state") == 4


def test_refuses_another_pose(robot) -> None:
    robot.call("drift_step", [0, 0, 0.2, 0, 0, 0])
    with pytest.raises(DeviceNotReady, match=r"0\.200 rad from the held pose"):
        Ur10(robot.host, hold="servo", held_pose_rad=HELD, held_pose_tolerance_rad=0.05).open()
    assert robot.get("requests.script_bytes") == 0


def test_refuses_a_moving_arm(robot) -> None:
    robot.call("drift_rate", [0.03, 0, 0, 0, 0, 0])
    with pytest.raises(DeviceNotReady, match="moving"):
        Ur10(robot.host, hold="servo").open()
    assert robot.get("requests.script_bytes") == 0


@pytest.mark.long
def test_a_script_that_does_not_start_is_said(robot) -> None:
    robot.call("ignore_scripts")
    with pytest.raises(DeviceNotReady, match="control script"):
        Ur10(robot.host, hold="servo", held_pose_rad=HELD).open()


@pytest.mark.parametrize(
    ("fault", "error"),
    [
        (("protective_stop",), ArmError.SERVO_STOPPED),
        pytest.param(("stop_program",), ArmError.SERVO_STOPPED, marks=pytest.mark.long),
        pytest.param(("pause_program",), ArmError.SERVO_STOPPED, marks=pytest.mark.long),
        pytest.param(("emergency_stop",), ArmError.SERVO_STOPPED, marks=pytest.mark.long),
        (("drift_step", [0, 0, 0, 0.2, 0, 0]), ArmError.SERVO_NOT_HOLDING),
        (("nan_joint", 2), ArmError.NOT_FINITE),
        (("mute",), ArmError.SERVO_STALE),
    ],
)
def test_the_first_fault_ends_it_for_good(robot, arm, fault, error: ArmError) -> None:
    robot.call(*fault)
    wait_until(lambda: arm.read().error != ArmError.NONE, "a fault is reported")
    assert arm.read().error == error
    assert not arm.read().servo
    wait_until(lambda: robot.get("controller.runtime_state") == 1, "the controller has stopped the program")
    started = robot.get("counters.programs_started")
    if fault[0] != "mute":
        robot.call("clear_stop")
    robot.call("resume_program")
    frames = robot.get("counters.cycles") + 40
    wait_until(lambda: robot.get("counters.cycles") > frames, "a third of a second later")
    assert robot.get("counters.programs_started") == started
    assert robot.get("controller.runtime_state") == 1, "nothing has resumed"


@pytest.mark.parametrize(
    "fault", mostly_long(("close_clients", "reset_clients", "close_rtde_clients"), "reset_clients")
)
def test_a_lost_connection_does_not_restart_the_script(robot, arm, fault: str) -> None:
    """The wheel's own thread, or its servoJ, would connect again and upload the script once more.

    Which of them meets the loss first is chance: the record says lost, or the process is gone and it grows old.
    """
    accepted = robot.get("counters.rtde_accepted")
    robot.call(fault)
    wait_until(lambda: arm.health().state == LinkState.LOST, "the arm is lost")
    frames = robot.get("counters.cycles") + 60
    wait_until(lambda: robot.get("counters.cycles") > frames, "half a second later")
    assert robot.get("controller.runtime_state") == 1, "the watchdog has stopped the program"
    assert robot.get("counters.programs_started") == 1
    assert robot.get("counters.rtde_accepted") == accepted, "nothing has connected again"
    assert arm.read().error == ArmError.LINK_LOST or time.monotonic_ns() - arm.read().published_ns > 100e6
