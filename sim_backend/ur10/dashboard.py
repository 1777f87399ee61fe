"""The dashboard server of the emulated controller (port 29999): one command and one reply per line.

Source: Universal Robots dashboard server manual, CB3 and e-Series.
"""

from __future__ import annotations

import socket
from collections.abc import Callable

from robot_io.ipc.event_loop import EventLoop
from sim_backend.ur10.controller import UrController
from sim_backend.ur10.modes import MAY_MOVE, RobotMode, RuntimeState, SafetyMode
from sim_backend.ur10.request_log import RequestLog
from sim_backend.ur10.tcp import TcpClient, TcpServer

DASHBOARD_PORT = 29999
GREETING = "Connected: Universal Robots Dashboard Server"
TOO_EARLY = (
    "Cannot unlock protective stop until 5s after occurrence. Always inspect cause of protective stop before unlocking"
)
_LINE_LIMIT_BYTES = 10_000


class Dashboard:
    """Answers dashboard commands for one robot."""

    def __init__(self, robot: UrController, programs: tuple[str, ...]) -> None:
        self.model = robot.model.dashboard_name
        self._robot = robot
        self._serial = robot.model.serial
        self._programs = programs
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
            "quit": lambda: "Disconnected",
            "shutdown": lambda: "Shutting down",
        }

    def answer(self, line: str) -> str:
        """Return the reply to one command."""
        known = self._answers.get(line.lower())
        if known is not None:
            return known()
        word, _, rest = line.partition(" ")
        if word.lower() == "load" and rest:
            return self._load(rest)
        if word.lower() == "popup" and rest:
            return "showing popup"
        if word == "addToLog" and rest:
            return "Added log message"
        if word == "setUserRole" and rest:
            self._role = rest
            return f"Setting user role: {rest}"
        if line == "is in remote control" and self._robot.version[0] >= 5:
            return "true"
        return f"could not understand: '{line}'"

    def _version(self) -> str:
        version = ".".join(map(str, self._robot.version))
        return f"URSoftware {version} ({self._robot.model.version_date})"

    def _program_state(self) -> str:
        state = "PAUSED" if self._robot.runtime_state == RuntimeState.PAUSED else "STOPPED"
        if self._robot.runtime_state == RuntimeState.PLAYING:
            state = "PLAYING"
        return f"{state} {self._loaded or '<unnamed>'}"

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

    def _load(self, path: str) -> str:
        if path not in self._programs:
            return f"File not found: {path}"
        self._loaded = path
        return f"Loading program: {path}"


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
