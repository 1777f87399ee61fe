"""The socket under a websocket: its address, the name looked up, the connection made, and for `wss` the certificate
checked, each within its own time.

A certificate is checked against the system's store; SSL_CERT_FILE names another, for a laboratory's own authority.
"""

from __future__ import annotations

import socket
import ssl
import time

from websockets.exceptions import InvalidURI
from websockets.uri import WebSocketURI, parse_uri

from robot_io.errors import ConfigError, DeviceProtocolError, DeviceUnreachable
from robot_io.look_up import addresses_of

CONNECT_TIMEOUT_S = 1.0
TLS_TIMEOUT_S = 1.0
START_THE_BRIDGE = "Start rosbridge on the robot (roslaunch rosbridge_server rosbridge_websocket.launch)"


def parse_url(url: str) -> WebSocketURI:
    """Return the parts of `ws://host:port/` or `wss://...`. Raises ConfigError for anything else."""
    try:
        uri = parse_uri(url)
        uri.host.encode("idna")  # as looking it up does
    except (InvalidURI, ValueError) as error:
        raise ConfigError(
            f"{url!r} is not a websocket address", where="base url", do="Write it as ws://192.168.131.1:9090"
        ) from error
    return uri


def open_socket(uri: WebSocketURI, url: str) -> socket.socket:
    """Return a connected socket, encrypted for `wss`; takes at most 4 s, half of it for the name.

    Raises DeviceUnreachable (unknown name, nothing listens, no answer) or DeviceProtocolError (a certificate that is
    not trusted, or no encryption at all).
    """
    sock = _connected(addresses_of(uri.host, where=url), uri.port, url)
    if not uri.secure:
        return sock
    try:
        sock.settimeout(TLS_TIMEOUT_S)
        return ssl.create_default_context().wrap_socket(sock, server_hostname=uri.host)
    except ssl.SSLCertVerificationError as error:
        sock.close()
        raise DeviceProtocolError(
            f"its certificate is not trusted ({error.verify_message})",
            where=url,
            do="Give the name the certificate is for, and its authority's file in SSL_CERT_FILE",
        ) from error
    except TimeoutError as error:
        sock.close()
        raise DeviceUnreachable(
            f"accepts connections but gave no TLS handshake within {TLS_TIMEOUT_S:g} s",
            where=url,
            do="The bridge hangs, or does not encrypt: then write ws://",
        ) from error
    except OSError as error:
        sock.close()
        raise DeviceProtocolError(
            f"no encrypted connection ({getattr(error, 'reason', None) or error.strerror or error})",
            where=url,
            do="A bridge that does not encrypt has a ws:// address",
        ) from error


def _connected(addresses: list[str], port: int, url: str) -> socket.socket:
    """Return a connection to the first address that takes one; all together have CONNECT_TIMEOUT_S."""
    until_s = time.monotonic() + CONNECT_TIMEOUT_S
    failure: OSError = TimeoutError()
    for address in addresses:
        try:
            return socket.create_connection((address, port), timeout=max(0.01, until_s - time.monotonic()))
        except OSError as error:
            failure = error
    if isinstance(failure, TimeoutError):
        raise DeviceUnreachable(
            f"no answer within {CONNECT_TIMEOUT_S:g} s",
            where=url,
            do="Check cable, address and that the base is on",
        ) from failure
    why = failure.strerror or str(failure)
    raise DeviceUnreachable(f"cannot connect ({why})", where=url, do=START_THE_BRIDGE) from failure
