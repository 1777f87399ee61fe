"""The plain-socket look at the controller: every refusal is quick, typed and says what to do."""

import contextlib
import socket
import threading
import time

import pytest

from robot_io.errors import DeviceNotReady, DeviceProtocolError, DeviceUnreachable
from robot_io.ur10.preflight import is_program_running, preflight
from tests.how_many import mostly_long
from tests.wire.ur_process import EmulatorProcess, fresh_address, wait_until

BOUND_S = 3.5


@pytest.fixture(scope="module")
def robot():
    with EmulatorProcess() as emulator:
        yield emulator


def refused(host: str, kind: type[Exception]) -> str:
    started = time.monotonic()
    with pytest.raises(kind) as caught:
        preflight(host)
    assert time.monotonic() - started < BOUND_S
    assert caught.value.do, "says what to do"
    assert host in caught.value.where
    return str(caught.value)


def test_a_healthy_controller_is_identified(robot) -> None:
    info, generation = preflight(robot.host)
    assert generation.rate_hz == 125.0
    assert (info.device, info.where, info.model) == ("ur10", robot.host, "UR10")
    assert (info.version, info.serial) == ("3.15.8.106339", "2015301234")


def test_nothing_that_could_move_the_arm_is_sent(robot) -> None:
    preflight(robot.host)
    assert robot.get("requests.input_setups") == 0
    assert robot.get("requests.script_bytes") == 0
    asked = set(robot.get("requests.dashboard_lines"))
    assert asked <= {"get robot model", "get serial number", "robotmode", "safetymode", "running"}


def test_closed_port() -> None:
    assert "Connection refused" in refused(fresh_address(), DeviceUnreachable)


def test_an_address_that_does_not_answer_at_all() -> None:
    """As with the power off or the cable out; here the kernel drops what exceeds the queue of connections."""
    host = fresh_address()
    with contextlib.ExitStack() as stack:
        listener = stack.enter_context(socket.socket())
        listener.bind((host, 30004))
        listener.listen(0)
        for _ in range(3):
            waiting = stack.enter_context(socket.socket())
            waiting.setblocking(False)
            waiting.connect_ex((host, 30004))
        message = refused(host, DeviceUnreachable)
    assert "no answer" in message
    assert "cable" in message


@pytest.mark.parametrize(
    "version",
    mostly_long(((3, 14, 3, 1), (5, 3, 0, 0), (3, 2, 0, 0), (4, 15, 0, 0), (10, 7, 0, 0)), (3, 14, 3, 1), (5, 3, 0, 0)),
)
def test_other_versions_are_refused_with_both_named(version) -> None:
    with EmulatorProcess(version=version) as emulator:
        message = refused(emulator.host, DeviceProtocolError)
    assert ".".join(map(str, version)) in message
    assert "3.15" in message
    assert "5.4" in message


def test_newer_cb3_is_accepted() -> None:
    with EmulatorProcess(version=(3, 16, 0, 1)) as emulator:
        assert preflight(emulator.host)[0].version == "3.16.0.1"


def test_an_unknown_model_is_refused(robot) -> None:
    robot.call("be_model", "UR20")
    assert "UR20" in refused(robot.host, DeviceProtocolError)
    robot.call("be_model", "UR10")


def test_another_model_than_the_rig_says_is_refused_with_both_named(robot) -> None:
    with pytest.raises(DeviceProtocolError, match=r"this is a UR10, not the UR10e"):
        preflight(robot.host, "UR10e")
    assert preflight(robot.host, "UR10")[0].model == "UR10"


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        (("set_robot_mode", 5), "IDLE"),
        (("power_off",), "POWER_OFF"),
        (("protective_stop",), "PROTECTIVE_STOP"),
        (("emergency_stop",), "ROBOT_EMERGENCY_STOP"),
    ],
)
def test_not_running_or_stopped_by_safety(robot, fault, said: str) -> None:
    robot.call(*fault)
    try:
        assert said in refused(robot.host, DeviceNotReady)
    finally:
        robot.call("clear_stop")
        robot.call("set_robot_mode", 7)


def test_reduced_mode_is_fine(robot) -> None:
    robot.call("set_safety_mode", 2)
    try:
        assert preflight(robot.host)[0].model == "UR10"
    finally:
        robot.call("clear_stop")


@pytest.mark.parametrize("fault", mostly_long(("freeze", "mute_dashboard"), "freeze"))
def test_silence_is_bounded(robot, fault: str) -> None:
    robot.call(fault, True)
    try:
        assert "sends nothing" in refused(robot.host, DeviceUnreachable)
    finally:
        robot.call(fault, False)


@pytest.mark.parametrize(
    ("answer", "kind"),
    [
        (b"HTTP/1.1 400 Bad Request\r\n\r\n", DeviceProtocolError),
        (b"\x00\x00\x56", DeviceProtocolError),
        (b"\x00\x04\x56\x00", DeviceProtocolError),
        (b"\x00\x04\x56\x01\x00\x07\x76\x00\x00\x00\x03", DeviceProtocolError),
        (b"\x00", DeviceUnreachable),
        (b"", DeviceUnreachable),
    ],
)
def test_something_else_on_the_port(answer: bytes, kind: type[Exception]) -> None:
    host = fresh_address()
    with socket.create_server((host, 30004)) as server:

        def serve() -> None:
            connection, _ = server.accept()
            with connection:
                connection.recv(100)
                connection.sendall(answer)

        thread = threading.Thread(target=serve)
        thread.start()
        refused(host, kind)
        thread.join()


def test_a_text_message_before_the_answer_is_skipped() -> None:
    host = fresh_address()
    with socket.create_server((host, 30004)) as server:

        def serve() -> None:
            connection, _ = server.accept()
            with connection:
                connection.recv(100)
                connection.sendall(
                    bytes.fromhex("000c4d0568656c6c6f0161000004560100137600000005000000000000000000000000")
                )

        thread = threading.Thread(target=serve)
        thread.start()
        assert "5.0.0.0" in refused(host, DeviceProtocolError)
        thread.join()


def test_program_running(robot) -> None:
    assert not is_program_running(robot.host)
    robot.call("play_other_program")
    wait_until(lambda: is_program_running(robot.host), "the program plays")
    robot.call("stop_program")
