"""Script upload on the emulated controller (ports 30001, 30002, 30003): text in, nothing out.

A program is `def name():` up to an `end` with the same indentation (inner blocks are indented further); `sec name():`
runs beside the program; any other line is a program of its own. The state streams of these ports are not emulated.
"""

from __future__ import annotations

import socket

from robot_io.ipc.event_loop import EventLoop
from sim_backend.ur10.controller import UrController
from sim_backend.ur10.request_log import RequestLog
from sim_backend.ur10.tcp import TcpClient, TcpServer

SCRIPT_PORTS = (30001, 30002, 30003)
_LIMIT_BYTES = 1_000_000


class ScriptClient(TcpClient):
    """One connection that uploads programs."""

    def __init__(self, server: TcpServer, sock: socket.socket, robot: UrController, requests: RequestLog) -> None:
        super().__init__(server, sock)
        self._robot = robot
        self._requests = requests
        self._rest = b""
        self._program: list[str] = []
        self._end = ""

    def on_bytes(self, data: bytes) -> None:
        """See `TcpClient.on_bytes`."""
        self._requests.script_bytes += len(data)
        *lines, self._rest = (self._rest + data).split(b"\n")
        if len(self._rest) > _LIMIT_BYTES or sum(map(len, self._program)) + len(self._program) > _LIMIT_BYTES:
            self.close()
            return
        for line in lines:
            self._on_line(line.decode("utf-8", "replace").rstrip())

    def _on_line(self, line: str) -> None:
        if self._program:
            self._program.append(line)
            if line == self._end:
                self._run("\n".join(self._program) + "\n")
                self._program = []
        elif (text := line.lstrip()).startswith(("def ", "sec ")):
            self._program = [line]
            self._end = line.removesuffix(text) + "end"
        elif text and not text.startswith("#"):
            self._run(line + "\n")

    def _run(self, text: str) -> None:
        self._requests.scripts.append(text.split("\n", 1)[0])
        if not text.lstrip().startswith("sec "):
            self._robot.upload(text)


def script_servers(loop: EventLoop, host: str, robot: UrController, requests: RequestLog) -> list[TcpServer]:
    """Listen on the three script ports. Raises EnvironmentFault, leaving none open."""
    servers: list[TcpServer] = []
    try:
        for port in SCRIPT_PORTS:
            servers.append(
                TcpServer(loop, host, port, lambda server, sock: ScriptClient(server, sock, robot, requests))
            )
    except BaseException:
        for server in servers:
            server.close()
        raise
    return servers
