"""When the host of a virtual machine took processor time: /proc/stat, read all along while something is measured.

`steal` counts ticks of 10 ms, of all processors together and of each. The kernel adds up whatever the host takes,
however short, and shows a tick when the sum has become whole. So a tick tells of what was taken before it, and comes
late: by the kernel's own timer, at which a processor takes account (up to 10 ms), and by our next reading. A piece of
10 ms always shows; shorter ones show when one of them fills a tick up. The window of a tick therefore reaches back from
the reading that shows it, and only back:

- to the reading before, as the sum became whole somewhere in between;
- by 10 ms for each tick that it grew by: so long was what was taken itself;
- by `BEFORE_NS` more. A host that gives a machine a share of its processors takes the rest at the ends of periods of
  100 ms (Linux: cpu.cfs_period_us), so what filled the tick up is seldom alone in its period.

A reading is dated by the clock before it where a window begins, and after it where one ends: a sampler that was itself
held up makes a window longer, never shorter. The lines of the single processors show more than their sum, as each
becomes whole at a moment of its own. A window is far longer than a period, so it prefers no part of a tick.

What stays hidden is less than 10 ms of a processor between two of its ticks. It makes wake-ups late that are kept, and
never one early (docs/realtime.md says how much it was on one machine).

`python -m tools.bench.clock.stolen` is the process of the sampler: until stdin ends; what it found on stdout, as JSON.
"""

from __future__ import annotations

import contextlib
import os
import select
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import IO, NamedTuple

import msgspec

from robot_io.clock import NS_PER_MS, NS_PER_S, monotonic_ns
from robot_io.errors import EnvironmentFault
from robot_io.ipc.process import die_with_parent, fresh_interpreter

SAMPLE_S = 0.05
"""Between two readings, at normal priority. All of them together took 0.4 % of one processor."""
ENDS_WITHIN_S = 10.0
BEFORE_NS = 100 * NS_PER_MS
TICK_NS = NS_PER_S // os.sysconf("SC_CLK_TCK")
"""10 ms on every Linux of today."""
STAT = Path("/proc/stat")
_READ_BYTES = 65_536
_STEAL = 8
"""Place of `steal` in a line of /proc/stat (proc(5))."""


class Window(NamedTuple):
    """A span of CLOCK_MONOTONIC in which the host took time, both ends included."""

    from_ns: int
    to_ns: int


class Reading(NamedTuple):
    """What the counters said between two readings of CLOCK_MONOTONIC: of all processors, then of each."""

    before_ns: int
    after_ns: int
    ticks: tuple[int, ...]


def steal_ticks(stat: str | None = None) -> int:
    """Return how many clock ticks the host has taken from this machine so far."""
    return steal_of_lines(STAT.read_text() if stat is None else stat)[0]


def steal_of_lines(stat: str) -> tuple[int, ...]:
    """Return the ticks of the lines cpu, cpu0, cpu1, ... of /proc/stat; 0 from a kernel that does not count them."""
    words = [line.split() for line in stat.splitlines() if line.startswith("cpu")]
    return tuple(int(one[_STEAL]) if len(one) > _STEAL else 0 for one in words)


def read_now(file: IO[bytes]) -> Reading:
    """Read the counters from /proc/stat, open and unbuffered. Raises OSError."""
    before_ns = monotonic_ns()
    file.seek(0)
    stat = file.read(_READ_BYTES)
    return Reading(before_ns, monotonic_ns(), steal_of_lines(stat.partition(b"intr")[0].decode()))


def window_between(last: Reading, this: Reading) -> Window | None:
    """Return the window of what has grown between two readings; none if nothing has, as the module says."""
    grown = [now - then for then, now in zip(last.ticks, this.ticks, strict=False)]
    most = max(grown, default=0)
    if most <= 0:
        return None
    return Window(last.before_ns - most * TICK_NS - BEFORE_NS, this.after_ns)


def joined(windows: Iterable[Window]) -> list[Window]:
    """Return windows that cover the same without overlapping, in ascending order."""
    found: list[Window] = []
    for window in sorted(windows):
        if found and window.from_ns <= found[-1].to_ns:
            found[-1] = Window(found[-1].from_ns, max(found[-1].to_ns, window.to_ns))
        else:
            found.append(window)
    return found


@contextlib.contextmanager
def watching() -> Iterator[list[Window]]:
    """Yield a list that holds all windows once the block has ended. Raises EnvironmentFault when the sampler fails."""
    found: list[Window] = []
    command, environment = fresh_interpreter("tools.bench.clock.stolen")
    with subprocess.Popen(
        command, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as sampler:
        try:
            assert sampler.stdout is not None
            began = sampler.stdout.readline()
            if began:
                yield found
            said, errors = sampler.communicate(timeout=ENDS_WITHIN_S)
        except BaseException:
            sampler.kill()
            raise
    if sampler.returncode or not began:
        raise EnvironmentFault(
            f"the sampler of stolen time failed: {errors.decode(errors='replace').strip()[-200:]}",
            where="push bench loop",
        )
    found += msgspec.json.decode(said, type=list[Window])


def sample(last: Reading, read: Callable[[], Reading], wait: Callable[[], bool]) -> list[Window]:
    """Return the windows of all that grows from `last` on, until `wait` has returned True, and once more after it.

    wait: lasts `SAMPLE_S`; returns whether it is the end. What shows late is waited for in this way.
    """
    found: list[Window] = []
    ending, ended = False, False
    while not ended:
        ended, ending = ending, wait() or ending
        this = read()
        window = window_between(last, this)
        if window is not None:
            found.append(window)
        last = this
    return found


def main() -> int:
    """Sample until stdin ends; say a line when it has begun, and all windows at the end."""
    die_with_parent()

    def wait() -> bool:
        time.sleep(SAMPLE_S)
        return bool(select.select([sys.stdin], [], [], 0.0)[0])

    with STAT.open("rb", buffering=0) as file:
        first = read_now(file)
        sys.stdout.buffer.write(b"begun\n")
        sys.stdout.buffer.flush()
        found = sample(first, partial(read_now, file), wait)
    sys.stdout.buffer.write(msgspec.json.encode(found))
    return 0


if __name__ == "__main__":
    sys.exit(main())
