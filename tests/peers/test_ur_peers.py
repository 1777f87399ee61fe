"""ur_rtde's own clients against the emulator, each in a process of its own (they may abort or hang)."""

import json
import subprocess
import sys

import pytest

from tests.wire.ur_process import EmulatorProcess, wait_until

HELD = [1.5708, -0.1745, 1.5708, -1.3963, 1.5708, 1.31]
PRELUDE = """
import json, os, time
import rtde_receive, rtde_control, dashboard_client
def until(condition, within_s=5.0):
    end = time.monotonic() + within_s
    while not condition():
        assert time.monotonic() < end, "not in time"
        time.sleep(0.002)
def give(**values):
    print("RESULT " + json.dumps(values), flush=True)
    os._exit(0)
HOST = %r
"""


@pytest.fixture(scope="module")
def robot():
    with EmulatorProcess() as emulator:
        yield emulator


def run(host: str, code: str) -> dict[str, object]:
    """Run client code that ends in `give(...)`; return what it gave."""
    done = subprocess.run(
        [sys.executable, "-c", PRELUDE % host + code], capture_output=True, text=True, timeout=40, check=False
    )
    for line in done.stdout.splitlines():
        if line.startswith("RESULT "):
            return json.loads(line.removeprefix("RESULT "))
    raise AssertionError(f"exit {done.returncode}\n{done.stdout}\n{done.stderr}")


def test_receive_with_its_own_57_fields(robot) -> None:
    seen = run(
        robot.host,
        """
r = rtde_receive.RTDEReceiveInterface(HOST, 125.0)
first = r.getTimestamp()
until(lambda: r.getTimestamp() > first + 0.08)
give(q=r.getActualQ(), target=r.getTargetQ(), mode=r.getRobotMode(), safety=r.getSafetyMode(),
     bits=r.getSafetyStatusBits(), status=r.getRobotStatus(), runtime=r.getRuntimeState(), joints=r.getJointMode(),
     scaling=r.getSpeedScaling(), pose=r.getActualTCPPose(), volts=r.getActualMainVoltage(),
     stopped=[r.isProtectiveStopped(), r.isEmergencyStopped()], int12=r.getOutputIntRegister(12),
     inertia=r.getPayloadInertia(), cog=r.getPayloadCog(), accelerometer=r.getActualToolAccelerometer())
""",
    )
    assert seen["q"] == seen["target"] == HELD
    assert (seen["mode"], seen["safety"], seen["bits"], seen["status"], seen["runtime"]) == (7, 1, 1, 1, 1)
    assert seen["joints"] == [253] * 6
    assert (seen["scaling"], seen["volts"], seen["stopped"], seen["int12"]) == (1.0, 48.0, [False, False], 0)
    assert seen["inertia"] == [0.0] * 6
    assert len(seen["cog"]) == len(seen["accelerometer"]) == 3
    asked = [line for line in robot.get("requests.handshake") if line.startswith("O ")]
    assert asked, "it negotiated its outputs"


def test_receive_with_a_recipe_of_its_own(robot) -> None:
    seen = run(
        robot.host,
        """
r = rtde_receive.RTDEReceiveInterface(HOST, 125.0, ["timestamp", "actual_q", "actual_TCP_pose"])
try:
    rtde_receive.RTDEReceiveInterface(HOST, 125.0, ["timestamp", "no_such_thing"])
    error = ""
except RuntimeError as e:
    error = str(e)
give(q=r.getActualQ(), error=error)
""",
    )
    assert seen["q"] == HELD
    assert "no_such_thing" in seen["error"]


def test_three_receivers_and_a_slow_one_at_once(robot) -> None:
    seen = run(
        robot.host,
        """
many = [rtde_receive.RTDEReceiveInterface(HOST, f, ["timestamp", "robot_mode"]) for f in (125.0, 125.0, 25.0)]
starts = [r.getTimestamp() for r in many]
until(lambda: all(r.getTimestamp() > s + 0.2 for r, s in zip(many, starts)))
give(modes=[r.getRobotMode() for r in many])
""",
    )
    assert seen["modes"] == [7, 7, 7]


def test_control_servo_stop_and_queries(robot) -> None:
    seen = run(
        robot.host,
        """
r = rtde_receive.RTDEReceiveInterface(HOST, 125.0)
c = rtde_control.RTDEControlInterface(HOST, 125.0)
running = c.isProgramRunning()
steady = c.isSteady()
start = r.getActualQ()
target = [q + 0.01 for q in start]
def servo():
    assert c.servoJ(target, 0.0, 0.0, 0.008, 0.1, 300)
    return max(abs(a - b) for a, b in zip(r.getActualQ(), target)) < 1e-4
until(servo)
c.servoStop()
moved = c.moveJ(start, 1.0, 1.0)
until(lambda: max(abs(a - b) for a, b in zip(r.getActualQ(), start)) < 1e-6)
forward = c.getForwardKinematics()
pose = r.getActualTCPPose()
limits = c.isJointsWithinSafetyLimits(start)
c.setPayload(1.5, [0.0, 0.0, 0.05])
until(lambda: r.getPayload() == 1.5)
c.setTcp([0.0, 0.0, 0.1, 0.0, 0.0, 0.0])
tcp = c.getTCPOffset()
c.stopScript()
until(lambda: r.getRuntimeState() == 1)
give(running=running, steady=steady, moved=moved, forward=forward, pose=pose, limits=limits, tcp=tcp,
     cog=r.getPayloadCog(), after=c.isProgramRunning())
""",
    )
    assert seen["running"] is True
    assert seen["steady"] is True
    assert seen["moved"] is True
    assert seen["forward"] == pytest.approx(seen["pose"])
    assert seen["limits"] is True
    assert seen["tcp"] == [0.0, 0.0, 0.1, 0.0, 0.0, 0.0]
    assert seen["cog"] == [0.0, 0.0, 0.05]
    assert seen["after"] is False


def test_control_watchdog_trips_on_silence(robot) -> None:
    before = robot.get("counters.watchdog_trips")
    seen = run(
        robot.host,
        """
c = rtde_control.RTDEControlInterface(HOST, 125.0)
assert c.setWatchdog(10.0)
end = time.monotonic() + 0.4
while time.monotonic() < end:
    assert c.kickWatchdog()
    time.sleep(0.02)
alive = c.isProgramRunning()
until(lambda: not c.isProgramRunning())
give(alive=alive)
""",
    )
    assert seen["alive"] is True
    assert robot.get("counters.watchdog_trips") == before + 1


def test_control_on_the_upper_registers_beside_a_client_on_the_lower(robot) -> None:
    seen = run(
        robot.host,
        """
C = rtde_control.RTDEControlInterface
c = C(HOST, 125.0, C.FLAG_UPLOAD_SCRIPT | C.FLAG_UPPER_RANGE_REGISTERS | C.FLAG_NO_EXT_FT)
steady = c.isSteady()
try:
    C(HOST, 125.0, C.FLAG_UPLOAD_SCRIPT | C.FLAG_UPPER_RANGE_REGISTERS | C.FLAG_NO_EXT_FT)
    error = ""
except RuntimeError as e:
    error = str(e)
give(steady=steady, error=error)
""",
    )
    assert seen["steady"] is True
    assert "already in use" in seen["error"]
    robot.call("stop_program")


@pytest.mark.long
def test_constructing_control_ends_a_playing_program() -> None:
    """The reason why the driver looks first. It takes 4 s, and minutes when an earlier script left `ready` behind."""
    with EmulatorProcess() as robot:
        robot.call("play_other_program", "theirs")
        wait_until(lambda: robot.get("controller.runtime_state") == 2, "it plays")
        run(robot.host, "c = rtde_control.RTDEControlInterface(HOST, 125.0)\ngive()\n")
        assert robot.get("controller.program.name") == "rtde_control"


def test_dashboard_client(robot) -> None:
    seen = run(
        robot.host,
        """
d = dashboard_client.DashboardClient(HOST)
d.connect()
answers = [d.robotmode(), d.safetymode(), d.polyscopeVersion(), d.getRobotModel(), d.programState(), d.running()]
d.stop()
d.closeSafetyPopup()
d.popup("hello")
try:
    d.play()
    error = ""
except RuntimeError as e:
    error = str(e)
d.quit()
give(answers=answers, error=error)
""",
    )
    assert seen["answers"] == [
        "Robotmode: RUNNING",
        "Safetymode: NORMAL",
        "3.15.8.106339",
        "UR10",
        "STOPPED <unnamed>",
        False,
    ]
    assert "Failed to execute: play" in seen["error"]


def test_two_controllers_at_once(robot) -> None:
    with EmulatorProcess() as second:
        second.call("drift_step", [0.1] * 6)
        seen = run(
            robot.host,
            f"""
a = rtde_receive.RTDEReceiveInterface(HOST, 125.0)
b = rtde_receive.RTDEReceiveInterface({second.host!r}, 125.0)
c = rtde_control.RTDEControlInterface({second.host!r}, 125.0)
until(lambda: b.getRuntimeState() == 2)
give(a=a.getActualQ(), b=b.getActualQ(), runtime=a.getRuntimeState())
""",
        )
    assert seen["a"] == HELD
    assert seen["b"] == pytest.approx([q + 0.1 for q in HELD])
    assert seen["runtime"] == 1
