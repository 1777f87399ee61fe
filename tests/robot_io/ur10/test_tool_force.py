"""The arm's own force sensor on the wire: frames and signs, what it asks for, and what it notices."""

import contextlib
import itertools
import time

import pytest

from robot_io.errors import ConfigError, DeviceNotReady, DeviceProtocolError
from robot_io.messages import LinkState
from robot_io.ur10.driver import Ur10
from robot_io.ur10.tool_force import UrToolForce
from tests.how_many import mostly_long
from tests.wire.ur_process import EmulatorProcess, wait_until

READING = (1.0, 2.0, -15.0, 0.1, 0.2, 0.3)


@pytest.fixture
def robot():
    with EmulatorProcess(model="ur10e", wrench=READING) as emulator:
        yield emulator


@pytest.fixture
def sensor(robot):
    with UrToolForce(robot.host, model="UR10e") as driver:
        yield driver


def newest(sensor: UrToolForce):
    return wait_until(sensor.drain, "a reading")[-1]


def test_raw_readings_come_as_they_are(robot, sensor) -> None:
    """Pushing ahead reads -15 N in z, as with an FT 300: what acts on the tool."""
    wrench = newest(sensor).value
    assert (wrench.fx, wrench.fy, wrench.fz) == READING[:3]
    assert (wrench.mx, wrench.my, wrench.mz) == READING[3:]


def test_without_raw_readings_the_base_frame_is_turned_back() -> None:
    with EmulatorProcess(model="ur10e", wrench=READING, version=(5, 8, 0, 10253)) as robot:
        with UrToolForce(robot.host) as sensor:
            wrench = newest(sensor).value
        assert robot.get("controller.tcp_force") != pytest.approx(READING)
    assert (wrench.fx, wrench.fy, wrench.fz) == pytest.approx(READING[:3])
    assert (wrench.mx, wrench.my, wrench.mz) == pytest.approx(READING[3:])


def test_old_controllers_are_remarked_on() -> None:
    with (
        EmulatorProcess(model="ur5e", version=(5, 8, 0, 10253)) as robot,
        contextlib.closing(UrToolForce(robot.host)) as sensor,
    ):
        (remark,) = sensor.open().remarks
    assert "ft_raw_wrench" in remark


def test_it_is_a_reader_beside_the_arm(robot, sensor) -> None:
    """No input is claimed, no script sent, and the arm's own connection is not disturbed."""
    with Ur10(robot.host) as arm:
        wait_until(lambda: arm.read().packets > 20, "the arm's packets flow")
        newest(sensor)
        assert arm.health().state == LinkState.UP
    assert robot.get("requests.input_setups") == 0
    assert robot.get("requests.script_bytes") == 0
    assert set(robot.get("requests.dashboard_lines")) <= {
        "get robot model", "get serial number", "robotmode", "safetystatus",
    }  # fmt: skip


def test_500_readings_a_second_with_the_controllers_time(sensor) -> None:
    samples = []

    def many() -> bool:
        samples.extend(sensor.drain())
        return len(samples) >= 300

    wait_until(many, "300 readings")
    assert [sample.seq for sample in samples] == list(range(samples[0].seq, samples[0].seq + len(samples)))
    span_s = samples[-1].device_time_s - samples[0].device_time_s
    assert span_s == pytest.approx((len(samples) - 1) * 0.002)
    assert sensor.health().counters["packets_ok"] >= 300


def test_readings_left_out_are_missing_in_seq(robot, sensor) -> None:
    before = newest(sensor).seq
    robot.call("drop_data", 10)
    samples = []
    wait_until(lambda: samples.extend(sensor.drain()) or len(samples) > 30, "the next ones")
    gaps = [b.seq - a.seq for a, b in itertools.pairwise(samples)]
    assert max([samples[0].seq - before, *gaps]) >= 11


@pytest.mark.parametrize("model", ["ur3", "ur5", "ur10"])
def test_a_cb3_arm_is_refused_in_one_sentence(model: str) -> None:
    with EmulatorProcess(model=model) as robot, pytest.raises(DeviceProtocolError) as caught:
        UrToolForce(robot.host).open()
    assert caught.value.what == "a CB3 arm has no force sensor: it estimates forces from motor currents"
    assert "robotiq-ft300" in caught.value.do


def test_another_model_than_the_rigs_is_refused(robot) -> None:
    with pytest.raises(DeviceProtocolError, match="this is a UR10e, not the UR5e"):
        UrToolForce.from_rig(robot.host, {"model": "UR5e"}).open()


def test_unknown_options_are_refused() -> None:
    with pytest.raises(ConfigError, match="port"):
        UrToolForce.from_rig("127.0.0.1", {"port": 3})


def test_zeroing_at_the_pendant_is_a_jump_of_the_bias(robot, sensor) -> None:
    newest(sensor)
    assert sensor.health().counters["bias_jumps"] == 0
    robot.call("zero_force")
    wait_until(lambda: sensor.drain() and sensor.health().counters["bias_jumps"] == 1, "it is noticed")
    wrench = newest(sensor).value
    assert wrench.fz == -15.0, "the raw reading is the same"


def test_zeroing_is_noticed_without_raw_readings_too() -> None:
    old = EmulatorProcess(model="ur10e", wrench=READING, version=(5, 8, 0, 10253))
    with old as robot, UrToolForce(robot.host) as sensor:
        wait_until(lambda: sensor.drain() and sensor.health().counters["packets_ok"] > 20, "readings")
        robot.call("zero_force")
        wait_until(lambda: sensor.drain() and sensor.health().counters["bias_jumps"] == 1, "it is noticed")


@pytest.mark.parametrize(
    "fault", mostly_long(("close_clients", "reset_clients", "close_rtde_clients"), "close_clients")
)
def test_a_closed_connection_is_lost_for_good(robot, sensor, fault: str) -> None:
    newest(sensor)
    robot.call(fault)
    wait_until(lambda: sensor.drain() == () and sensor.health().state == LinkState.LOST, "it says so")
    assert sensor.drain() == ()


def test_a_restarted_controller_is_a_lost_link(robot, sensor) -> None:
    newest(sensor)
    robot.call("jump_time", -100.0)
    wait_until(lambda: sensor.drain() == () and sensor.health().state == LinkState.LOST, "it says so")
    assert "restarted" in sensor.health().cause


@pytest.mark.parametrize("call", [("send_garbage",), ("truncate_data", 40)])
def test_nonsense_is_a_lost_link_and_never_a_reading(robot, sensor, call) -> None:
    newest(sensor)
    robot.call(*call)
    samples = []
    wait_until(lambda: samples.extend(sensor.drain()) or sensor.health().state == LinkState.LOST, "it says so")
    assert all((s.value.fx, s.value.fy, s.value.fz) == READING[:3] for s in samples)


def test_a_text_message_is_no_reading(robot, sensor) -> None:
    newest(sensor)
    robot.call("send_text", "hello")
    packets = sensor.health().counters["packets_ok"]
    wait_until(lambda: sensor.drain() and sensor.health().counters["packets_ok"] > packets + 20, "it goes on")


def test_start_needs_open(robot) -> None:
    with pytest.raises(DeviceNotReady):
        UrToolForce(robot.host).start()


def test_a_silent_controller_is_refused_in_time(robot) -> None:
    robot.call("freeze", True)
    began_s = time.monotonic()
    with pytest.raises(Exception, match="sends nothing"):
        UrToolForce(robot.host).open()
    assert time.monotonic() - began_s < 3.5
