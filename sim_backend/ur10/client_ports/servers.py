"""Ports 30001 (primary), 30002 (secondary) and 30003 (real time): state to every client, programs from them.

A client that does not read loses packets of state, and its connection only when it reads none for very long.
"""

from __future__ import annotations

import socket

from robot_io.ipc.event_loop import EventLoop
from sim_backend.ur10.client_ports.message_packets import report_message, version_message
from sim_backend.ur10.client_ports.programs_in import ProgramReader
from sim_backend.ur10.client_ports.realtime_packet import realtime_layout, realtime_packet
from sim_backend.ur10.client_ports.state_packets import StatePackets
from sim_backend.ur10.controller import UrController
from sim_backend.ur10.request_log import RequestLog
from sim_backend.ur10.tcp import TcpClient, TcpServer

PRIMARY_PORT, SECONDARY_PORT, REALTIME_PORT = 30001, 30002, 30003
STATE_HZ = 10.0
DROP_ABOVE_BYTES = 20_000
"""State for a client that leaves more than this unread is dropped."""


class PortClient(TcpClient):
    """One connection."""

    def __init__(self, server: PortServer, sock: socket.socket, robot: UrController, requests: RequestLog) -> None:
        super().__init__(server, sock)
        self._port = server
        self._programs = ProgramReader(robot, requests)
        self.greeted = False

    def on_bytes(self, data: bytes) -> None:
        """See `TcpClient.on_bytes`."""
        if not self._programs.feed(data):
            self.close()

    @property
    def behind(self) -> bool:
        """Whether the client has so much unread that it is to get no more; counts what it loses."""
        behind = self.queued_bytes > DROP_ABOVE_BYTES
        self._port.dropped += behind
        return behind

    def give(self, packet: bytes) -> None:
        """Send a packet of state."""
        self._port.sent += 1
        self.send(packet)


class PortServer(TcpServer):
    """One of the three ports."""

    def __init__(self, loop: EventLoop, host: str, port: int, robot: UrController, requests: RequestLog) -> None:
        self.sent = self.dropped = 0
        self.muted = False
        self.port_clients: list[PortClient] = []
        self._robot, self._requests = robot, requests
        super().__init__(loop, host, port, self._connect)

    def ready(self) -> list[PortClient]:
        """Return the clients that are to get something now."""
        self.port_clients = [client for client in self.port_clients if client.open]
        return [] if self.muted or self.frozen else self.port_clients

    def _connect(self, server: TcpServer, sock: socket.socket) -> PortClient:
        client = PortClient(self, sock, self._robot, self._requests)
        self.port_clients.append(client)
        return client


class ClientPorts:
    """The three ports together. Raises EnvironmentFault when one is taken, leaving none open."""

    def __init__(self, loop: EventLoop, host: str, robot: UrController, requests: RequestLog) -> None:
        self._robot = robot
        self._packets = StatePackets(robot.model, robot.version)
        self._realtime = realtime_layout(robot.version)
        self._state_due = 0.0
        self.servers: list[PortServer] = []
        try:
            for port in (PRIMARY_PORT, SECONDARY_PORT, REALTIME_PORT):
                self.servers.append(PortServer(loop, host, port, robot, requests))
        except BaseException:
            for server in self.servers:
                server.close()
            raise
        self._primary, self._secondary, self._realtime_port = self.servers

    @property
    def counters(self) -> dict[str, int]:
        """Return counts since the start."""
        return {
            "state_sent": sum(server.sent for server in self.servers),
            "state_dropped": sum(server.dropped for server in self.servers),
        }

    def send_cycle(self) -> None:
        """Send what this control cycle brings: reports and real-time packets, and the state ten times a second."""
        robot = self._robot
        readers = self._primary.ready()
        while robot.reports:
            message = report_message(robot.reports.popleft(), robot.time_ns)
            for client in readers:
                if client.greeted:
                    client.send(message)
        if clients := [client for client in self._realtime_port.ready() if not client.behind]:
            packet = realtime_packet(self._realtime, robot)
            for client in clients:
                client.give(packet)
        self._greet()
        self._state_due += STATE_HZ * robot.model.cycle_s
        if self._state_due >= 1.0 - 1e-9:
            self._state_due -= 1.0
            for server in (self._primary, self._secondary):
                greeted = [client for client in server.ready() if client.greeted and not client.behind]
                self._send_state(greeted, server is self._primary, first=False)

    def _greet(self) -> None:
        """Tell who has just connected what it has reached, and the whole state at once."""
        robot = self._robot
        for server in (self._primary, self._secondary):
            new = [client for client in server.ready() if not client.greeted]
            for client in new:
                client.greeted = True
                client.send(version_message(robot.version, robot.model.version_date, robot.time_ns))
            self._send_state(new, server is self._primary, first=True)

    def _send_state(self, clients: list[PortClient], primary: bool, *, first: bool) -> None:
        if clients:
            packet = self._packets.packet(self._robot, primary=primary, first=first)
            for client in clients:
                client.give(packet)
