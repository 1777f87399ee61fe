"""Statistics of the loop's timing: a fixed histogram of lateness, so that memory does not grow with the run."""

from __future__ import annotations

BUCKET_NS = 10_000
BUCKETS = 5_000
"""Up to 50 ms in steps of 10 us; later wake-ups fall into the last bucket."""


class LoopTiming:
    """Counts ticks and skipped periods, and how late the ticks woke up (ns)."""

    def __init__(self) -> None:
        self.ticks = 0
        self.skipped = 0
        self.worst_ns = 0
        self.worst_compute_ns = 0
        self._late = [0] * BUCKETS

    def note(self, late_ns: int, skipped: int, compute_ns: int) -> None:
        """Count one tick."""
        self.ticks += 1
        self.skipped += skipped
        self.worst_ns = max(self.worst_ns, late_ns)
        self.worst_compute_ns = max(self.worst_compute_ns, compute_ns)
        self._late[min(late_ns // BUCKET_NS, BUCKETS - 1)] += 1

    def late_percentile_ms(self, percent: float) -> float:
        """Return the lateness in ms below which `percent` of the ticks woke up (0.0 without ticks)."""
        wanted = self.ticks * percent / 100.0
        seen = 0
        for bucket, count in enumerate(self._late):
            seen += count
            if seen >= wanted and seen:
                return (bucket + 1) * BUCKET_NS * 1e-6
        return 0.0

    def summary(self, rate_hz: float, first_ns: int, last_ns: int) -> dict[str, float | int]:
        """Return the loop's figures for summary and report (ms, Hz)."""
        duration_s = (last_ns - first_ns) * 1e-9
        return {
            "rate_hz": rate_hz,
            "measured_hz": round((self.ticks - 1) / duration_s, 4) if duration_s > 0 else 0.0,
            "ticks": self.ticks,
            "skipped": self.skipped,
            "late_p50_ms": round(self.late_percentile_ms(50.0), 3),
            "late_p99_ms": round(self.late_percentile_ms(99.0), 3),
            "late_worst_ms": round(self.worst_ns * 1e-6, 3),
            "compute_worst_ms": round(self.worst_compute_ns * 1e-6, 3),
        }
