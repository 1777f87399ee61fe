"""How a child process reports to the one that started it: JSON lines on a pipe, never blocking the sender.

{"event": "ready", ...}        it does its work; what else is in it is for whoever started it
{"event": "error", "kind": "DeviceUnreachable", "error": {"code": 4, "what": "...", "where": "...", "do": "..."}}
{"event": "finished", ...}     its last word
{"event": ..., ...}            anything else that the two agree on
"""

from __future__ import annotations

import contextlib
import os
import select
import time
from typing import Any

import msgspec

from robot_io import errors
from robot_io.errors import PushError


class StatusPipe:
    """The speaking end; a full or closed pipe loses the line, never the process."""

    def __init__(self, fd: int) -> None:
        self._fd = fd
        self._cut = False
        os.set_blocking(fd, False)

    def say(self, event: str, **facts: object) -> None:
        """Send one line: {"event": event, ...facts}."""
        line = msgspec.json.encode({"event": event, **facts}) + b"\n"
        if self._cut:  # the line before went in by half: end it, so that it does not swallow this one
            line = b"\n" + line
        with contextlib.suppress(OSError):
            self._cut = os.write(self._fd, line) < len(line)

    def say_whole(self, within_s: float, event: str, **facts: object) -> None:
        """Send one line of any length, waiting up to `within_s` for a slow listener: for the last word of a process."""
        line = msgspec.json.encode({"event": event, **facts}) + b"\n"
        rest = b"\n" + line if self._cut else line
        poll = select.poll()
        poll.register(self._fd, select.POLLOUT)
        deadline_s = time.monotonic() + within_s
        with contextlib.suppress(OSError):
            while rest and time.monotonic() < deadline_s:
                poll.poll(100)
                with contextlib.suppress(BlockingIOError):
                    rest = rest[os.write(self._fd, rest) :]
        self._cut = bool(rest)

    def error(self, error: PushError) -> None:
        """Send an error with its kind."""
        self.say("error", kind=type(error).__name__, error=error.as_json())


def error_of(event: dict[str, Any]) -> PushError:
    """Return the error that an event reports, of the kind that it was; a plain PushError for a kind unknown here."""
    kind = getattr(errors, str(event.get("kind")), None)
    if not (isinstance(kind, type) and issubclass(kind, PushError)):
        kind = PushError
    parts = event.get("error")
    if not isinstance(parts, dict):
        return kind(f"it reported {event!r}", do="This is a bug in the program")
    return kind(str(parts.get("what", "")), where=str(parts.get("where", "")), do=str(parts.get("do", "")))


class StatusReader:
    """The listening end: collects whole lines from a non-blocking pipe."""

    def __init__(self, fd: int) -> None:
        self.fd = fd
        os.set_blocking(fd, False)
        self._rest = b""
        self.open = True

    def read(self) -> list[dict[str, Any]]:
        """Return the events that arrived; `open` turns False at EOF. Lines that are not JSON are left out."""
        while self.open:
            try:
                chunk = os.read(self.fd, 65536)
            except BlockingIOError:
                break
            except OSError:
                chunk = b""
            if not chunk:
                self.open = False
            self._rest += chunk
        *lines, self._rest = self._rest.split(b"\n")
        events = []
        for line in lines:
            with contextlib.suppress(msgspec.DecodeError):
                event = msgspec.json.decode(line)
                if isinstance(event, dict):
                    events.append(event)
        return events

    def close(self) -> None:
        """Close the pipe; idempotent."""
        if self.fd >= 0:
            os.close(self.fd)
            self.fd = -1
            self.open = False
