"""Rows that reduce no command: whole runs in lockstep, each judged by a check of its own (F13, F62, F71)."""

from __future__ import annotations

import contextlib
import gc
import hashlib
import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from robot_io.clock import NS_PER_S
from robot_io.tick import ControlTick
from tools.faults.judgement import Proof
from tools.faults.lockstep_round import SETTINGS
from tools.rig import resolve_rig, with_faults
from tools.run.lockstep import Lockstep, LockstepLog

LAG_S = 0.05
JUMP_S = 3600.0
HOUR_S = 3600.0
USUAL_SHARE = 0.25
"""Of the hour, until what is kept for ever has been made."""
GROWTH_KB = 2048
"""No more than the allocator's own scatter."""


class _Digest:
    """A log that keeps a digest of everything it is given."""

    def __init__(self) -> None:
        self._hash = hashlib.sha256()

    def record(self, kind: int, time_ns: int, payload: bytes) -> None:
        """Take in a record."""
        self._hash.update(b"%d %d" % (kind, time_ns) + payload)

    def tick(self, time_ns: int, payload: bytes, tick: ControlTick | None) -> None:
        """Take in a tick."""
        del tick
        self._hash.update(b"%d" % time_ns + payload)

    @property
    def digest(self) -> str:
        """Return the digest so far."""
        return self._hash.hexdigest()


def prove_whole_run(row: str) -> Proof:
    """Return what came of a row's own check."""
    what, check = CHECKS[row]
    why = check()
    return Proof(row, what, "sim", None, 0, not why, why)


def late_force() -> str:
    """Return what is wrong with a push whose force is 50 ms old although its times are fresh; "" for nothing."""
    ended = _run(None, (f"ft.delayed={LAG_S} at 0 s",))
    goal = resolve_rig("sim", SETTINGS).goal
    if ended["exit_code"] or ended["fault_counts"]:
        return f"exit code {ended['exit_code']}, {', '.join(ended['fault_counts']) or 'no fault'}"
    off_m = abs(ended["lateral_error_m"])
    return "" if off_m <= goal.end_tolerance_m else f"it ended {off_m:.3f} m off the line"


def wall_clock_jumps() -> str:
    """Return what differs in a push while the wall clock jumps an hour on and back at each look; "" for nothing."""
    usual, jumped = _Digest(), _Digest()
    _run(usual)
    with _jumping():
        _run(jumped)
    return "" if usual.digest == jumped.digest else "ticks and records differ from those of a steady clock"


def an_hour() -> str:
    """Return what grows over an hour of pushes, one after the other, on the virtual clock; "" for nothing."""
    gone_s, early = 0.0, None
    while gone_s < HOUR_S:
        ended = _run(None)
        gone_s += ended["loop"]["ticks"] / ended["loop"]["rate_hz"]
        if early is None and gone_s >= USUAL_SHARE * HOUR_S:
            early = _kept()
    if early is None:
        return "there was no run"
    memory_kb, files = (late - before for late, before in zip(_kept(), early, strict=True))
    if files:
        return f"{files} descriptors more are open"
    return "" if memory_kb <= GROWTH_KB else f"it has grown by {memory_kb} kB"


CHECKS: dict[str, tuple[str, Callable[[], str]]] = {
    "F13": ("the force is 50 ms late, its times are not", late_force),
    "F62": ("the wall clock jumps by an hour", wall_clock_jumps),
    "F71": ("an hour of pushes: memory and descriptors", an_hour),
}


def _run(log: LockstepLog | None, words: tuple[str, ...] = ()) -> dict[str, Any]:
    return Lockstep(with_faults(resolve_rig("sim", SETTINGS), words), 0, log).run(lambda *_: None)


@contextlib.contextmanager
def _jumping() -> Iterator[None]:
    """Let the wall clock of this process be an hour ahead and behind in turn."""
    seconds, nanoseconds, looks = time.time, time.time_ns, 0

    def jump_s() -> float:
        nonlocal looks
        looks += 1
        return JUMP_S if looks % 2 else -JUMP_S

    time.time = lambda: seconds() + jump_s()
    time.time_ns = lambda: nanoseconds() + round(jump_s() * NS_PER_S)
    try:
        yield
    finally:
        time.time, time.time_ns = seconds, nanoseconds


def _kept() -> tuple[int, int]:
    """Return the memory in use (kB) and how many descriptors are open."""
    gc.collect()
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") // 1024, len(list(Path("/proc/self/fd").iterdir()))
