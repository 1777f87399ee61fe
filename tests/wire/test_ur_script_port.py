"""Script upload and ur_rtde's register protocol, driven with plain sockets."""

import math
import socket
import struct
from pathlib import Path

import pytest

from tests.how_many import mostly_long
from tests.wire.ur_process import EmulatorProcess, wait_until

PLAYING, STOPPED, PAUSED = 2, 1, 4
MOVE_J, SPEED_J, SERVO_J, SERVO_STOP, IS_STEADY, SET_WATCHDOG, STOP_SCRIPT = 1, 9, 11, 16, 47, 35, 255


def control_script(offset: int) -> str:
    return (
        "def rtde_control():\n  # RTDE Control Script\n"
        f"  # float register offset\n  {offset}\n  while True:\n    sync()\n  end\nend\n"
    ).replace(f"\n  {offset}\n", f"\n{offset}\n")


def upload(host: str, text: str, port: int = 30003) -> None:
    with socket.create_connection((host, port), timeout=3) as connection:
        connection.sendall(text.encode())


@pytest.fixture
def robot():
    with EmulatorProcess() as emulator:
        yield emulator


def wait_cycles(robot, count: int) -> None:
    until = robot.get("counters.cycles") + count
    wait_until(lambda: robot.get("counters.cycles") > until, f"{count} control cycles")


def runtime(robot) -> int:
    return robot.get("controller.runtime_state")


@pytest.mark.parametrize("port", mostly_long((30001, 30002, 30003), 30001))
def test_a_program_plays_until_stopped(robot, port: int) -> None:
    upload(robot.host, "def hello():\n  while True:\n    sync()\n  end\nend\n", port)
    wait_until(lambda: runtime(robot) == PLAYING, "it plays")
    assert robot.get("controller.program.name") == "hello"
    robot.call("stop_program")
    assert runtime(robot) == STOPPED


def test_nothing_starts_before_the_closing_end(robot) -> None:
    with socket.create_connection((robot.host, 30002), timeout=3) as connection:
        part = b"def hello():\n  if True:\n    sleep(60)\n  end\n"
        connection.sendall(part)
        wait_until(lambda: robot.get("requests.script_bytes") == len(part), "the first part arrived")
        assert list(robot.get("requests.scripts")) == []
        connection.sendall(b"end\n")
        wait_until(lambda: runtime(robot) == PLAYING, "it plays after the end")


def test_an_indented_program_is_one_program(robot) -> None:
    golden = Path(__file__).parents[1] / "golden/ur_script_indented_program.txt"
    sent = [line[2:].partition("#")[0] for line in golden.read_text().splitlines() if line.startswith(">")]
    upload(robot.host, bytes.fromhex("".join(sent)).decode())
    wait_until(lambda: runtime(robot) == PLAYING, "it plays")
    wait_cycles(robot, 10)
    assert robot.get("controller.program.name") == "svt"
    assert len(list(robot.get("requests.scripts"))) == 1
    upload(robot.host, "def other():\n  sync()\nend  \r\n", 30001)  # blanks and CR behind the end
    wait_until(lambda: list(robot.get("requests.scripts"))[1:] == ["def other():"], "the next one is complete too")


def test_a_secondary_program_leaves_the_running_one_alone(robot) -> None:
    upload(robot.host, "def first():\n  sleep(60)\nend\n")
    wait_until(lambda: runtime(robot) == PLAYING, "the first plays")
    upload(robot.host, "sec beside():\n  textmsg(1)\nend\n", 30002)
    wait_until(lambda: len(robot.get("requests.scripts")) == 2, "the second arrived")
    assert robot.get("controller.program.name") == "first"
    assert runtime(robot) == PLAYING


def test_a_new_program_replaces_the_running_one(robot) -> None:
    upload(robot.host, "def first():\n  sleep(60)\nend\n")
    wait_until(lambda: runtime(robot) == PLAYING, "the first plays")
    upload(robot.host, "def second():\n  sleep(60)\nend\n")
    wait_until(lambda: robot.get("counters.programs_started") == 2, "the second plays")
    assert robot.get("controller.program.name") == "second"


def test_a_single_line_runs_and_ends(robot) -> None:
    upload(robot.host, "popup(1)\n")
    wait_until(lambda: robot.get("counters.programs_started") == 1, "it ran")
    wait_until(lambda: runtime(robot) == STOPPED, "it ended")


@pytest.mark.parametrize("fault", [("set_robot_mode", 5), ("protective_stop",), ("ignore_scripts",)])
def test_programs_are_refused_without_a_word(robot, fault) -> None:
    robot.call(*fault)
    upload(robot.host, "def first():\n  sleep(60)\nend\n")
    wait_until(lambda: robot.get("counters.scripts_refused") == 1, "it is refused")
    assert runtime(robot) == STOPPED


def test_a_stop_before_the_start_refuses_the_program(robot) -> None:
    """The controller takes a moment between upload and start."""
    with socket.create_connection((robot.host, 30003), timeout=3) as connection:
        connection.sendall(b"def first():\n  sleep(60)\nend\n")
        wait_until(lambda: robot.get("controller._waiting") is not None, "it is about to start")
        robot.call("protective_stop")
    wait_until(lambda: robot.get("counters.scripts_refused") == 1, "it is refused")
    robot.call("clear_stop")
    wait_cycles(robot, 10)
    assert runtime(robot) == STOPPED
    assert robot.get("counters.programs_started") == 0


@pytest.mark.parametrize("offset", mostly_long((1, 47, 1000), 1000))
def test_a_register_offset_that_no_script_has_is_taken_as_none(robot, offset: int) -> None:
    upload(robot.host, control_script(offset))
    wait_until(lambda: robot.get("controller.registers.int_out")[0] == 1, "ready on the lower registers")


class Registers:
    """Writes commands and reads answers of the control script over RTDE."""

    def __init__(self, host: str, offset: int) -> None:
        self.offset = offset
        self.socket = socket.create_connection((host, 30004), timeout=3)
        self._ask(bytes.fromhex("0005560002"))
        doubles = [f"input_double_register_{offset + i}" for i in range(6)]
        names = ",".join([f"input_int_register_{offset}", *doubles]) + ","
        reply = self._ask(struct.pack(">HB", 3 + len(names), ord("I")) + names.encode())
        assert reply == b"\x01INT32" + b",DOUBLE" * 6

    def command(self, number: int, *values: float) -> None:
        body = struct.pack(">Bi6d", 1, number, *values, *[0.0] * (6 - len(values)))
        self.socket.sendall(struct.pack(">HB", 3 + len(body), ord("U")) + body)

    def _ask(self, frame: bytes) -> bytes:
        self.socket.sendall(frame)
        head = self.socket.recv(3, socket.MSG_WAITALL)
        return self.socket.recv(int.from_bytes(head[:2]) - 3, socket.MSG_WAITALL)

    def close(self) -> None:
        self.socket.close()


@pytest.fixture(params=[0, 24])
def registers(robot, request):
    upload(robot.host, control_script(request.param))
    wait_until(lambda: runtime(robot) == PLAYING, "the control script plays")
    connection = Registers(robot.host, request.param)
    yield connection
    connection.close()


def script_state(robot, registers: Registers) -> int:
    return robot.get("controller.registers.int_out")[registers.offset]


def test_ready_done_ready(robot, registers) -> None:
    wait_until(lambda: script_state(robot, registers) == 1, "ready")
    registers.command(IS_STEADY)
    wait_until(lambda: script_state(robot, registers) == 2, "done")
    assert robot.get("controller.registers.int_out")[registers.offset + 1] == 1, "the still arm is steady"
    registers.command(0)
    wait_until(lambda: script_state(robot, registers) == 1, "ready again")


def test_servo_target_is_followed_and_held_without_further_commands(robot, registers) -> None:
    target = (1.6, -0.2, 1.6, -1.4, 1.6, 1.3)
    registers.command(SERVO_J, *target)
    wait_until(lambda: robot.get("controller.motion.actual") == pytest.approx(target, abs=1e-4), "at the target")
    assert script_state(robot, registers) == 1, "a realtime command is never `done`"
    registers.command(0)
    robot.call("drift_step", [0.005] * 6)
    wait_cycles(robot, 30)
    assert robot.get("controller.motion.actual") == pytest.approx(target, abs=1e-4), "back at the target"
    registers.command(SERVO_STOP, 10.0)
    wait_until(lambda: script_state(robot, registers) == 2, "stopped")
    robot.call("drift_step", [0.005] * 6)
    wait_cycles(robot, 30)
    assert robot.get("controller.motion.actual") == pytest.approx([q + 0.005 for q in target], abs=2e-4)


@pytest.mark.parametrize("number", [MOVE_J, SPEED_J, SERVO_J])
@pytest.mark.parametrize("value", mostly_long((float("inf"), float("nan"), 1e308, -1e308), 1e308))
def test_a_joint_stays_within_its_range_whatever_is_commanded(robot, number: int, value: float) -> None:
    """A move is cut to the range; a speed or a target to be followed at once is beyond what a joint does."""
    upload(robot.host, control_script(0))
    wait_until(lambda: runtime(robot) == PLAYING, "the control script plays")
    registers = Registers(robot.host, 0)
    registers.command(number, value, 0.0)
    wait_cycles(robot, 5)
    registers.command(0)
    assert all(abs(q) <= 2 * math.pi for q in robot.get("controller.motion.actual"))
    assert runtime(robot) == (PLAYING if number == MOVE_J else PAUSED)
    assert robot.get("controller.safety_mode") == (1 if number == MOVE_J else 3), "a protective stop"
    registers.close()


def test_a_watchdog_slower_than_any_number_never_trips(robot, registers) -> None:
    registers.command(SET_WATCHDOG, 1e-300)
    wait_until(lambda: script_state(robot, registers) == 2, "the watchdog is set")
    wait_cycles(robot, 20)
    assert robot.get("counters.watchdog_trips") == 0


def test_stop_script_ends_the_program(robot, registers) -> None:
    registers.command(STOP_SCRIPT)
    wait_until(lambda: runtime(robot) == STOPPED, "ended")


def test_the_watchdog_stops_the_program_when_commands_cease(robot, registers) -> None:
    registers.command(SET_WATCHDOG, 10.0)
    wait_until(lambda: script_state(robot, registers) == 2, "the watchdog is set")
    until = robot.get("counters.cycles") + 40

    def kick() -> bool:
        registers.command(0)
        return robot.get("counters.cycles") > until

    wait_until(kick, "a third of a second of commands")
    assert runtime(robot) == PLAYING
    assert robot.get("counters.watchdog_trips") == 0
    wait_until(lambda: runtime(robot) == STOPPED, "stopped after silence")
    assert robot.get("counters.watchdog_trips") == 1


def test_without_a_watchdog_the_script_outlives_its_client(robot, registers) -> None:
    registers.command(SERVO_J, 1.6, -0.2, 1.6, -1.4, 1.6, 1.3)
    wait_until(lambda: robot.get("controller.motion.actual")[0] > 1.599, "at the target")
    registers.close()
    wait_cycles(robot, 30)
    assert runtime(robot) == PLAYING


def test_a_protective_stop_pauses_and_play_resumes_the_servo(robot, registers) -> None:
    registers.command(SERVO_J, 1.6, -0.2, 1.6, -1.4, 1.6, 1.3)
    wait_until(lambda: robot.get("controller.motion.actual")[0] > 1.599, "at the target")
    robot.call("protective_stop")
    assert runtime(robot) == PAUSED
    robot.call("clear_stop")
    assert runtime(robot) == PAUSED
    robot.call("resume_program")
    assert runtime(robot) == PLAYING
