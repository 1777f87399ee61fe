"""Clocks: monotonic nanoseconds inside, wall clock only at the edge.

All times in the program are `CLOCK_MONOTONIC` nanoseconds as `int` (the same clock in every process of a
machine). A run fixes one offset to the wall clock at its start, so that log times never step.
"""

from __future__ import annotations

import time
from collections.abc import Callable

NS_PER_S = 1_000_000_000
NS_PER_MS = 1_000_000

ClockNs = Callable[[], int]

BRACKET_NS = NS_PER_MS
"""A reading of two clocks that took longer says too little ..."""
BRACKET_TRIES = 5
"""... and is repeated this often."""

SIM_EPOCH_NS = 1_600_000_000 * NS_PER_S
"""Log time of tick 0 at level `sim` (a fixed instant, so that two runs give identical files)."""
SIM_START_NS = NS_PER_S
"""Virtual time of tick 0 at level `sim`."""
SIM_WALL_OFFSET_NS = SIM_EPOCH_NS - SIM_START_NS
"""Wall clock minus virtual clock at level `sim`."""


def monotonic_ns() -> int:
    """Return CLOCK_MONOTONIC in ns."""
    return time.monotonic_ns()


def wall_offset_ns() -> int:
    """Return wall clock minus monotonic clock in ns, measured between two reads of the monotonic clock."""
    before = time.monotonic_ns()
    wall = time.time_ns()
    after = time.monotonic_ns()
    return wall - (before + after) // 2


def asleep_ns() -> int | None:
    """Return how far CLOCK_BOOTTIME is ahead of CLOCK_MONOTONIC in ns: it grows only while this machine is suspended.

    None where it could not be read within BRACKET_NS, because this process was paused in between, over and over.
    """
    for _ in range(BRACKET_TRIES):
        before = time.monotonic_ns()
        boot = time.clock_gettime_ns(time.CLOCK_BOOTTIME)
        after = time.monotonic_ns()
        if after - before <= BRACKET_NS:
            return boot - (before + after) // 2
    return None


class VirtualClock:
    """A clock that only moves when told to: ns, starting at `start_ns`."""

    def __init__(self, start_ns: int = 0) -> None:
        self._now_ns = start_ns

    def __call__(self) -> int:
        """Return the virtual time in ns."""
        return self._now_ns

    def advance_to(self, now_ns: int) -> None:
        """Move to `now_ns`; going back raises ValueError."""
        if now_ns < self._now_ns:
            raise ValueError(f"a virtual clock cannot go back: {now_ns} < {self._now_ns}")
        self._now_ns = now_ns
