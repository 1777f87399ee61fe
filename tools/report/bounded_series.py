"""Collect columns of a log of any length in bounded memory: thinned evenly, or counted in bins."""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

BIGGEST = 1e9
"""Larger or non-finite numbers become NaN: no quantity in a log is that large, and no axis could show it."""


MOST_SPANS = 2000


class Series:
    """Rows of floats, at most `limit` of them: when full, every other row is dropped, and the sampling rate is halved.

    Call `wants()` once per sample, in order, before computing its row.
    """

    def __init__(self, columns: Sequence[str], limit: int = 60_000) -> None:
        self.names = tuple(columns)
        self.stride = 1
        self._limit = limit
        self._seen = 0
        self._columns = [array("d") for _ in self.names]

    def __len__(self) -> int:
        return len(self._columns[0])

    def wants(self) -> bool:
        """Return whether the next sample is kept."""
        wanted = self._seen % self.stride == 0
        self._seen += 1
        return wanted

    def add(self, row: Sequence[float]) -> None:
        """Append one row."""
        for column, value in zip(self._columns, row, strict=True):
            column.append(value)
        if len(self) >= self._limit:
            self._columns = [column[::2] for column in self._columns]
            self.stride *= 2

    def arrays(self) -> dict[str, Floats]:
        """Return the columns by name, each of shape (rows,)."""
        arrays = {}
        for name, column in zip(self.names, self._columns, strict=True):
            values = np.array(column, dtype=np.float64)
            values[~(np.abs(values) < BIGGEST)] = np.nan
            arrays[name] = values
        return arrays


class Tally:
    """Histogram of non-negative times in bins of 10 us up to 1 s, with the exact maximum."""

    BIN_MS = 0.01
    _BINS = 100_000

    def __init__(self) -> None:
        self.total = 0
        self.worst_ms = 0.0
        self._counts = array("Q", bytes(8 * (self._BINS + 1)))

    def add(self, time_ms: float) -> None:
        """Count one time; NaN and negative times are ignored."""
        if not time_ms >= 0.0:
            return
        self.total += 1
        self.worst_ms = max(self.worst_ms, time_ms)
        self._counts[int(min(time_ms / self.BIN_MS, self._BINS))] += 1

    def percentile_ms(self, percent: float) -> float:
        """Return the upper edge of the bin that holds the percentile (NaN if nothing was counted)."""
        if not self.total:
            return float("nan")
        sums = np.cumsum(np.array(self._counts, dtype=np.uint64))
        index = int(np.searchsorted(sums, percent / 100.0 * self.total))
        return min((index + 1) * self.BIN_MS, self.worst_ms)

    def counts_in(self, edges_ms: Floats) -> Floats:
        """Return the number of times between neighbouring edges (ms, ascending), shape (edges - 1,)."""
        lows = np.arange(self._BINS + 1) * self.BIN_MS
        counts, _ = np.histogram(lows + self.BIN_MS / 2, bins=edges_ms, weights=np.array(self._counts, dtype=float))
        return counts.astype(np.float64)


class Span(NamedTuple):
    """The duration of a fault (by its id) or a mode (by its number), in s since the first tick."""

    name: str
    text: str
    begin_s: float
    end_s: float


class Spans:
    """Open and finished spans, bounded in number."""

    def __init__(self) -> None:
        self._open: dict[str, Span] = {}
        self._done: list[Span] = []

    def begin(self, key: str, name: str, text: str, time_s: float) -> None:
        """Begin a span under a key, ending any that is open there."""
        self.end(key, time_s)
        if len(self._done) + len(self._open) < MOST_SPANS:
            self._open[key] = Span(name, text, time_s, time_s)

    def end(self, key: str, time_s: float) -> None:
        """End the span under a key, if there is one."""
        span = self._open.pop(key, None)
        if span is not None:
            self._done.append(span._replace(end_s=time_s))

    def finish(self, end_s: float, zero_s: float) -> list[Span]:
        """End open spans at `end_s` and return all in order of their beginning, with times relative to `zero_s`."""
        for key in list(self._open):
            self.end(key, end_s)
        moved = [Span(name, text, begin - zero_s, end - zero_s) for name, text, begin, end in self._done]
        return sorted(moved, key=lambda span: span.begin_s)
