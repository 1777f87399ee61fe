"""A log that is read while a run still writes it, so that the end of a run need not wait for all of the reading."""

from __future__ import annotations

import os
import select
import sys
from pathlib import Path

POLL_MS = 20


class WrittenLog:
    """Knows how far a log has come; a byte on `told_fd` says that it is finished.

    When `told_fd` ends without one nobody wants the log any more, and this process ends, code 1.
    """

    def __init__(self, path: Path, told_fd: int) -> None:
        self._path = path
        self._told_fd = told_fd
        self._finished = False

    def grown(self, wanted: int) -> int:
        """Wait until the log has `wanted` bytes or is finished, and return its size (0: there is none)."""
        poll = select.poll()
        poll.register(self._told_fd, select.POLLIN)
        while True:
            finished = self._finished  # looked at before the size, which no longer changes then
            try:
                size = self._path.stat().st_size
            except OSError:
                size = 0
            if finished or size >= wanted:
                return size
            if poll.poll(POLL_MS):
                if not os.read(self._told_fd, 1):
                    sys.exit(1)
                self._finished = True
