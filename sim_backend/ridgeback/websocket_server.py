"""A websocket server inside an event loop, on the Sans-I/O connection of `wsproto`, with a real one's faults.

Behaves as rosbridge's server does: any path, no subprotocol, no compression, an answer to every ping, an output
buffer that grows while a client does not read. When a connection is reset, messages that were not yet processed
are lost: the worker has one message in hand, the rest is dropped. When it is closed in order they are kept (a real
server then drops about half of them; the worse case is modelled here). Faults (frozen process, half-open link, a
server that stops reading, a killed one) can be switched on here.
"""

from __future__ import annotations

import contextlib
import ipaddress
import socket
import struct
from collections.abc import Callable

from wsproto import ConnectionType, WSConnection
from wsproto.connection import ConnectionState
from wsproto.events import AcceptConnection, BytesMessage, CloseConnection, Event, Ping, Pong, Request, TextMessage
from wsproto.utilities import ProtocolError, RemoteProtocolError

from robot_io.clock import NS_PER_S, monotonic_ns
from robot_io.errors import EnvironmentFault, UsageError
from robot_io.ipc.event_loop import READ, WRITE, EventLoop

MAX_UNSENT_BYTES = 64 * 1024 * 1024
"""A client that leaves this much unread is dropped; the real server would continue until it runs out of memory."""
_RECEIVE_BYTES = 65_536
_MAX_BATCH_BYTES = 16 * 1024 * 1024
_RESET_ON_CLOSE = struct.pack("ii", 1, 0)
_SERVER_NAME = b"AutobahnPython/23.1.2"


class WebSocketPeer:
    """One client. `send_text` queues a message; `open` is False before the handshake and after the end."""

    def __init__(self, server: WebSocketServer, sock: socket.socket) -> None:
        self._server = server
        self._socket: socket.socket | None = sock
        self._websocket = WSConnection(ConnectionType.SERVER)
        self._unsent = bytearray()
        self._text: list[str] = []
        self._closing = False
        self._broken = self._reset = False
        self.open = False
        self.silent = False
        """Half-open: nothing is sent or received any more, without any error."""
        self.reading = True
        self.newest_inbound_ns = monotonic_ns()

    def send_text(self, text: str) -> None:
        """Send one text message, and queue what the socket does not accept."""
        if self.open and not self.silent and self._websocket.state is ConnectionState.OPEN:
            self._write(self._websocket.send(TextMessage(data=text)))

    def ping(self) -> None:
        """Send a ping."""
        if self.open and not self.silent and self._websocket.state is ConnectionState.OPEN:
            self._write(self._websocket.send(Ping()))

    def watch(self, on: bool) -> None:
        """Start or stop watching the socket."""
        loop = self._server.loop
        if self._socket is None:
            return
        fd = self._socket.fileno()
        loop.remove_fd(fd)
        events = (READ if self.reading else 0) | (WRITE if self._unsent else 0)
        if on and not self.silent and events:
            loop.add_fd(fd, self._on_ready, events)

    def end(self, *, reset: bool = False) -> None:
        """Close the connection, with a reset if asked; idempotent."""
        sock, self._socket = self._socket, None
        if sock is None:
            return
        self._server.loop.remove_fd(sock.fileno())
        if reset:
            with contextlib.suppress(OSError):
                sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _RESET_ON_CLOSE)
        sock.close()
        was_open, self.open = self.open, False
        self._server.forget(self, was_open)

    def _on_ready(self, events: int) -> None:
        if events & WRITE:
            self._write(b"")
        if self._socket is None or not events & ~WRITE:
            return
        data, ended, reset = self._read()
        texts: list[str] = []
        ended = self._parse(data, texts) or ended
        if reset:
            del texts[1:]
        for text in texts:
            self._server.on_text(self, text)
        if ended:
            self.end()

    def _read(self) -> tuple[bytes, bool, bool]:
        """Read all available bytes before answering; return them, whether the stream ended, and whether by a reset."""
        assert self._socket is not None
        data = bytearray()
        while len(data) < _MAX_BATCH_BYTES:
            try:
                part = self._socket.recv(_RECEIVE_BYTES)
            except BlockingIOError:
                return bytes(data), False, False
            except OSError as error:
                return bytes(data), True, isinstance(error, ConnectionResetError)
            if not part:
                return bytes(data), True, self._reset
            data += part
            self.newest_inbound_ns = monotonic_ns()
        return bytes(data), False, False

    def _parse(self, data: bytes, texts: list[str]) -> bool:
        """Append the texts in `data`, answer control frames; return whether the client closed or broke the protocol."""
        try:
            if data:
                self._websocket.receive_data(data)
            for event in self._websocket.events():
                self._on_event(event, texts)
                if self._closing:
                    return True
        except RemoteProtocolError as error:
            if error.event_hint is not None and not self.open:  # not a websocket handshake: answer HTTP 400
                self._write(self._websocket.send(error.event_hint))
            return True
        except ProtocolError:
            return True
        return False

    def _on_event(self, event: Event, texts: list[str]) -> None:
        if isinstance(event, TextMessage):
            self._text.append(event.data)
            if event.message_finished:
                texts.append("".join(self._text))
                self._text.clear()
        elif isinstance(event, Ping):
            self._write(self._websocket.send(event.response()))
        elif isinstance(event, Request):
            self._write(self._websocket.send(AcceptConnection(extra_headers=[(b"Server", _SERVER_NAME)])))
            self.open = True
            self._server.on_open(self)
        elif isinstance(event, CloseConnection):
            if self._websocket.state is ConnectionState.REMOTE_CLOSING:
                self._write(self._websocket.send(event.response()))
            self._closing = True
        elif not isinstance(event, (BytesMessage, Pong)):  # binary frames are ignored, pongs need no answer
            raise ProtocolError(f"unexpected {event}")

    def _write(self, data: bytes) -> None:
        if self._socket is None or self._broken:
            return
        waiting = bool(self._unsent)
        self._unsent += data
        try:
            while self._unsent:
                del self._unsent[: self._socket.send(self._unsent)]
        except BlockingIOError:
            pass
        except OSError as error:
            # What arrived before is still processed, and the reading side ends the connection. A reset is reported only
            # once: here or there. (Writing to a client that closed in order gives EPIPE instead.)
            self._broken = True
            self._reset = isinstance(error, ConnectionResetError)
            self._unsent.clear()
        if len(self._unsent) > MAX_UNSENT_BYTES:
            self.end(reset=True)
        elif bool(self._unsent) != waiting:
            self.watch(self._server.running)


class WebSocketServer:
    """Listens on `host`:`port` (0: any free one, kept across restarts) and calls back on open, text and close.

    `nagle`: leave the kernel's Nagle algorithm on, as autobahn 23.1 and later do by mistake. `ping_interval_s` and
    `ping_timeout_s` above 0: ping, and reset a client that has sent nothing for that long.
    Raises UsageError for an address that is not loopback, EnvironmentFault when the port cannot be bound.
    """

    def __init__(
        self,
        loop: EventLoop,
        host: str,
        port: int,
        *,
        on_open: Callable[[WebSocketPeer], None],
        on_text: Callable[[WebSocketPeer, str], None],
        on_close: Callable[[WebSocketPeer], None],
        nagle: bool = False,
        ping_interval_s: float = 0.0,
        ping_timeout_s: float = 0.0,
    ) -> None:
        if not ipaddress.ip_address(host).is_loopback:
            raise UsageError(f"{host} is not a loopback address", where="emulated bridge", do="Use 127.0.0.1")
        self.loop = loop
        self.on_open, self.on_text, self._on_close = on_open, on_text, on_close
        self.host, self.port = host, port
        self.running = True
        """Whether the process runs; False while it is frozen."""
        self.peers: list[WebSocketPeer] = []
        self._nagle = nagle
        self._ping_timeout_ns = int(ping_timeout_s * NS_PER_S)
        self._listener: socket.socket | None = None
        self.listen()
        self._pinger = loop.call_every(int(ping_interval_s * NS_PER_S), self._ping_all) if ping_interval_s else None

    def listen(self) -> None:
        """Start accepting clients; no effect if already listening."""
        if self._listener is not None:
            return
        sock = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        try:
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            sock.bind((self.host, self.port))
            sock.listen(16)
        except OSError as error:
            sock.close()
            raise EnvironmentFault(
                f"cannot listen ({error.strerror or error})",
                where=f"{self.host}:{self.port}",
                do="Choose another port, or end the program that uses it",
            ) from error
        sock.setblocking(False)
        self.port = sock.getsockname()[1]
        self._listener = sock
        self.loop.add_fd(sock.fileno(), self._accept)

    def kill(self) -> None:
        """End as a killed process does: connections reset, nothing listens."""
        for peer in list(self.peers):
            peer.end(reset=True)
        self._stop_listening()

    def set_running(self, running: bool) -> None:
        """Freeze (as SIGSTOP does: the kernel still accepts what fits its buffers), or resume."""
        if running == self.running:
            return
        self.running = running
        if self._listener is not None:
            self.loop.remove_fd(self._listener.fileno())
            if running:
                self.loop.add_fd(self._listener.fileno(), self._accept)
        for peer in list(self.peers):
            peer.watch(running)

    def close(self) -> None:
        """Close all connections and the port; idempotent."""
        if self._pinger is not None:
            self._pinger.cancel()
        for peer in list(self.peers):
            peer.end()
        self._stop_listening()

    def forget(self, peer: WebSocketPeer, was_open: bool) -> None:
        """Remove a peer that has ended; called by the peer."""
        self.peers.remove(peer)
        if was_open:
            self._on_close(peer)

    def _stop_listening(self) -> None:
        if self._listener is not None:
            self.loop.remove_fd(self._listener.fileno())
            self._listener.close()
            self._listener = None

    def _accept(self, _: int) -> None:
        assert self._listener is not None
        try:
            sock, _address = self._listener.accept()
        except OSError:
            return  # the client has given up already
        sock.setblocking(False)
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 0 if self._nagle else 1)
        peer = WebSocketPeer(self, sock)
        self.peers.append(peer)
        peer.watch(self.running)

    def _ping_all(self, _: int) -> None:
        if not self.running:
            return
        for peer in list(self.peers):
            if self._ping_timeout_ns and monotonic_ns() - peer.newest_inbound_ns > self._ping_timeout_ns:
                peer.end(reset=True)
            else:
                peer.ping()
