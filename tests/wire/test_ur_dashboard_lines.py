"""The dashboard of the emulated controller, line by line as the manual has it."""

import socket

import pytest

from sim_backend.ur10.controller import UrController
from sim_backend.ur10.dashboard import Dashboard
from sim_backend.ur10.models import UR10
from sim_backend.ur10.standalone import StillArm
from tests.wire.ur_process import EmulatorProcess, wait_until


class Lines:
    def __init__(self, host: str) -> None:
        self.socket = socket.create_connection((host, 29999), timeout=3)
        self.file = self.socket.makefile("rwb")
        self.greeting = self.file.readline()

    def __enter__(self) -> "Lines":
        return self

    def __exit__(self, *_: object) -> None:
        self.file.close()
        self.socket.close()

    def ask(self, line: str) -> str:
        self.file.write(line.encode() + b"\n")
        self.file.flush()
        return self.file.readline().decode()


@pytest.fixture(scope="module")
def robot():
    with EmulatorProcess(power_step_s=0.02) as emulator:
        yield emulator


@pytest.fixture
def dashboard(robot):
    with Lines(robot.host) as lines:
        yield lines


def test_greeting(dashboard) -> None:
    assert dashboard.greeting == b"Connected: Universal Robots Dashboard Server\n"


@pytest.mark.parametrize(
    ("command", "reply"),
    [
        ("PolyscopeVersion", "URSoftware 3.15.8.106339 (Oct 05 2021)"),
        ("robotmode", "Robotmode: RUNNING"),
        ("safetymode", "Safetymode: NORMAL"),
        ("running", "Program running: false"),
        ("programState", "STOPPED <unnamed>"),
        ("get robot model", "UR10"),
        ("get serial number", "2015301234"),
        ("isProgramSaved", "false"),
        ("stop", "Stopped"),
        ("play", "Failed to execute: play"),
        ("pause", "Failed to execute: pause"),
        ("close safety popup", "closing safety popup"),
        ("close popup", "closing popup"),
        ("popup hello", "showing popup"),
        ("addToLog hello", "Added log message"),
        ("load /programs/none.urp", "File not found: /programs/none.urp"),
        ("load none.urp", "File not found: none.urp"),
        ("load installation default.installation", "Loading installation: /programs/default.installation"),
        ("load installation none.installation", "File not found: none.installation"),
        ("saveLog", "Log saved to disk"),
        ("generate flight report system", "Flight Report generated with id: system"),
        ("generate flight report", "Flight Report generated with id: system"),
        ("generate support file /tmp", "Completed successfully: /tmp"),
        ("safetystatus", "could not understand: 'safetystatus'"),
        ("setUserRole astronaut", "Failed setting user role: astronaut"),
        ("getUserRole", "NONE"),
        ("is in remote control", "could not understand: 'is in remote control'"),
        ("make coffee", "could not understand: 'make coffee'"),
    ],
)
def test_replies(dashboard, command: str, reply: str) -> None:
    assert dashboard.ask(command) == reply + "\n"


def test_quit_says_goodbye_and_closes(dashboard) -> None:
    assert dashboard.ask("quit") == "Disconnected\n"
    assert dashboard.file.readline() == b""


@pytest.mark.parametrize("name", ["/programs/other.urp", "wait_program.urp"])
def test_a_loaded_program_plays_pauses_and_stops(dashboard, name: str) -> None:
    """`programState` gives the file name alone: UR's own client waits for it."""
    path, file = f"/programs/{name.rpartition('/')[2]}", name.rpartition("/")[2]
    assert dashboard.ask(f"load {name}") == f"Loading program: {path}\n"
    assert dashboard.ask("programState") == f"STOPPED {file}\n"
    assert dashboard.ask("get loaded program") == f"Loaded program: {path}\n"
    assert dashboard.ask("isProgramSaved").startswith("true /programs/")
    assert dashboard.ask("play") == "Starting program\n"
    wait_until(lambda: dashboard.ask("programState") == f"PLAYING {file}\n", "it plays")
    assert dashboard.ask("running") == "Program running: true\n"
    assert dashboard.ask("pause") == "Pausing program\n"
    assert dashboard.ask("programState") == f"PAUSED {file}\n"
    assert dashboard.ask("stop") == "Stopped\n"
    assert dashboard.ask("programState") == f"STOPPED {file}\n"


@pytest.mark.parametrize("role", ["PROGRAMMER", "OPERATOR", "LOCKED", "RESTRICTED", "NONE"])
def test_the_roles_that_a_cb3_has(dashboard, role: str) -> None:
    assert dashboard.ask(f"setUserRole {role}") == f"Setting user role: {role}\n"
    assert dashboard.ask("setUserRole pilot") == "Failed setting user role: pilot\n"
    assert dashboard.ask("getUserRole") == f"{role}\n"


SINCE = [
    ("safetystatus", (3, 15), (5, 3), (5, 4)),
    ("getUserRole", (5, 12), (3, 0), (3, 1)),
    ("saveLog", (5, 7), (3, 12), (3, 13)),
    ("generate support file .", (5, 7), (3, 12), (5, 8)),
    ("get robot model", (5, 5), (3, 11), (3, 12)),
    ("restart safety", (5, 0), (3, 6), (3, 7)),
    ("is in remote control", (3, 15), (5, 5), (5, 6)),
]
"""Command, two versions that do not know it and one that does: the table of UR's own client."""


@pytest.mark.parametrize(("command", "never", "before", "since"), SINCE)
def test_each_version_knows_its_commands(command: str, never, before, since) -> None:
    controller = UrController(StillArm(), UR10, 0)

    def answer(version: tuple[int, int]) -> str:
        controller.version = (*version, 0, 0)
        return Dashboard(controller, ()).answer(command)

    unknown = f"could not understand: '{command}'"
    assert [answer(version) == unknown for version in (never, before, since)] == [True, True, False]


def test_power_off_on_and_brakes(dashboard) -> None:
    assert dashboard.ask("power off") == "Powering off\n"
    assert dashboard.ask("robotmode") == "Robotmode: POWER_OFF\n"
    assert dashboard.ask("power on") == "Powering on\n"
    wait_until(lambda: dashboard.ask("robotmode") == "Robotmode: IDLE\n", "power is on, brakes are on")
    assert dashboard.ask("brake release") == "Brake releasing\n"
    wait_until(lambda: dashboard.ask("robotmode") == "Robotmode: RUNNING\n", "brakes are released")


def test_a_protective_stop_cannot_be_unlocked_at_once(robot, dashboard) -> None:
    robot.call("protective_stop")
    assert dashboard.ask("safetymode") == "Safetymode: PROTECTIVE_STOP\n"
    assert dashboard.ask("robotmode") == "Robotmode: RUNNING\n"
    assert dashboard.ask("unlock protective stop").startswith("Cannot unlock protective stop until 5s after occurrence")
    assert dashboard.ask("safetymode") == "Safetymode: PROTECTIVE_STOP\n"
    robot.call("clear_stop")
    assert dashboard.ask("unlock protective stop") == "Protective stop releasing\n"


def test_an_emergency_stop_takes_the_power(robot, dashboard) -> None:
    robot.call("emergency_stop")
    assert dashboard.ask("safetymode") == "Safetymode: ROBOT_EMERGENCY_STOP\n"
    assert dashboard.ask("robotmode") == "Robotmode: POWER_OFF\n"
    assert dashboard.ask("power on") == "Powering on\n"
    assert dashboard.ask("robotmode") == "Robotmode: POWER_OFF\n"
    assert dashboard.ask("restart safety") == "Restarting safety\n"
    assert dashboard.ask("safetymode") == "Safetymode: NORMAL\n"
    robot.call("set_robot_mode", 7)
