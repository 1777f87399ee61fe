"""Which runs of this user are under way, for `push stop` and `push watch`: a file for each, which names its processes.

A process id is used again after its process has ended, so each is kept, and checked, with the time it started.
"""

from __future__ import annotations

import contextlib
import os
import signal
from collections.abc import Iterator
from pathlib import Path

import msgspec

from robot_io.errors import EnvironmentFault
from robot_io.rig.config import RigConfig
from tools.places.atomic_file import write_atomically
from tools.places.device_locks import resources_of
from tools.places.state_dir import state_dir

_START_TIME = 19
"""Where /proc/PID/stat has the start time, counted behind the name (proc(5): field 22)."""


class Process(msgspec.Struct, frozen=True):
    """A process and when it started, in clock ticks since the machine booted."""

    pid: int
    started: int

    def alive(self) -> bool:
        """Return whether this process, and not a later one of the same id, still runs."""
        return start_time(self.pid) == self.started

    def signal(self, number: signal.Signals) -> None:
        """Send it a signal; nothing happens when it has ended, also where its id is already another's."""
        with contextlib.suppress(OSError):
            pidfd = os.pidfd_open(self.pid)
            try:
                if self.alive():  # looked at after the pidfd was opened, which now can only mean this one
                    signal.pidfd_send_signal(pidfd, number)
            finally:
                os.close(pidfd)


class RunningRun(msgspec.Struct, frozen=True):
    """A run under way: its rig, the real devices that it holds, its processes by name, and its log."""

    rig: str
    devices: tuple[str, ...]
    processes: dict[str, Process]
    log: str = ""

    def alive(self) -> list[str]:
        """Return the names of its processes that still run."""
        return [name for name, process in self.processes.items() if process.alive()]


def start_time(pid: int) -> int | None:
    """Return when a process started (clock ticks since boot), None when there is none or it is a zombie."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return None
    return None if fields[0] == "Z" else int(fields[_START_TIME])


def announce(rig: RigConfig, pids: dict[str, int], log: Path) -> None:
    """Write down the processes of this process's run, and its log. Raises OSError and EnvironmentFault."""
    processes = {name: Process(pid, started) for name, pid in pids.items() if (started := start_time(pid)) is not None}
    keys = tuple(resource.key for resource in resources_of(rig))
    run = RunningRun(rig.name, keys, processes, str(log.resolve()))
    _folder().mkdir(mode=0o700, exist_ok=True)
    write_atomically(_folder() / f"{os.getpid()}.json", msgspec.json.encode(run), mode=0o600)


def forget() -> None:
    """Remove what `announce` wrote."""
    (_folder() / f"{os.getpid()}.json").unlink(missing_ok=True)


@contextlib.contextmanager
def announced(rig: RigConfig, log: Path) -> Iterator[None]:
    """Have the run of this process alone, at level sim, written down; where that fails, it is only not found."""
    with contextlib.suppress(OSError, EnvironmentFault):
        announce(rig, {"launcher": os.getpid()}, log)
    try:
        yield
    finally:
        with contextlib.suppress(OSError, EnvironmentFault):
            forget()


def running_runs() -> list[RunningRun]:
    """Return every run of this user of which a process still runs; files of others, left by a kill, are removed."""
    found = []
    for path in sorted(_folder().glob("*.json")):
        try:
            run = msgspec.json.decode(path.read_bytes(), type=RunningRun)
        except (OSError, msgspec.MsgspecError):
            continue
        if run.alive():
            found.append(run)
        else:
            path.unlink(missing_ok=True)
    return found


def _folder() -> Path:
    return state_dir() / "running"
