"""A serial server over TCP as pyserial sees it, with bounds where pyserial has none."""

from __future__ import annotations

import select
import socket
from urllib.parse import urlsplit

from serial.urlhandler import protocol_socket

from robot_io.look_up import addresses_of

CONNECT_TIMEOUT_S = 2.0
MOST_READS = 16
SCHEME = "socket://"


def is_tcp_address(port: str) -> bool:
    """Return whether `port` is `socket://host:port` and nothing more."""
    try:
        parts = urlsplit(port)
        return port.startswith(SCHEME) and bool(parts.hostname and parts.port) and port == f"{SCHEME}{parts.netloc}"
    except ValueError:  # a port that is not a number, or beyond 65535
        return False


class TcpPort(protocol_socket.Serial):
    """`socket://host:port`; connecting, flushing and closing end whatever the peer does."""

    _socket: socket.socket  # made by `open`; the type stubs leave it out

    def open(self) -> None:
        """Connect within 2 s, and 2 s more for a name. Raises DeviceUnreachable (unknown name) or SerialException."""
        address = str(self.portstr)
        parts = urlsplit(address)
        self._address = addresses_of(parts.hostname or "", where=address)[0], parts.port or 0
        # pyserial offers no other way to bound a connection that is neither accepted nor refused.
        protocol_socket.POLL_TIMEOUT = CONNECT_TIMEOUT_S
        super().open()

    def from_url(self, url: str) -> tuple[str, int]:
        """Return host and port for pyserial, the host as a number: a look-up of its own would have no end."""
        return self._address

    def reset_input_buffer(self) -> None:
        """Discard what has arrived, at most 64 kB (pyserial reads as long as the peer sends). Raises OSError."""
        for _ in range(MOST_READS):
            if not select.select([self._socket], [], [], 0)[0] or not self._socket.recv(4096):
                return

    def close(self) -> None:
        """Release the socket (pyserial forgets it open when the peer went first)."""
        left_open = self._socket if self.is_open else None
        super().close()
        if left_open is not None:
            left_open.close()
