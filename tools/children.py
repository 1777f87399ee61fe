"""Child processes of a run: fresh interpreters, a job on stdin, JSON lines back, watched by pidfd."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import tempfile
from typing import IO, Any

import msgspec

from robot_io.status_pipe import StatusReader


class Child:
    """One process of the run and what it has said."""

    def __init__(self, name: str, process: subprocess.Popen[bytes], status_fd: int, stderr: IO[bytes]) -> None:
        self.name = name
        self.process = process
        self.pidfd = os.pidfd_open(process.pid)
        self.status = StatusReader(status_fd)
        self.ready: dict[str, Any] | None = None
        self.finished: dict[str, Any] | None = None
        self.errors: list[dict[str, Any]] = []
        self._stderr = stderr

    @property
    def pid(self) -> int:
        """Process id."""
        return self.process.pid

    def hear(self) -> list[dict[str, Any]]:
        """Take in what it said: `ready`, `finished` and `error` are kept, everything is returned."""
        events = self.status.read()
        for event in events:
            kind = event.get("event")
            if kind == "ready":
                self.ready = event
            elif kind == "finished":
                self.finished = event
            elif kind == "error":
                self.errors.append(event.get("error", event))
        return events

    def last_words(self) -> str:
        """Return the last line it wrote on stderr, "" when there is none."""
        self._stderr.seek(0, os.SEEK_END)
        self._stderr.seek(max(0, self._stderr.tell() - 4096))
        lines = self._stderr.read().decode(errors="replace").strip().splitlines()
        return lines[-1] if lines else ""

    def all_words(self) -> str:
        """Return all it wrote on stderr."""
        self._stderr.seek(0)
        return self._stderr.read().decode(errors="replace")

    def end(self, within_s: float) -> None:
        """Wait for its end, then kill it; always reaps."""
        try:
            self.process.wait(within_s)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()

    def terminate(self) -> None:
        """Send SIGTERM; a process that is gone already is left alone."""
        with contextlib.suppress(ProcessLookupError):
            self.process.send_signal(signal.SIGTERM)

    def close(self) -> None:
        """Close our descriptors of it."""
        self.status.close()
        self._stderr.close()
        if self.pidfd >= 0:
            os.close(self.pidfd)
            self.pidfd = -1


def spawn(name: str, module: str, job: msgspec.Struct, fds: list[int], status: tuple[int, int]) -> Child:
    """Start `python -m module` with `job` on stdin; it inherits `fds` and the write end of `status`.

    It gets a session of its own, so that Ctrl-C in the terminal reaches the launcher only. The caller closes its
    copies of `fds`; the write end of `status` is closed here.
    """
    stderr = tempfile.TemporaryFile(prefix="push-")  # noqa: SIM115 - the Child closes it
    process = subprocess.Popen(
        [sys.executable, "-m", module],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=stderr,
        pass_fds=[*fds, status[1]],
        start_new_session=True,
    )
    os.close(status[1])
    assert process.stdin is not None
    with contextlib.suppress(BrokenPipeError):  # it died at once; its exit is seen soon enough
        process.stdin.write(msgspec.json.encode(job))
        process.stdin.close()
    return Child(name, process, status[0], stderr)
