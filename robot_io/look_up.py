"""Names of hosts into addresses, within a deadline.

The C library's look-up cannot be bounded (a name server that is silent costs 5 s and more for each try), so it runs in
a process of its own, which is killed when it takes too long.
"""

from __future__ import annotations

import socket
import subprocess
import sys

from robot_io.errors import DeviceUnreachable

LOOK_UP_WITHIN_S = 2.0

_LOOK_UP = """
import socket, sys
try:
    found = socket.getaddrinfo(sys.argv[1], None, type=socket.SOCK_STREAM)
except (OSError, UnicodeError) as error:
    sys.exit(getattr(error, "strerror", None) or str(error))
print("\\n".join(dict.fromkeys(str(entry[4][0]) for entry in found)))
"""


def addresses_of(host: str, *, where: str) -> list[str]:
    """Return the numeric addresses of a host, in the system's order; an address is its own, without any look-up.

    where: what the error names. Raises DeviceUnreachable if the name is unknown or not found within 2 s.
    """
    if numeric := _numeric(host):
        return [numeric]
    command = [sys.executable, "-I", "-S", "-c", _LOOK_UP, host]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=LOOK_UP_WITHIN_S, check=False)
    except subprocess.TimeoutExpired:
        raise DeviceUnreachable(
            f"the name {host!r} could not be looked up within {LOOK_UP_WITHIN_S:g} s",
            where=where,
            do="Check this machine's name server, or give the numeric address",
        ) from None
    if done.returncode != 0:
        raise DeviceUnreachable(
            f"no host has the name {host!r} ({done.stderr.strip()})",
            where=where,
            do="Correct the name, or give the numeric address",
        )
    return done.stdout.split()


def _numeric(host: str) -> str:
    """Return a numeric IPv4 or IPv6 address in its usual form, "" for a name."""
    try:
        found = socket.getaddrinfo(host, None, type=socket.SOCK_STREAM, flags=socket.AI_NUMERICHOST)
    except (OSError, UnicodeError):
        return ""
    return str(found[0][4][0])
