"""Rounds: every column once, in turn, so that what the machine does meanwhile meets them alike."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager

import msgspec

from robot_io.clock import NS_PER_MS
from tools.bench.clock.stolen import TICK_NS, Window, steal_ticks, watching
from tools.bench.clock.wakeups import Wakeups

WANTED = 3
MOST = 6
STEAL_TICKS = 1
"""A column without times is kept when the host took no more than this from all processors together, all along it."""

Column = Callable[[], Wakeups]
Watch = Callable[[], AbstractContextManager[Sequence[Window]]]


class Rounds(msgspec.Struct, frozen=True):
    """The rounds of one rate that were kept, by column, and how many were run."""

    kept: Mapping[str, Sequence[Wakeups]]
    run: int
    kept_shares: Mapping[str, float] = {}
    """Of each column, the mean share of wake-ups that the host left alone, 0..1: over all rounds that were run."""

    @property
    def count(self) -> int:
        """Return how many were kept."""
        return min(len(rounds) for rounds in self.kept.values())

    @property
    def too_noisy(self) -> bool:
        """Return whether too few were kept to compare anything."""
        return self.count < WANTED


def run_rounds(
    columns: Mapping[str, Column],
    deadline_s: float,
    *,
    steal: Callable[[], int] = steal_ticks,
    watch: Watch = watching,
    clock: Callable[[], float] = time.monotonic,
    say: Callable[[str], None] = lambda _text: None,
) -> Rounds:
    """Run rounds until three were kept, six were run, or another would not end before `deadline_s` (of `clock`).

    A round is kept when each of its columns is (`Wakeups.enough`; without times, `STEAL_TICKS`).
    """
    kept: dict[str, list[Wakeups]] = {name: [] for name in columns}
    shares: dict[str, list[float]] = {name: [] for name in columns}
    done, took_s = 0, 0.0
    while done < MOST and min(map(len, kept.values())) < WANTED and clock() + took_s <= deadline_s:
        began_s = clock()
        found, ticks = _one_round(columns, steal, watch)
        took_s = clock() - began_s
        done += 1
        faults = [fault for name in columns if (fault := _fault(name, found[name], ticks[name]))]
        of_round = {name: _share(found[name], ticks[name]) for name in columns}
        told = ", ".join(f"{name} {share:.0%}" for name, share in of_round.items())
        say(f"round {done}: {'dropped, ' + '; '.join(faults) if faults else 'kept'} (left alone: {told})")
        for name, wakeups in found.items():
            shares[name].append(of_round[name])
            if not faults:
                kept[name].append(wakeups)
    return Rounds(kept, done, {name: sum(all_of) / max(1, done) for name, all_of in shares.items()})


def _one_round(
    columns: Mapping[str, Column], steal: Callable[[], int], watch: Watch
) -> tuple[dict[str, Wakeups], dict[str, int]]:
    """Return what each column gave without stolen time, and the ticks that the host took while it ran."""
    found: dict[str, Wakeups] = {}
    ticks: dict[str, int] = {}
    with watch() as stolen:
        for name, measure in columns.items():
            before = steal()
            found[name] = measure()
            ticks[name] = steal() - before
    return {name: wakeups.without(stolen) for name, wakeups in found.items()}, ticks


def _fault(name: str, wakeups: Wakeups, ticks: int) -> str:
    """Return why a column does not count, "" if it does."""
    if wakeups.measured:
        return "" if wakeups.enough else f"{name} kept {len(wakeups.late_us)} of {wakeups.measured} wake-ups"
    return f"the host took {ticks * TICK_NS // NS_PER_MS} ms of {name}" if ticks > STEAL_TICKS else ""


def _share(wakeups: Wakeups, ticks: int) -> float:
    """Return the share of a column's wake-ups that is kept: all or none where their times are not known."""
    return wakeups.kept_share if wakeups.measured else float(ticks <= STEAL_TICKS)
