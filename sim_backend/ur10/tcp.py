"""Non-blocking server and client connections for one TCP port of the emulated controller."""

from __future__ import annotations

import errno
import socket
import struct
from abc import ABC, abstractmethod
from collections.abc import Callable

from robot_io.errors import EnvironmentFault, UsageError
from robot_io.ipc.event_loop import HANGUP, READ, WRITE, EventLoop

_READ_BYTES = 4096
"""Small, so that a client that floods its connection with requests does not keep the others waiting."""
_QUEUE_LIMIT_BYTES = 4_000_000
"""A client that leaves this much unread is dropped."""

_SEND_BUFFER_BYTES = 65536
"""Small, so that little is buffered for a slow client and dropping starts early."""


class TcpClient(ABC):
    """One accepted connection with a queue of bytes still to send. Subclasses implement `on_bytes`."""

    def __init__(self, server: TcpServer, sock: socket.socket) -> None:
        self.server = server
        self._sock = sock
        self._queue = bytearray()
        self._frozen = False
        self.open = True
        server.loop.add_fd(sock.fileno(), self._on_ready)

    @property
    def queued_bytes(self) -> int:
        """Number of bytes that the client has not accepted yet."""
        return len(self._queue)

    @abstractmethod
    def on_bytes(self, data: bytes) -> None:
        """Process received bytes."""

    def on_closed(self) -> None:  # noqa: B027 - most have nothing to release
        """Release resources; called once when the connection has ended."""

    def send(self, data: bytes) -> None:
        """Queue `data` and send what the socket accepts now."""
        if not self.open:
            return
        self._queue += data
        if len(self._queue) > _QUEUE_LIMIT_BYTES:
            self.close()
        elif not self._frozen:
            self._flush()

    def read_now(self) -> None:
        """Read what has already arrived."""
        if self.open and not self._frozen:
            self._read()

    def freeze(self, frozen: bool) -> None:
        """Neither read nor write until thawed; the connection stays open."""
        if frozen == self._frozen or not self.open:
            return
        self._frozen = frozen
        if frozen:
            self.server.loop.remove_fd(self._sock.fileno())
        else:
            self.server.loop.add_fd(self._sock.fileno(), self._on_ready, READ | WRITE)

    def close(self) -> None:
        """Close with FIN; idempotent."""
        if self.open:
            self.open = False
            self.server.loop.remove_fd(self._sock.fileno())
            self._sock.close()
            self.server.clients.discard(self)
            self.on_closed()

    def reset(self) -> None:
        """Close with RST."""
        if self.open:
            self._sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            self.close()

    def _on_ready(self, events: int) -> None:
        if events & (READ | HANGUP):
            self._read()
        if self.open and events & WRITE:
            self._flush()

    def _read(self) -> None:
        try:
            data = self._sock.recv(_READ_BYTES)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if data:
            self.on_bytes(data)
        else:
            self.close()

    def _hear_out(self) -> None:
        """Process what a client sent before it went: one that reads nothing ends its connection with a reset."""
        while self.open:
            try:
                data = self._sock.recv(_READ_BYTES)
            except OSError:
                return
            if not data:
                return
            self.on_bytes(data)

    def _flush(self) -> None:
        try:
            sent = self._sock.send(self._queue)
        except BlockingIOError:
            sent = 0
        except OSError:
            self._hear_out()
            self.close()
            return
        del self._queue[:sent]
        self.server.loop.set_events(self._sock.fileno(), READ | WRITE if self._queue else READ)


class TcpServer:
    """One listening port on a loopback address. Raises EnvironmentFault when it is taken."""

    def __init__(
        self, loop: EventLoop, host: str, port: int, make_client: Callable[[TcpServer, socket.socket], TcpClient]
    ) -> None:
        if not host.startswith("127."):
            raise UsageError(
                "an emulated robot listens on loopback addresses only", where=host, do="Use an address 127.x.y.z"
            )
        self.loop = loop
        self.clients: set[TcpClient] = set()
        self.accepted = 0
        self._make_client = make_client
        self.frozen = False
        self._where = f"{host}:{port}"
        self._sock = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        self._sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self._sock.setblocking(False)
        try:
            self._sock.bind((host, port))
            self._sock.listen(128)  # beyond it the kernel drops a connection, and its client tries again a second later
        except OSError as error:
            self._sock.close()
            raise _cannot_listen(error, self._where) from error
        loop.add_fd(self._sock.fileno(), self._on_ready)

    def freeze(self, frozen: bool) -> None:
        """Freeze as SIGSTOP does: the kernel still accepts connections, nothing is answered until thawed."""
        if frozen != self.frozen:
            self.frozen = frozen
            if frozen:
                self.loop.remove_fd(self._sock.fileno())
            else:
                self.loop.add_fd(self._sock.fileno(), self._on_ready)
            for client in tuple(self.clients):
                client.freeze(frozen)

    def close_clients(self, reset: bool = False) -> None:
        """End every connection, with FIN or RST; the port stays open."""
        for client in tuple(self.clients):
            if reset:
                client.reset()
            else:
                client.close()

    def close(self) -> None:
        """Close connections and port; idempotent."""
        self.close_clients()
        if self._sock.fileno() >= 0:
            self.loop.remove_fd(self._sock.fileno())
            self._sock.close()

    def _on_ready(self, events: int) -> None:
        try:
            sock, _ = self._sock.accept()
        except OSError:
            return
        sock.setblocking(False)
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER_BYTES)
        self.accepted += 1
        client = self._make_client(self, sock)
        if client.open:  # one that disconnected before its greeting is not
            self.clients.add(client)


def _cannot_listen(error: OSError, where: str) -> EnvironmentFault:
    if error.errno == errno.EADDRINUSE:
        return EnvironmentFault(
            "the port is already in use",
            where=where,
            do="Another emulator runs there: stop it, or choose another address 127.x.y.z",
        )
    return EnvironmentFault(f"cannot listen: {error.strerror}", where=where, do="Choose another address 127.x.y.z")
