"""How late wake-ups came: percentiles of one measurement, and the best of several."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import msgspec


class Wakeups(msgspec.Struct, frozen=True):
    """One measurement of one column. Times in us after the deadline."""

    late_us: tuple[float, ...]
    """In ascending order."""
    skipped: int = 0
    facts: Mapping[str, Any] = {}
    """What else a complete run says of its loop."""

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


class Best(msgspec.Struct, frozen=True):
    """The best of a column's rounds, each figure by itself: what disturbs a round only ever makes it later."""

    p50_us: float
    p99_us: float
    max_us: float
    skipped: int


def best_of(rounds: Sequence[Wakeups]) -> Best:
    """Return the smallest median, 99th percentile and worst of the rounds, and the fewest skipped ticks."""
    return Best(
        min(one.p50_us for one in rounds),
        min(one.p99_us for one in rounds),
        min(one.max_us for one in rounds),
        min(one.skipped for one in rounds),
    )
