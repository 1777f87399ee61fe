"""An e-Series arm on the wire: found by its version, named with its e, watched and held at 500 Hz."""

import itertools

import pytest

from robot_io.errors import ConfigError, DeviceNotReady, DeviceProtocolError
from robot_io.messages import ArmState, LinkState
from robot_io.ur10.driver import Ur10
from robot_io.ur10.look import receive
from robot_io.ur10.preflight import preflight
from tests.wire.ur_process import EmulatorProcess, wait_until

HELD = (1.5708, -0.1745, 1.5708, -1.3963, 1.5708, 1.31)


@pytest.fixture
def robot():
    with EmulatorProcess(model="ur10e") as emulator:
        yield emulator


@pytest.mark.parametrize("model", ["ur3", "ur5", "ur3e", "ur5e", "ur16e"])
def test_every_model_is_told_from_the_others(model: str) -> None:
    """The dashboard leaves the e out; the version tells it."""
    with EmulatorProcess(model=model) as emulator:
        info, generation = preflight(emulator.host)
    assert info.device == info.model.lower() == model
    assert (generation.rate_hz, info.version[0]) == ((500.0, "5") if model.endswith("e") else (125.0, "3"))


def test_a_dashboard_that_does_give_the_e_is_understood(robot) -> None:
    robot.call("be_model", "UR10e")
    assert preflight(robot.host)[0].model == "UR10e"


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        (("safeguard_stop",), "(SAFEGUARD_STOP)"),
        (("enabling_stop",), "SYSTEM_THREE_POSITION_ENABLING_STOP"),
        (("protective_stop",), "PROTECTIVE_STOP"),
    ],
)
def test_a_stop_is_named_as_the_e_series_names_it(robot, fault, said: str) -> None:
    robot.call(*fault)
    with pytest.raises(DeviceNotReady) as caught:
        preflight(robot.host)
    assert said in str(caught.value)


def test_it_is_watched_at_500_hz(robot) -> None:
    with Ur10(robot.host, model="UR10e") as arm:
        samples = []

        def many() -> bool:
            samples.extend(arm.drain())
            return len(samples) >= 100

        wait_until(many, "a hundred samples")
        assert samples[-1].value.position == HELD
        assert samples[-1].value.state == ArmState.HOLDING
        steps = [after.device_time_s - before.device_time_s for before, after in itertools.pairwise(samples)]
        assert min(steps) == pytest.approx(0.002)
        assert arm.health().state == LinkState.UP
    assert robot.get("requests.input_setups") == 0
    assert robot.get("requests.script_bytes") == 0


def test_a_stop_is_seen(robot) -> None:
    with Ur10(robot.host) as arm:
        robot.call("enabling_stop")
        wait_until(lambda: arm.read().joints.state == ArmState.PROTECTIVE_STOP, "the stop is seen")


def test_it_is_held_with_the_script_of_polyscope_5(robot) -> None:
    with Ur10(robot.host, hold="servo", held_pose_rad=HELD) as arm:
        wait_until(lambda: arm.read().servo, "it holds")
        robot.call("drift_step", [0.005, -0.005, 0.005, -0.005, 0.005, -0.005])

        def error_rad() -> float:
            return max(abs(q - held) for q, held in zip(arm.read().joints.position, HELD, strict=True))

        wait_until(lambda: error_rad() > 0.001, "the drift is seen")
        wait_until(lambda: error_rad() < 0.0002, "and corrected")
    wait_until(lambda: robot.get("controller.runtime_state") == 1, "the script has ended")


def test_the_look_gets_packets_of_a_fifth_of_a_second(robot) -> None:
    packets = receive(robot.host)
    assert len(packets) == 100
    assert packets[-1].controller_s - packets[0].controller_s == pytest.approx(99 * 0.002)


def test_the_wrong_arm_is_refused(robot) -> None:
    with pytest.raises(DeviceProtocolError, match="this is a UR10e, not the UR10 "), Ur10(robot.host, model="UR10"):
        pass


def test_a_model_nobody_makes_is_a_mistake_of_the_rig() -> None:
    with pytest.raises(ConfigError, match="UR11"):
        Ur10.from_rig("127.0.0.1", {"model": "UR11"})
