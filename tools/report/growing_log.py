"""Follow a log while a run is still writing it, so that little reading is left when the run ends."""

from __future__ import annotations

import os
import select
import sys
from pathlib import Path

POLL_MS = 20


class GrowingLog:
    """Waits for a log to grow; a byte on `finished_fd` says that it is finished.

    If `finished_fd` is closed without one, the report is no longer wanted and this process exits with code 1.
    """

    def __init__(self, path: Path, finished_fd: int) -> None:
        self._path = path
        self._finished_fd = finished_fd
        self._finished = False

    def wait_for_size(self, wanted: int) -> int:
        """Wait until the log has `wanted` bytes or is finished; return its size (0 if it does not exist)."""
        poll = select.poll()
        poll.register(self._finished_fd, select.POLLIN)
        while True:
            finished = self._finished  # read before the size, which no longer changes once finished
            try:
                size = self._path.stat().st_size
            except OSError:
                size = 0
            if finished or size >= wanted:
                return size
            if poll.poll(POLL_MS):
                if not os.read(self._finished_fd, 1):
                    sys.exit(1)
                self._finished = True
