"""One stage for each fault of a stream: it changes what passes (`Values`), or when it passes (`Flow`)."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Generic, Protocol, TypeVar

from robot_io.clock import NS_PER_S
from robot_io.rig.fault_words import FaultWord

T = TypeVar("T")
FLOW_KINDS = ("off", "slow", "delayed", "intermittent")


class Progress:
    """How far a fault has got: since when it counts, and how many samples it has changed; tells of the first."""

    def __init__(self, word: FaultWord, on_first: Callable[[FaultWord, int], None]) -> None:
        self.word = word
        self.begin_ns: int | None = None
        """When the first tick was; None: not yet."""
        self.changed = 0
        self._on_first = on_first

    def elapsed_s(self, at_ns: int) -> float:
        """Return the time since the first tick; before it a negative number."""
        return -1.0 if self.begin_ns is None else (at_ns - self.begin_ns) / NS_PER_S

    def active(self, at_ns: int) -> bool:
        """Return whether the fault is present."""
        return self.word.active(self.elapsed_s(at_ns))

    def count(self, at_ns: int) -> None:
        """Count one changed sample."""
        self.changed += 1
        if self.changed == 1:
            self._on_first(self.word, at_ns)


class Stage(Protocol[T]):
    """Takes what arrived by now and returns what arrives under the fault, oldest first."""

    def take(self, items: tuple[T, ...], now_ns: int) -> tuple[T, ...]:
        """Return what arrives."""
        ...


class Values(Generic[T]):
    """Changes items: `change(item, first item under the fault, s since the fault began)`; `when` an item arrived."""

    def __init__(self, progress: Progress, change: Callable[[T, T, float], T], when: Callable[[T, int], int]) -> None:
        self._progress = progress
        self._change = change
        self._when = when
        self._first: T | None = None

    def take(self, items: tuple[T, ...], now_ns: int) -> tuple[T, ...]:
        """Return the items, changed while the fault is present."""
        return tuple(self._changed(item, self._when(item, now_ns)) for item in items)

    def _changed(self, item: T, at_ns: int) -> T:
        if not self._progress.active(at_ns):
            return item
        if self._first is None:
            self._first = item
        since_s = self._progress.elapsed_s(at_ns) - self._progress.word.at_s
        changed = self._change(item, self._first, since_s)
        if changed != item:
            self._progress.count(at_ns)
        return changed


class Flow(Generic[T]):
    """Passes, drops or holds back items; `late(item, ns)` returns an item with a later arrival."""

    def __init__(self, progress: Progress, late: Callable[[T, int], T], when: Callable[[T, int], int]) -> None:
        self._progress = progress
        self._late = late
        self._when = when
        self._held: deque[tuple[int, T]] = deque()
        self._next_ns = 0

    def take(self, items: tuple[T, ...], now_ns: int) -> tuple[T, ...]:
        """Return what arrives now: of `items`, and of what was held back before."""
        passed: list[T] = []
        for item in items:
            at_ns = self._when(item, now_ns)
            if not self._progress.active(at_ns):
                passed += self._release(None)  # whatever is held back was earlier
                passed.append(item)
            elif self._progress.word.kind == "delayed":
                by_ns = round(self._progress.word.value[0] * NS_PER_S)
                self._held.append((at_ns + by_ns, self._late(item, by_ns)))
                self._progress.count(at_ns)
            elif self._passes(at_ns):
                passed.append(item)
            else:
                self._progress.count(at_ns)
        return (*passed, *self._release(now_ns))

    def _release(self, until_ns: int | None) -> list[T]:
        due = []
        while self._held and (until_ns is None or self._held[0][0] <= until_ns):
            due.append(self._held.popleft()[1])
        return due

    def _passes(self, at_ns: int) -> bool:
        word = self._progress.word
        if word.kind == "off":
            return False
        if word.kind == "intermittent":
            period_ns = round(word.value[0] * NS_PER_S)
            since_ns = round((self._progress.elapsed_s(at_ns) - word.at_s) * NS_PER_S)
            return since_ns % period_ns >= period_ns / 2
        if at_ns < self._next_ns:
            return False
        period_ns = round(NS_PER_S / word.value[0])
        # By a clock, not from the last one: or jitter of the samples would make it slower than asked.
        due_ns = self._next_ns if at_ns - self._next_ns < period_ns else at_ns
        self._next_ns = due_ns + period_ns
        return True


def through(stages: list[Stage[T]], items: tuple[T, ...], now_ns: int) -> tuple[T, ...]:
    """Return what is left of items after all stages, in their order."""
    for stage in stages:
        items = stage.take(items, now_ns)
    return items
