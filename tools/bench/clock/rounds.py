"""Rounds: every column once, in turn, so that what the machine does meanwhile meets them alike."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import msgspec

from tools.bench.clock.wakeups import Wakeups

WANTED = 3
MOST = 6
STEAL_TICKS = 1
"""A round is kept when the host took no more than this from all processors together (ticks of 10 ms in /proc/stat)."""
_STEAL = 8
"""Place of `steal` in the first line of /proc/stat (proc(5))."""

Column = Callable[[], Wakeups]


class Rounds(msgspec.Struct, frozen=True):
    """The rounds of one rate that were kept, by column, and how many were run."""

    kept: Mapping[str, Sequence[Wakeups]]
    run: int

    @property
    def count(self) -> int:
        """Return how many were kept."""
        return min(len(rounds) for rounds in self.kept.values())

    @property
    def too_noisy(self) -> bool:
        """Return whether too few were kept to compare anything."""
        return self.count < WANTED


def steal_ticks(stat: str | None = None) -> int:
    """Return how many clock ticks the host has taken from this machine so far."""
    first = (Path("/proc/stat").read_text() if stat is None else stat).splitlines()[0].split()
    return int(first[_STEAL]) if len(first) > _STEAL else 0


def run_rounds(
    columns: Mapping[str, Column],
    deadline_s: float,
    *,
    steal: Callable[[], int] = steal_ticks,
    clock: Callable[[], float] = time.monotonic,
    say: Callable[[str], None] = lambda _text: None,
) -> Rounds:
    """Run rounds until three were kept, six were run, or another would not end before `deadline_s` (of `clock`)."""
    kept: dict[str, list[Wakeups]] = {name: [] for name in columns}
    done, took_s = 0, 0.0
    while done < MOST and min(map(len, kept.values())) < WANTED and clock() + took_s <= deadline_s:
        began_s, stolen = clock(), steal()
        found = {name: measure() for name, measure in columns.items()}
        took_s, stolen = clock() - began_s, steal() - stolen
        done += 1
        if stolen > STEAL_TICKS:
            say(f"round {done}: dropped, the host took {stolen * 1000 // os.sysconf('SC_CLK_TCK')} ms")
            continue
        say(f"round {done}: kept")
        for name, wakeups in found.items():
            kept[name].append(wakeups)
    return Rounds(kept, done)
