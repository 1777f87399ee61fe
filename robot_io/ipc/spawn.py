"""Child processes: fresh interpreters, a job on stdin, JSON lines back."""

from __future__ import annotations

import contextlib
import os
import select
import signal
import subprocess
import tempfile
import time
from typing import IO, Any

import msgspec
from msgspec.structs import replace

from robot_io.errors import PushError
from robot_io.ipc.process import fresh_interpreter
from robot_io.ipc.status import StatusReader, error_of

MOST_STDERR_BYTES = 65_536
"""Bytes of a process's stderr that are looked at: its end."""


class Child:
    """One process of the run and what it has said."""

    def __init__(self, name: str, process: subprocess.Popen[bytes], status_fd: int, stderr: IO[bytes]) -> None:
        self.name = name
        self.process = process
        self.status = StatusReader(status_fd)
        self.ready: dict[str, Any] | None = None
        self.finished: dict[str, Any] | None = None
        self.errors: list[PushError] = []
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
                self.errors.append(error_of(event))
        return events

    def wait_ready(self, within_s: float) -> bool:
        """Wait until it is ready, reports an error, ends, or the time is over; return whether it is ready."""
        deadline_s = time.monotonic() + within_s
        poll = select.poll()
        poll.register(self.status.fd, select.POLLIN)
        while self.status.open:
            self.hear()
            left_s = deadline_s - time.monotonic()
            if self.ready is not None or self.errors or left_s <= 0:
                break
            poll.poll(left_s * 1000)
        return self.ready is not None

    def last_stderr_line(self) -> str:
        """Return the last line it wrote on stderr, "" when there is none."""
        lines = self._words().decode(errors="replace").strip().splitlines()
        return lines[-1] if lines else ""

    def save_stderr(self) -> str:
        """Keep what it wrote on stderr (a traceback) in a file of its own; return the file's name."""
        with tempfile.NamedTemporaryFile(prefix=f"push-{self.name}-", suffix=".txt", delete=False) as file:
            file.write(self._words())
        return file.name

    def _words(self) -> bytes:
        """Return the end of what it wrote on stderr; the file's position, which it shares with us, stays."""
        size = os.fstat(self._stderr.fileno()).st_size
        return os.pread(self._stderr.fileno(), MOST_STDERR_BYTES, max(0, size - MOST_STDERR_BYTES))

    def how_it_ended(self) -> str:
        """Return how the process ended, in words."""
        code = self.process.returncode
        if code is not None and code < 0:
            return f"was killed by {signal.Signals(-code).name}"
        words = self.last_stderr_line()
        return f"ended with code {code}" + (f" ({words})" if words else "")

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

    def stop(self, within_s: float) -> int:
        """Ask it to end, and kill it when it has not within `within_s`; return its exit code. Idempotent."""
        if self.process.poll() is None:
            self.terminate()
            self.process.send_signal(signal.SIGCONT)  # a stopped process acts on SIGTERM only when it continues
            self.end(within_s)
        return self.process.returncode

    def close(self) -> None:
        """Close our descriptors of it."""
        self.status.close()
        self._stderr.close()


def spawn(name: str, module: str, job: msgspec.Struct, fds: list[int]) -> Child:
    """Start `python -m module` with `job` on stdin; it inherits `fds`, and a pipe to report on as `job.status_fd`.

    It gets a session of its own, so that Ctrl-C and Ctrl-Z in the terminal reach the caller only. The caller closes
    its copies of `fds`.
    """
    listen_fd, status_fd = os.pipe()
    stderr = tempfile.TemporaryFile(prefix="push-")  # noqa: SIM115 - the Child closes it
    command, environment = fresh_interpreter(module)
    process = subprocess.Popen(
        command,
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=stderr,
        pass_fds=[*fds, status_fd],
        start_new_session=True,
    )
    os.close(status_fd)
    assert process.stdin is not None
    with contextlib.suppress(BrokenPipeError):  # it died at once; its exit is seen soon enough
        process.stdin.write(msgspec.json.encode(replace(job, status_fd=status_fd)))
        process.stdin.close()
    return Child(name, process, listen_fd, stderr)
