"""Starts the live view: a process that serves what is fed to it. It may die at any time, and nothing depends on it."""

from __future__ import annotations

import contextlib
import importlib.util
import os
import socket
import sys
from collections.abc import Iterator

from robot_io.error_report import tell
from robot_io.errors import EnvironmentFault, UsageError
from robot_io.ipc.spawn import Child, spawn
from tools.live.job import LiveJob

PORT = 8765
"""Where viewers look by default."""
HOST = "127.0.0.1"
READY_WITHIN_S = 5.0
ENDS_WITHIN_S = 1.0
EXTRA = f"Install it: {sys.executable} -m pip install 'foxglove-sdk>=0.30'"


def check_live(port: int, *, fast: bool = False) -> None:
    """Raise EnvironmentFault where there can be no live view: the extra is missing, or the port is taken.

    fast: the run does not keep to the wall clock, which is UsageError.
    """
    if fast:
        raise UsageError(
            "--live shows a run at the pace of the clock, and --fast does not keep it",
            where="push run",
            do="Leave --fast out",
        )
    if importlib.util.find_spec("foxglove") is None:
        raise EnvironmentFault("--live needs foxglove-sdk, which is not installed", do=EXTRA)
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((HOST, port))
        except OSError as error:
            raise EnvironmentFault(
                f"the live view cannot listen ({error.strerror})", where=f"{HOST}:{port}", do="Give another --live-port"
            ) from None


def start_live(port: int) -> tuple[Child, socket.socket]:
    """Start the process; return it, and the socket for a `LiveFeed`.

    Waits up to 5 s until it listens, so that viewers get the first messages; one that does not is left behind.
    """
    near, far = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with far:
        child = spawn("live", "tools.live.server", LiveJob(port, far.fileno(), os.getpid()), [far.fileno()])
    child.wait_ready(READY_WITHIN_S)
    return child, near


def where_words(child: Child) -> str:
    """Return where the live view is served, or that it is not."""
    if child.ready is not None:
        return f"live view: {child.ready['url']} (Foxglove, Lichtblick)"
    return f"no live view: {child.errors[0] if child.errors else f'not ready within {READY_WITHIN_S:g} s'}"


@contextlib.contextmanager
def live_view(port: int | None) -> Iterator[socket.socket | None]:
    """Give the socket for a `LiveFeed`, None where `port` is; the view's process ends with the block.

    Where it is served, and that a viewer or the view itself has failed, is told on stderr.
    """
    if port is None:
        yield None
        return
    child, feed = start_live(port)
    tell(where_words(child))
    try:
        yield feed
    finally:
        feed.close()
        child.end(ENDS_WITHIN_S)
        for event in child.hear():
            if event.get("event") == "warning":
                tell(event["text"])
        if child.process.returncode:
            tell(f"the live view {child.how_it_ended()}")
        child.close()
