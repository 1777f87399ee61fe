"""What clients send to ports 30001 to 30003: programs, and the few commands that the ports take themselves.

A program is `def name():` up to an `end` with the same indentation (inner blocks are indented further); `sec name():`
runs beside the program; any other line is a program of its own.
"""

from __future__ import annotations

import re

from sim_backend.ur10.controller import UrController
from sim_backend.ur10.request_log import RequestLog

_LIMIT_BYTES = 1_000_000
_SET_SPEED = re.compile(r"set speed ([0-9.]+)$")


class ProgramReader:
    """Puts together the programs of one connection and gives them to the robot."""

    def __init__(self, robot: UrController, requests: RequestLog) -> None:
        self._robot = robot
        self._requests = requests
        self._rest = b""
        self._program: list[str] = []
        self._end = ""
        self._commands = {
            "power on": robot.power_on,
            "power off": robot.power_off,
            "set robotmode run": robot.power_on_and_release,
            "set unlock protective stop": robot.unlock_protective_stop,
            "stop program": robot.stop_program,
        }

    def feed(self, data: bytes) -> bool:
        """Take received bytes; return False when the client sends without an end."""
        self._requests.script_bytes += len(data)
        *lines, self._rest = (self._rest + data).split(b"\n")
        if len(self._rest) > _LIMIT_BYTES or sum(map(len, self._program)) + len(self._program) > _LIMIT_BYTES:
            return False
        for line in lines:
            self._on_line(line.decode("utf-8", "replace").rstrip())
        return True

    def _on_line(self, line: str) -> None:
        if self._program:
            self._program.append(line)
            if line == self._end:
                self._run("\n".join(self._program) + "\n")
                self._program = []
        elif (text := line.lstrip()).startswith(("def ", "sec ")):
            self._program = [line]
            self._end = line.removesuffix(text) + "end"
        elif text in self._commands:
            self._requests.scripts.append(text)
            self._commands[text]()
        elif found := _SET_SPEED.match(text):
            self._requests.scripts.append(text)
            self._robot.set_speed(float(found.group(1)))
        elif text and not text.startswith("#"):
            self._run(line + "\n")

    def _run(self, text: str) -> None:
        self._requests.scripts.append(text.split("\n", 1)[0])
        if text.lstrip().startswith("sec "):
            self._robot.run_beside(text)
        else:
            self._robot.upload(text)
