"""How late wake-ups came: percentiles of one measurement, what of it the host left alone, and the best of several."""

from __future__ import annotations

import bisect
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import msgspec

from tools.bench.clock.stolen import Window, joined

KEPT_SHARE = 0.5
KEPT_LEAST = 100
"""So many wake-ups at least, or all where there were fewer: of 100, the 99th percentile is the second latest."""


class Tick(NamedTuple):
    """One wake-up as a loop notes it: when it woke up (ns), how late, and how many periods were skipped before it."""

    woken_ns: int
    late_ns: int
    skipped: int


class Span(NamedTuple):
    """From the deadline of a wake-up, or of the first period that was skipped before it, to the wake-up (ns)."""

    due_ns: int
    woken_ns: int
    skipped: int


class Wakeups(msgspec.Struct, frozen=True):
    """One measurement of one column. Times in us after the deadline."""

    late_us: tuple[float, ...]
    """In ascending order."""
    skipped: int = 0
    facts: Mapping[str, Any] = {}
    """What else a complete run says of its loop."""
    spans: tuple[Span, ...] = ()
    """When each of `late_us` was (CLOCK_MONOTONIC); empty where that is not known."""
    skipped_stolen: int = 0
    """Periods skipped in wake-ups that were left out; not in `skipped`."""
    measured: int = 0
    """How many wake-ups there were before some were left out; 0: none were."""

    @property
    def kept_share(self) -> float:
        """Return the share of wake-ups that was kept, 0..1."""
        return len(self.late_us) / self.measured if self.measured else 1.0

    @property
    def enough(self) -> bool:
        """Return whether so many were kept that they stand for the measurement."""
        return self.kept_share >= KEPT_SHARE and len(self.late_us) >= min(KEPT_LEAST, self.measured)

    def without(self, stolen: Iterable[Window]) -> Wakeups:
        """Return the wake-ups of which no part lies in a window, and all where their times are not known."""
        if not self.spans:
            return self
        windows = joined(stolen)
        ends = [window.to_ns for window in windows]

        def left_alone(span: Span) -> bool:
            at = bisect.bisect_left(ends, span.due_ns)
            return at == len(windows) or windows[at].from_ns > span.woken_ns

        kept = [one for one in zip(self.late_us, self.spans, strict=True) if left_alone(one[1])]
        skipped_stolen = sum(span.skipped for span in self.spans) - sum(span.skipped for _, span in kept)
        return Wakeups(
            tuple(late_us for late_us, _ in kept),
            self.skipped - skipped_stolen,
            self.facts,
            tuple(span for _, span in kept),
            skipped_stolen,
            len(self.late_us),
        )

    @property
    def p50_us(self) -> float:
        """Return the median."""
        return self.percentile_us(50.0)

    @property
    def p99_us(self) -> float:
        """Return the time that 99 of 100 wake-ups keep."""
        return self.percentile_us(99.0)

    @property
    def max_us(self) -> float:
        """Return the latest wake-up."""
        return self.late_us[-1]

    def percentile_us(self, percent: float) -> float:
        """Return the smallest time that at least `percent` of the wake-ups keep (nearest rank)."""
        rank = math.ceil(percent / 100.0 * len(self.late_us))
        return self.late_us[max(rank, 1) - 1]


def timed(ticks: Iterable[Tick], period_ns: int, skipped: int, facts: Mapping[str, Any]) -> Wakeups:
    """Return wake-ups whose times are known. skipped: periods in all, those of `ticks` among them."""
    ordered = sorted(ticks, key=lambda one: one.late_ns)
    return Wakeups(
        tuple(one.late_ns * 1e-3 for one in ordered),
        skipped,
        facts,
        tuple(Span(one.woken_ns - one.late_ns - one.skipped * period_ns, one.woken_ns, one.skipped) for one in ordered),
    )


class Best(msgspec.Struct, frozen=True):
    """The best of a column's rounds, each time by itself: what disturbs a round only ever makes it later."""

    p50_us: float
    p99_us: float
    max_us: float
    skipped: int
    """Of all rounds together: no round makes up for what another skipped."""
    skipped_stolen: int
    """The same, of what was left out."""


def best_of(rounds: Sequence[Wakeups]) -> Best:
    """Return the smallest median, 99th percentile and worst of the rounds, and all the ticks they skipped."""
    return Best(
        min(one.p50_us for one in rounds),
        min(one.p99_us for one in rounds),
        min(one.max_us for one in rounds),
        sum(one.skipped for one in rounds),
        sum(one.skipped_stolen for one in rounds),
    )
