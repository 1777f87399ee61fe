"""Whether the host kept every processor running: small processes on each, at the highest priority and at a normal one.

A test on the wall clock that failed while a processor stood still for long says nothing of the program: it is
repeated, at most three times, and says so. Nothing else is ever repeated, and no bound is widened. What no attempt
could measure is named at the end of the tests as unmeasured; with `--measure-all`, as in `make test-all`, it fails.

    @repeated_when_the_host_stalls
    def test_something(state, tmp_path): ...
"""

from __future__ import annotations

import functools
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from typing import Any

import pytest

REPEATS = 3
WATCHER = """
import ctypes, os, signal, sys, time
ctypes.CDLL(None).prctl(1, int(signal.SIGKILL), 0, 0, 0)
if os.getppid() != int(sys.argv[3]):
    sys.exit()
os.sched_setaffinity(0, {int(sys.argv[1])})
if sys.argv[2] == "realtime":
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(99))
    except OSError:
        pass
last = time.monotonic_ns()
while True:
    time.sleep(0.002)
    now = time.monotonic_ns()
    if now - last > 8_000_000:
        os.write(1, b"%d %d\\n" % (last, now))
    last = now
"""


class HostStalled(Exception):
    """A run was spoilt by its host."""


class Unmeasured:
    """What the host kept the tests of this process from measuring since it was last taken, in words."""

    def __init__(self) -> None:
        self.fails = False
        """Set by `--measure-all`."""
        self._found: list[str] = []

    def add(self, what: str) -> None:
        """Report a bound that no attempt could measure; it fails the test where everything has to be measured."""
        assert not self.fails, f"{what}: not measured, the host stalled in each of {1 + REPEATS} attempts"
        self._found.append(what)

    def take(self) -> list[str]:
        """Return what was added, and forget it."""
        found, self._found = self._found, []
        return found


UNMEASURED = Unmeasured()


class HostWatch:
    """Watches until `close`."""

    def __init__(self) -> None:
        self._files = {kind: tempfile.NamedTemporaryFile("r") for kind in ("realtime", "normal")}  # noqa: SIM115 - closed in close()
        self._watchers = []
        for kind, file in self._files.items():
            with open(file.name, "ab") as out:  # noqa: PTH123 - appending, as every watcher does
                self._watchers += [
                    subprocess.Popen(
                        [sys.executable, "-c", WATCHER, str(cpu), kind, str(os.getpid())],
                        stdin=subprocess.DEVNULL,
                        stdout=out,
                    )
                    for cpu in sorted(os.sched_getaffinity(0))
                ]

    def worst_ms(self, since_ns: int, until_ns: int) -> float:
        """Return the longest time that a processor stood still, of the pauses that touch this span; 0 for none."""
        return self._worst_ms("realtime", since_ns, until_ns)

    def worst_wait_ms(self, since_ns: int, until_ns: int) -> float:
        """Return the longest time that a process of normal priority waited for its processor.

        The kernel moves the bytes of a pty in such a process, and the arm's client library has such threads.
        """
        return self._worst_ms("normal", since_ns, until_ns)

    def _worst_ms(self, kind: str, since_ns: int, until_ns: int) -> float:
        self._files[kind].seek(0)
        pauses = [tuple(map(int, line.split())) for line in self._files[kind].read().splitlines()]
        return max((b - a for a, b in pauses if b >= since_ns and a <= until_ns), default=0) / 1e6

    def close(self) -> None:
        for watcher in self._watchers:
            watcher.kill()
            watcher.wait()
        for file in self._files.values():
            file.close()


def repeated_when_the_host_stalls(test: Callable[..., None]) -> Callable[..., None]:
    """Repeat a test that ended in `HostStalled`; it gets a folder of its own each time as `tmp_path`.

    A test that is spoilt each time is skipped as unmeasured.
    """

    @functools.wraps(test)
    def repeat(*args: Any, tmp_path: Any, **kwargs: Any) -> None:
        for attempt in range(1 + REPEATS):
            folder = tmp_path / f"attempt{attempt}"
            folder.mkdir()
            try:
                test(*args, tmp_path=folder, **kwargs)
                return
            except HostStalled as stalled:
                print(f"{test.__name__}, attempt {attempt + 1}: {stalled}")
        UNMEASURED.add(test.__name__)
        pytest.skip(f"unmeasured: the host stalled in each of {1 + REPEATS} attempts")

    return repeat
