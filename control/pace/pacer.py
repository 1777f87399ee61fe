"""Pure pacing: absolute deadlines on a fixed grid; missed periods are skipped and counted, never made up for."""

from __future__ import annotations

from collections.abc import Callable

import msgspec


class Wake(msgspec.Struct, frozen=True, gc=False):
    """One wake-up: its deadline, lateness (ns), skipped periods, and the next deadline."""

    deadline_ns: int
    late_ns: int
    skipped: int
    next_deadline_ns: int


def wake(deadline_ns: int, period_ns: int, now_ns: int) -> Wake:
    """Evaluate a wake-up at `now_ns` for `deadline_ns`.

    Skips every full period that has passed and keeps the phase of the grid: the tick that runs now belongs
    to the latest deadline not after `now_ns`.
    """
    skipped = max(0, (now_ns - deadline_ns) // period_ns)
    served_ns = deadline_ns + skipped * period_ns
    return Wake(served_ns, now_ns - served_ns, skipped, served_ns + period_ns)


def spin_until(deadline_ns: int, clock: Callable[[], int]) -> int:
    """Wait awake until `deadline_ns` and return the time; at once when it is past."""
    now_ns = clock()
    while now_ns < deadline_ns:
        now_ns = clock()
    return now_ns
