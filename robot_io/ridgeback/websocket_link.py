"""One websocket connection without a thread and without blocking: the Sans-I/O client of `websockets` on a socket.

Made for commands to a robot: a message leaves whole and now, or the link counts as lost. Nothing queues in
front of it, and nothing is resumed. Reading is bounded, too: a flood of messages cannot hold its reader for longer
than READ_NS. Only `connect` waits, bounded.
"""

from __future__ import annotations

import contextlib
import select
import socket
import ssl
import struct
import time

from websockets.client import ClientProtocol
from websockets.exceptions import InvalidHandshake, InvalidMessage
from websockets.frames import Frame, Opcode
from websockets.http11 import Response
from websockets.protocol import State

from robot_io.clock import NS_PER_MS, NS_PER_S, ClockNs, monotonic_ns
from robot_io.errors import DeviceError, DeviceProtocolError, DeviceUnreachable
from robot_io.ridgeback.open_socket import START_THE_BRIDGE, open_socket, parse_url

HANDSHAKE_TIMEOUT_S = 1.0
CLOSE_TIMEOUT_S = 0.05
SEND_BUFFER_BYTES = 16_384
"""Small: what does not fit into it is old before it arrives."""

PING_PERIOD_NS = 100 * NS_PER_MS
MOST_FRAMES = 200
"""Frames read in one call ..."""
READ_NS = 2 * NS_PER_MS
"""... and processor time of this thread that it may take."""
WOULD_BLOCK = (BlockingIOError, ssl.SSLWantReadError, ssl.SSLWantWriteError)
"""What a socket raises instead of waiting, plain or encrypted."""

_RECEIVE_BYTES = 65_536
_PARSED_BYTES = 256
"""Parsed between two looks at the bounds: at most 128 frames of two bytes, about a millisecond."""
_RESET_ON_CLOSE = struct.pack("ii", 1, 0)


class LinkLost(Exception):
    """The connection is gone or must be given up; the message is the cause."""


class WebSocketLink:
    """A connected websocket; every method returns at once except `connect` (5 s) and `close` (0.05 s)."""

    def __init__(self, sock: socket.socket, protocol: ClientProtocol, clock: ClockNs) -> None:
        self._socket = sock
        self._protocol = protocol
        self._clock = clock
        self._parts: list[bytes] | None = None
        self._unparsed = memoryview(b"")
        self._unparsed_ns = 0
        self._last_ping_ns = 0
        self.behind = False
        """Whether the last `receive` left something unread because its bounds were reached."""
        self._lost: LinkLost | None = None
        self.newest_pong_ns = 0
        """When the server last answered a ping; 0 before the first answer."""
        self.server = ""
        """What the server calls itself."""

    @classmethod
    def connect(cls, url: str, clock: ClockNs = monotonic_ns) -> WebSocketLink:
        """Connect and shake hands. Raises ConfigError, DeviceUnreachable or DeviceProtocolError."""
        uri = parse_url(url)
        sock = open_socket(uri, url)
        sock.setblocking(False)
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER_BYTES)
        link = cls(sock, ClientProtocol(uri), clock)
        try:
            link._shake_hands(url)
        except BaseException:
            sock.close()
            raise
        return link

    def fileno(self) -> int:
        """Return the socket's descriptor."""
        return self._socket.fileno()

    def receive(self) -> list[tuple[bytes, int]]:
        """Return the texts that have arrived, each with its arrival time (ns); pings are answered on the way.

        At most about MOST_FRAMES, within READ_NS; `behind` tells whether more may wait. Raises LinkLost on EOF, error
        or a broken frame, after everything that came before it was returned.
        """
        texts: list[tuple[bytes, int]] = []
        self._raise_if_lost()
        frames, until_ns = 0, time.thread_time_ns() + READ_NS
        self.behind = False
        try:
            while not self.behind and self._read_more():
                frames += self._parse(texts)
                self.behind = frames >= MOST_FRAMES or time.thread_time_ns() > until_ns
        except LinkLost as lost:
            self._lost = lost
            if not texts:
                raise
        return texts

    def send_text(self, payload: bytes) -> None:
        """Send one text message whole and now. Raises LinkLost when the socket does not take all of it."""
        self._raise_if_lost()
        self._protocol.send_text(payload)
        self._flush()

    def send_ping(self, payload: bytes) -> None:
        """Send a ping; `newest_pong_ns` tells when it was answered. Raises LinkLost like `send_text`."""
        self._raise_if_lost()
        self._protocol.send_ping(payload)
        self._flush()

    def ping_if_due(self, now_ns: int) -> bool:
        """Send a ping every PING_PERIOD_NS; return whether one was sent. Raises LinkLost like `send_text`."""
        due = now_ns - self._last_ping_ns >= PING_PERIOD_NS
        if due:
            self._last_ping_ns = now_ns
            self.send_ping(now_ns.to_bytes(8, "big"))
        return due

    def wait_readable(self, until_ns: int) -> bool:
        """Wait until something arrives; False once `until_ns` has passed, however much still comes."""
        left_ns = until_ns - self._clock()
        if left_ns > 0 and isinstance(self._socket, ssl.SSLSocket) and self._socket.pending():
            return True  # decrypted already: the descriptor does not show it
        poll = select.poll()
        poll.register(self._socket, select.POLLIN)
        return left_ns > 0 and bool(poll.poll(-(-left_ns // 1_000_000)))  # rounded up

    def abort(self) -> None:
        """Drop the connection with a reset, so that nothing of it is delivered later; never raises."""
        with contextlib.suppress(OSError):
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _RESET_ON_CLOSE)
        self._socket.close()

    def close(self) -> None:
        """Say goodbye and close; waits at most CLOSE_TIMEOUT_S for the server's goodbye; never raises."""
        with contextlib.suppress(OSError, LinkLost):
            if self._protocol.state is State.OPEN:
                self._protocol.send_close(1000)
                self._flush()
                self._socket.shutdown(socket.SHUT_WR)
                until_ns = self._clock() + int(CLOSE_TIMEOUT_S * NS_PER_S)
                while self.wait_readable(until_ns) and self._socket.recv(_RECEIVE_BYTES):
                    pass
        self._socket.close()

    def _shake_hands(self, url: str) -> None:
        self._protocol.send_request(self._protocol.connect())
        until_ns = self._clock() + int(HANDSHAKE_TIMEOUT_S * NS_PER_S)
        try:
            self._flush()
            while self._protocol.state is State.CONNECTING and self._protocol.handshake_exc is None:
                if not self.wait_readable(until_ns):
                    raise DeviceUnreachable(
                        f"accepts connections but gave no websocket handshake within {HANDSHAKE_TIMEOUT_S:g} s",
                        where=url,
                        do="The bridge hangs, or something else is listening there; restart rosbridge",
                    )
                try:
                    data = self._socket.recv(_RECEIVE_BYTES)
                except WOULD_BLOCK:  # part of an encrypted record
                    continue
                if data:
                    self._protocol.receive_data(data)
                else:
                    self._protocol.receive_eof()
        except (OSError, LinkLost) as error:
            raise DeviceUnreachable(
                f"connection lost during the handshake ({error})", where=url, do=START_THE_BRIDGE
            ) from error
        if self._protocol.handshake_exc is not None:
            raise _not_a_bridge(url, self._protocol.handshake_exc) from self._protocol.handshake_exc
        response = self._protocol.events_received()[0]
        if isinstance(response, Response):
            self.server = response.headers.get("Server", "")

    def _read_more(self) -> bool:
        """Return whether there are bytes to parse, after a look into the socket where there were none."""
        if self._unparsed:
            return True
        try:
            data = self._socket.recv(_RECEIVE_BYTES)
        except WOULD_BLOCK:
            return False
        except OSError as error:
            raise LinkLost(f"connection lost ({error.strerror or error})") from error
        self._unparsed, self._unparsed_ns = memoryview(data), self._clock()
        # Acknowledge at once, or the server's Nagle algorithm holds its next message back for up to 40 ms.
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_QUICKACK, 1)
        if not data:
            raise LinkLost("connection closed by the bridge")
        return True

    def _parse(self, texts: list[tuple[bytes, int]]) -> int:
        """Parse the next few bytes, append the texts in them, and return how many frames they ended."""
        part, self._unparsed = self._unparsed[:_PARSED_BYTES], self._unparsed[_PARSED_BYTES:]
        self._protocol.receive_data(bytes(part))
        frames = self._collect(texts, self._unparsed_ns)
        self._flush()
        if self._protocol.state is not State.OPEN:
            raise LinkLost(self._why_closed())
        return frames

    def _why_closed(self) -> str:
        goodbye = self._protocol.close_rcvd
        if goodbye is not None:
            return f"connection closed by the bridge ({goodbye.code}{f' {goodbye.reason}' if goodbye.reason else ''})"
        return f"the bridge sent no valid websocket frame ({self._protocol.parser_exc})"

    def _raise_if_lost(self) -> None:
        if self._lost is not None:
            raise self._lost
        if self._protocol.state is not State.OPEN:  # its goodbye came together with its handshake
            raise LinkLost(self._why_closed())

    def _collect(self, texts: list[tuple[bytes, int]], now_ns: int) -> int:
        events = self._protocol.events_received()
        for event in events:
            if not isinstance(event, Frame):
                continue
            if event.opcode is Opcode.PONG:
                self.newest_pong_ns = now_ns
            elif event.opcode is Opcode.TEXT and event.fin:
                texts.append((bytes(event.data), now_ns))
            elif event.opcode in (Opcode.TEXT, Opcode.BINARY):
                self._parts = [bytes(event.data)] if event.opcode is Opcode.TEXT else None
            elif event.opcode is Opcode.CONT and self._parts is not None:
                self._parts.append(bytes(event.data))
                if event.fin:
                    texts.append((b"".join(self._parts), now_ns))
                    self._parts = None
        return len(events)

    def _flush(self) -> None:
        data = b"".join(self._protocol.data_to_send())
        if not data:
            return
        try:
            sent = self._socket.send(data)
        except WOULD_BLOCK as error:
            raise LinkLost("the socket accepts no more data: the bridge is not reading") from error
        except OSError as error:
            raise LinkLost(f"sending failed ({error.strerror or error})") from error
        if sent != len(data):
            raise LinkLost("only part of a message could be sent: the bridge is not reading")


def _not_a_bridge(url: str, error: Exception) -> DeviceError:
    detail = str(error) if isinstance(error, InvalidHandshake) and not isinstance(error, InvalidMessage) else ""
    what = "what listens there is not a websocket server" + (f" ({detail})" if detail else "")
    return DeviceProtocolError(what, where=url, do="Check the port; rosbridge listens on 9090 by default")
