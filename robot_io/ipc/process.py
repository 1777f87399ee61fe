"""How a process of ours is started, and what it does first: die with its parent, wake up on time, ask for its priority.

Linux only: prctl(2) PR_SET_PDEATHSIG and PR_SET_TIMERSLACK, sched_setscheduler(2).
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import resource
import select
import signal
import sys
from collections.abc import Iterator
from pathlib import Path

_PR_SET_PDEATHSIG = 1
_PR_SET_TIMERSLACK = 29
_MCL_CURRENT, _MCL_FUTURE = 1, 2

_libc = ctypes.CDLL(None, use_errno=True)


def fresh_interpreter(module: str) -> tuple[list[str], dict[str, str]]:
    """Return command line and environment that run `python -m module` of this program, whatever folder we are in.

    The current folder is kept off the path (-P), for it may hold a `tools` or a `control` of its own; ours come first.
    """
    root = str(Path(__file__).resolve().parents[2])
    others = [entry for entry in os.environ.get("PYTHONPATH", "").split(os.pathsep) if entry and entry != root]
    return [sys.executable, "-P", "-m", module], {**os.environ, "PYTHONPATH": os.pathsep.join([root, *others])}


def die_with_parent(parent_pid: int = 0, with_signal: signal.Signals = signal.SIGKILL) -> None:
    """Have the kernel send this process `with_signal` when the process (the thread of it) that started it dies.

    A parent that died before this call is noticed too, by getppid(2): exits at once, code 1. Give `parent_pid`
    (the starter's own pid, handed over by it) to be exact; without it, only a parent of pid 1 counts as gone.
    """
    _libc.prctl(_PR_SET_PDEATHSIG, int(with_signal), 0, 0, 0)
    now = os.getppid()
    if (parent_pid and now != parent_pid) or (not parent_pid and now == 1):
        os._exit(1)


def is_hung_up(read_fd: int) -> bool:
    """Return whether a pipe has no writer any more; False for -1. Never blocks, reads nothing."""
    if read_fd < 0:
        return False
    poll = select.poll()
    poll.register(read_fd, 0)  # hang-ups are reported unasked
    return bool(poll.poll(0))


def set_timer_slack_1ns() -> None:
    """Let timers of this thread fire on time: the default slack lets the kernel delay them by 50 us."""
    _libc.prctl(_PR_SET_TIMERSLACK, 1, 0, 0, 0)


def lock_memory() -> bool:
    """Keep all memory of this process, now and later, in RAM: a page fault in the loop can wait for a disk.

    mlockall(2); False when the system does not allow it. Call it after the imports and before the loop.
    """
    return int(_libc.mlockall(_MCL_CURRENT | _MCL_FUTURE)) == 0


def try_realtime(priority: int) -> bool:
    """Run this thread under SCHED_FIFO at `priority` (1..99); False when the system does not allow it.

    SCHED_RESET_ON_FORK: processes and threads started afterwards run at normal priority.
    """
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(priority))
    except OSError:
        return False
    return True


@contextlib.contextmanager
def starting_threads_at(priority: int) -> Iterator[None]:
    """Let the threads that a library starts in here run under SCHED_FIFO at `priority`, where the system allows it.

    They inherit it; this thread has it only meanwhile.
    """
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except OSError:
        yield
        return
    try:
        yield
    finally:
        leave_realtime()


def leave_realtime() -> None:
    """Go back to normal scheduling; nothing happens where `try_realtime` was refused."""
    with contextlib.suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_OTHER | os.SCHED_RESET_ON_FORK, os.sched_param(0))


def forbid_new_descriptors() -> None:
    """Let the kernel refuse every new file or socket of this process from now on; open ones keep working.

    For a process with a library in it that would connect again unasked. Needs descriptors 0, 1 and 2 open: they
    fill the numbers that stay allowed (poll(2) needs the limit to be no smaller than what it is given).
    """
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (3, hard))
