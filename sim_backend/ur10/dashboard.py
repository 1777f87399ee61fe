"""The dashboard server of the emulated controller (port 29999): one command and one reply per line.

Source: Universal Robots dashboard server manual, CB3 and e-Series.
"""

from __future__ import annotations

import posixpath
import socket
from collections.abc import Callable

from robot_io.ipc.event_loop import EventLoop
from sim_backend.ur10.controller import UrController
from sim_backend.ur10.modes import MAY_MOVE, RobotMode, RuntimeState, SafetyMode
from sim_backend.ur10.request_log import RequestLog
from sim_backend.ur10.tcp import TcpClient, TcpServer

DASHBOARD_PORT = 29999
NEVER = (99, 0)
GREETING = "Connected: Universal Robots Dashboard Server"
TOO_EARLY = (
    "Cannot unlock protective stop until 5s after occurrence. Always inspect cause of protective stop before unlocking"
)
_LINE_LIMIT_BYTES = 10_000
PROGRAMS = ("/programs/other.urp", "/programs/wait_program.urp")
INSTALLATIONS = ("/programs/default.installation",)
FOLDER = "/programs"
"""Relative names of programs and installations are looked for here."""
ROLES = ("PROGRAMMER", "OPERATOR", "NONE", "LOCKED", "RESTRICTED")
REPORTS = ("controller", "software", "system")

_SINCE: dict[str, tuple[tuple[int, int], tuple[int, int]]] = {
    "robotmode": ((1, 6), (5, 0)),
    "safetymode": ((3, 0), (5, 0)),
    "safetystatus": (NEVER, (5, 4)),
    "restart safety": ((3, 7), (5, 1)),
    "load installation": ((3, 2), (5, 0)),
    "get serial number": ((3, 12), (5, 6)),
    "get robot model": ((3, 12), (5, 6)),
    "savelog": ((3, 13), (5, 8)),
    "generate flight report": ((3, 13), (5, 8)),
    "generate support file": ((3, 13), (5, 8)),
    "setuserrole": ((3, 1), NEVER),
    "getuserrole": ((3, 1), NEVER),
    "is in remote control": (NEVER, (5, 6)),
    "get operational mode": (NEVER, (5, 6)),
}
"""From which version of a CB3's PolyScope and of an e-Series' on a command is known; all others are in both."""


class Dashboard:
    """Answers dashboard commands for one robot."""

    def __init__(self, robot: UrController, programs: tuple[str, ...]) -> None:
        self.model = robot.model.dashboard_name
        self._robot = robot
        self._serial = robot.model.serial
        self._programs = programs or PROGRAMS
        self._loaded = ""
        self._role = "NONE"
        self._answers: dict[str, Callable[[], str]] = {
            "polyscopeversion": self._version,
            "robotmode": lambda: f"Robotmode: {robot.robot_mode.name}",
            "safetymode": lambda: f"Safetymode: {robot.safety_mode.name}",
            "safetystatus": lambda: f"Safetystatus: {robot.safety_status.name}",
            "running": lambda: f"Program running: {str(robot.runtime_state == RuntimeState.PLAYING).lower()}",
            "programstate": self._program_state,
            "stop": self._stop,
            "play": self._play,
            "pause": self._pause,
            "power on": self._power_on,
            "power off": self._power_off,
            "brake release": self._brake_release,
            "unlock protective stop": self._unlock,
            "close safety popup": lambda: "closing safety popup",
            "close popup": lambda: "closing popup",
            "restart safety": self._restart_safety,
            "get loaded program": lambda: f"Loaded program: {self._loaded}" if self._loaded else "No program loaded",
            "isprogramsaved": lambda: f"true {self._loaded}" if self._loaded else "false",
            "get robot model": lambda: self.model,
            "get serial number": lambda: self._serial,
            "getuserrole": lambda: self._role,
            "savelog": lambda: "Log saved to disk",
            "is in remote control": lambda: "true",
            "get operational mode": lambda: "NONE",
            "quit": lambda: "Disconnected",
            "shutdown": lambda: "Shutting down",
        }

        self._with_argument: dict[str, Callable[[str], str]] = {
            "load installation": self._load_installation,
            "load": self._load,
            "popup": lambda _text: "showing popup",
            "addtolog": lambda _text: "Added log message",
            "setuserrole": self._set_role,
            "generate flight report": self._flight_report,
            "generate support file": lambda folder: f"Completed successfully: {folder}",
        }

    def answer(self, line: str) -> str:
        """Return the reply to one command."""
        if line.lower() in self._answers and self._knows(line.lower()):
            return self._answers[line.lower()]()
        for command, reply in self._with_argument.items():
            argument = line[len(command) + 1 :].strip()
            if line.lower().startswith(f"{command} ") and argument and self._knows(command):
                return reply(argument)
            if line.lower() == command == "generate flight report" and self._knows(command):
                return reply("")
        return f"could not understand: '{line}'"

    def _knows(self, command: str) -> bool:
        cb3, e_series = _SINCE.get(command, ((0, 0), (0, 0)))
        version = self._robot.version
        return version[:2] >= (e_series if version[0] >= 5 else cb3)

    def _version(self) -> str:
        version = ".".join(map(str, self._robot.version))
        return f"URSoftware {version} ({self._robot.model.version_date})"

    def _program_state(self) -> str:
        state = "PAUSED" if self._robot.runtime_state == RuntimeState.PAUSED else "STOPPED"
        if self._robot.runtime_state == RuntimeState.PLAYING:
            state = "PLAYING"
        return f"{state} {posixpath.basename(self._loaded) or '<unnamed>'}"

    def _stop(self) -> str:
        self._robot.stop_program()
        return "Stopped"

    def _play(self) -> str:
        if not self._robot.ready:
            return "Failed to execute: play"
        if self._robot.runtime_state == RuntimeState.PAUSED:
            self._robot.resume_program()
        elif self._loaded:
            self._robot.play_other_program(self._loaded)
        else:
            return "Failed to execute: play"
        return "Starting program"

    def _pause(self) -> str:
        if self._robot.runtime_state != RuntimeState.PLAYING:
            return "Failed to execute: pause"
        self._robot.pause_program()
        return "Pausing program"

    def _power_on(self) -> str:
        self._robot.power_on()
        return "Powering on"

    def _power_off(self) -> str:
        self._robot.power_off()
        return "Powering off"

    def _brake_release(self) -> str:
        self._robot.release_brakes()
        return "Brake releasing"

    def _unlock(self) -> str:
        return "Protective stop releasing" if self._robot.unlock_protective_stop() else TOO_EARLY

    def _restart_safety(self) -> str:
        self._robot.power_off()
        if self._robot.safety_mode not in MAY_MOVE:
            self._robot.safety_mode = SafetyMode.NORMAL
        self._robot.robot_mode = RobotMode.POWER_OFF
        return "Restarting safety"

    def _load(self, name: str) -> str:
        path = posixpath.join(FOLDER, name)
        if path not in self._programs:
            return f"File not found: {name}"
        self._robot.stop_program()
        self._loaded = path
        return f"Loading program: {path}"

    def _load_installation(self, name: str) -> str:
        path = posixpath.join(FOLDER, name)
        return f"Loading installation: {path}" if path in INSTALLATIONS else f"File not found: {name}"

    def _set_role(self, role: str) -> str:
        if role.upper() not in ROLES:
            return f"Failed setting user role: {role}"
        self._role = role.upper()
        return f"Setting user role: {self._role}"

    def _flight_report(self, kind: str) -> str:
        return f"Flight Report generated with id: {kind or REPORTS[-1]}"


class DashboardClient(TcpClient):
    """One dashboard connection."""

    def __init__(self, server: DashboardServer, sock: socket.socket) -> None:
        super().__init__(server, sock)
        self._dashboard_server = server
        self._rest = b""
        self._say(GREETING)

    def on_bytes(self, data: bytes) -> None:
        """See `TcpClient.on_bytes`."""
        *lines, self._rest = (self._rest + data).split(b"\n")
        if len(self._rest) > _LINE_LIMIT_BYTES:
            self.close()
            return
        for raw in lines:
            line = raw.decode("utf-8", "replace").strip()
            if line and self.open:
                self._dashboard_server.requests.dashboard_lines.append(line)
                reply = self._dashboard_server.dashboard.answer(line)
                self._say(reply)
                if line.lower() == "quit":
                    self.close()

    def _say(self, line: str) -> None:
        if not self._dashboard_server.muted:
            self.send(line.encode() + b"\n")


class DashboardServer(TcpServer):
    """The dashboard port."""

    def __init__(self, loop: EventLoop, host: str, dashboard: Dashboard, requests: RequestLog) -> None:
        self.dashboard = dashboard
        self.requests = requests
        self.muted = False
        super().__init__(loop, host, DASHBOARD_PORT, lambda _server, sock: DashboardClient(self, sock))
