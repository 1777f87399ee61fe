"""The driver against the wire emulator: what it sends, what it gives, and how it survives its own child."""

import itertools
import os
import signal
import subprocess
import sys
import time

import pytest

from robot_io.errors import DeviceError, DeviceNotReady, DeviceProtocolError, DeviceUnreachable
from robot_io.ipc.record import ARM_RECORD, TypedRecord
from robot_io.messages import ArmState, LinkState
from robot_io.ur10.driver import ArmLink, Ur10, spawn_arm
from robot_io.ur10.job import ArmJob
from tests.how_many import mostly_long
from tests.wire.ur_process import EmulatorProcess, fresh_address, wait_until

HELD = (1.5708, -0.1745, 1.5708, -1.3963, 1.5708, 1.31)
MOVING_LINES = ("play", "stop", "pause", "power", "brake", "unlock", "load", "restart", "shutdown", "close safety")


@pytest.fixture
def robot():
    with EmulatorProcess() as emulator:
        yield emulator


@pytest.fixture
def arm(robot):
    with Ur10(robot.host) as driver:
        yield driver


def age_ms(arm: Ur10 | ArmLink) -> float:
    record = arm.read()
    assert record is not None
    return (time.monotonic_ns() - record.published_ns) / 1e6


def child_pid(arm: Ur10) -> int:
    record = arm.read()
    assert record is not None
    return record.child_pid


def test_samples_carry_joints_modes_stamps_and_rising_numbers(arm) -> None:
    samples = []

    def ten() -> bool:
        samples.extend(arm.drain())
        return len(samples) >= 10

    wait_until(ten, "ten samples")
    joints = samples[-1].value
    assert joints.position == HELD
    assert joints.state == ArmState.HOLDING
    assert joints.device_state == 0x0001_01_01_01_07  # safety bits; status, runtime, safety and robot mode
    for before, after in itertools.pairwise(samples):
        assert after.seq > before.seq
        assert after.received_ns > before.received_ns
        assert after.device_time_s - before.device_time_s >= 0.0079
    assert abs(time.monotonic_ns() - samples[-1].received_ns) < 1e9
    health = arm.health()
    assert health.state == LinkState.UP
    assert health.cause == ""


def test_drain_gives_a_state_once(robot, arm) -> None:
    wait_until(arm.drain, "a sample")
    robot.call("mute")
    packets = robot.get("counters.data_sent")
    wait_until(lambda: robot.get("counters.data_sent") == packets, "no more data")
    wait_until(lambda: not arm.drain(), "the last sample is taken")
    assert arm.drain() == ()


def test_monitor_sends_nothing_that_could_move_the_arm(robot) -> None:
    with Ur10(robot.host) as arm:
        wait_until(lambda: arm.read().packets > 50, "half a second of data")
    assert robot.get("requests.input_setups") == 0
    assert robot.get("requests.input_frames") == 0
    assert robot.get("requests.script_bytes") == 0
    assert robot.get("counters.script_accepted") == 0
    lines = robot.get("requests.dashboard_lines")
    assert lines, "the preflight asked"
    assert [line for line in lines if line.startswith(MOVING_LINES)] == []
    assert {line[0] for line in robot.get("requests.handshake")} <= set("VvOS")


def test_monitor_leaves_a_playing_program_alone(robot) -> None:
    robot.call("play_other_program")
    wait_until(lambda: robot.get("controller.runtime_state") == 2, "it plays")
    with Ur10(robot.host) as arm:
        assert arm.read().joints.state == ArmState.FOREIGN_PROGRAM
    assert robot.get("controller.runtime_state") == 2


def test_two_arms_at_once(robot, arm) -> None:
    with EmulatorProcess() as second, Ur10(second.host) as other:
        second.call("drift_step", [0.25, 0, 0, 0, 0, 0])
        wait_until(lambda: other.read().joints.position[0] == pytest.approx(HELD[0] + 0.25), "the second moved")
        assert arm.read().joints.position == HELD


def test_lifecycle_is_idempotent_and_can_be_repeated(robot) -> None:
    arm = Ur10(robot.host)
    arm.stop()
    arm.close()
    assert arm.drain() == ()
    assert arm.health().state == LinkState.CLOSED
    with pytest.raises(DeviceError, match="not open"):
        arm.start()
    for _ in range(2):
        assert arm.open().model == "UR10"
        with pytest.raises(DeviceError, match="already open"):
            arm.open()
        assert arm.drain() == (), "nothing before start"
        arm.start()
        wait_until(arm.drain, "a sample")
        pid = child_pid(arm)
        arm.stop()
        arm.stop()
        assert arm.drain() == ()
        assert arm.health().state == LinkState.CLOSED
        arm.close()
        arm.close()
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)
    wait_until(lambda: robot.get("counters.rtde_clients") == 0, "all connections are closed")


def test_no_descriptor_is_left_behind(robot) -> None:
    def open_fds() -> int:
        return len(os.listdir("/proc/self/fd"))  # noqa: PTH208 (a count, no paths)

    before = open_fds()
    for _ in range(3):
        with Ur10(robot.host):
            pass
    arm = Ur10(fresh_address())
    with pytest.raises(DeviceUnreachable):
        arm.open()
    assert open_fds() == before


def test_unreachable_is_quick_and_clear() -> None:
    host = fresh_address()
    started = time.monotonic()
    with pytest.raises(DeviceUnreachable, match="Connection refused") as caught:
        Ur10(host).open()
    assert time.monotonic() - started < 4
    assert caught.value.where == f"{host}:30004"


@pytest.mark.parametrize("version", mostly_long(((3, 14, 3, 1), (5, 3, 0, 2)), (5, 3, 0, 2)))
def test_wrong_version(version) -> None:
    with EmulatorProcess(version=version) as emulator, pytest.raises(DeviceProtocolError, match=r"3\.15"):
        Ur10(emulator.host).open()


def test_a_stopped_arm_is_not_ready(robot) -> None:
    robot.call("protective_stop")
    with pytest.raises(DeviceNotReady, match="PROTECTIVE_STOP"):
        Ur10(robot.host).open()


@pytest.mark.long
def test_no_data_after_the_handshake(robot) -> None:
    robot.call("mute")
    with pytest.raises(DeviceUnreachable, match="packets"):
        Ur10(robot.host).open()


def test_the_start_deadline_kills_a_child_that_hangs(robot, monkeypatch) -> None:
    monkeypatch.setattr("robot_io.ur10.driver.START_WITHIN_S", {"monitor": 0.0})
    arm = Ur10(robot.host)
    with pytest.raises(DeviceUnreachable, match="not ready within"):
        arm.open()
    assert arm.health().state == LinkState.CLOSED


@pytest.mark.parametrize("number", mostly_long((signal.SIGKILL, signal.SIGSEGV, signal.SIGABRT), signal.SIGKILL))
def test_a_dead_child_is_an_old_record(arm, number: signal.Signals) -> None:
    os.kill(child_pid(arm), number)
    wait_until(lambda: age_ms(arm) > 100, "the record grows old")
    arm.drain()
    assert arm.drain() == ()
    wait_until(lambda: arm.health().state == LinkState.LOST, "the process is gone")
    assert number.name in arm.health().cause


def test_a_frozen_child_is_an_old_record_and_still_ends(arm) -> None:
    pid = child_pid(arm)
    os.kill(pid, signal.SIGSTOP)
    wait_until(lambda: age_ms(arm) > 100, "the record grows old")
    arm.close()
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


def test_the_child_dies_with_its_parent(robot) -> None:
    code = (
        "import sys, time\nfrom robot_io.ur10.driver import Ur10\n"
        f"arm = Ur10({robot.host!r})\narm.open()\nprint(arm.read().child_pid, flush=True)\ntime.sleep(60)\n"
    )
    parent = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE)
    try:
        assert parent.stdout is not None
        pid = int(parent.stdout.readline())
        parent.kill()
        parent.wait()

        def gone() -> bool:
            try:
                with open(f"/proc/{pid}/stat") as stat:  # noqa: PTH123 (a proc file)
                    return stat.read().rsplit(")", 1)[1].split()[0] == "Z"
            except FileNotFoundError:
                return True

        wait_until(gone, "the child is gone")
        wait_until(lambda: robot.get("counters.rtde_clients") == 0, "its connection too")
    finally:
        parent.kill()
        parent.wait()
        if parent.stdout is not None:
            parent.stdout.close()


def test_the_parts_as_the_launcher_uses_them(robot) -> None:
    record = TypedRecord.create("arm", ARM_RECORD)
    child = spawn_arm(ArmJob(robot.host, "monitor", record.fd, os.getpid()))
    link = ArmLink(os.dup(record.fd))
    try:
        assert child.wait_ready(10.0)
        assert child.ready["info"]["where"] == robot.host
        wait_until(lambda: link.read().packets > 12, "packets flow")
        assert child.stop(5.0) == 0
        assert child.hear() == [], "a clean end reports nothing"
        assert not child.status.open
        assert link.read().link == LinkState.CLOSED
    finally:
        child.stop(0.0)
        child.close()
        link.close()
        record.close()


def test_without_a_robot_it_reports_why_and_ends() -> None:
    record = TypedRecord.create("arm", ARM_RECORD)
    host = fresh_address()
    child = spawn_arm(ArmJob(host, "monitor", record.fd, os.getpid()))
    try:
        assert not child.wait_ready(10.0)
        assert child.process.wait(10) == 4
        assert [(type(error), error.where) for error in child.errors] == [(DeviceUnreachable, f"{host}:30004")]
        assert record.read() is None
    finally:
        child.stop(0.0)
        child.close()
        record.close()
