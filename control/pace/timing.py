"""Statistics of the loop's timing: fixed histograms, so that memory does not grow with the run."""

from __future__ import annotations

BUCKET_NS = 1_000
BUCKETS = 50_000
"""Up to 50 ms in steps of 1 us; longer times fall into the last bucket."""

STAGES = ("wake", "input", "fold", "send", "record")
"""What a tick's time goes into: from its deadline to awake, devices read, input folded, frame sent to the gate,
record pushed into the log's ring."""


class Histogram:
    """Counts times of up to 50 ms in steps of 1 us."""

    def __init__(self) -> None:
        self.count = 0
        self._buckets = [0] * BUCKETS

    def note(self, time_ns: int) -> None:
        """Count one time."""
        self.count += 1
        self._buckets[min(max(time_ns, 0) // BUCKET_NS, BUCKETS - 1)] += 1

    def percentile_ms(self, percent: float) -> float:
        """Return the time in ms below which `percent` of the counted ones lie, rounded up to 1 us (0.0 without any)."""
        wanted = self.count * percent / 100.0
        seen = 0
        for bucket, count in enumerate(self._buckets):
            seen += count
            if seen >= wanted and seen:
                return (bucket + 1) * BUCKET_NS * 1e-6
        return 0.0


class LoopTiming:
    """Counts ticks and skipped periods, how late the ticks woke up, and what their time went into (ns)."""

    def __init__(self) -> None:
        self.ticks = 0
        self.skipped = 0
        self.worst_ns = 0
        self.worst_compute_ns = 0
        self._late = Histogram()
        self._to_gate = Histogram()
        self._stages = dict.fromkeys(STAGES, 0)
        self._staged = 0

    def note(self, late_ns: int, skipped: int, compute_ns: int) -> None:
        """Count one tick."""
        self.ticks += 1
        self.skipped += skipped
        self.worst_ns = max(self.worst_ns, late_ns)
        self.worst_compute_ns = max(self.worst_compute_ns, compute_ns)
        self._late.note(late_ns)

    def note_stages(self, deadline_ns: int, woken_ns: int, read_ns: int, folded_ns: int, sent_ns: int) -> None:
        """Count where a tick's time went until its frame was sent: the times of its stages on one clock."""
        self._staged += 1
        self._to_gate.note(sent_ns - deadline_ns)
        times = (deadline_ns, woken_ns, read_ns, folded_ns, sent_ns)
        for stage, began_ns, ended_ns in zip(STAGES, times, times[1:], strict=False):
            self._stages[stage] += ended_ns - began_ns

    def note_record(self, record_ns: int) -> None:
        """Count how long the record of such a tick took."""
        self._stages["record"] += record_ns

    def late_percentile_ms(self, percent: float) -> float:
        """Return the lateness in ms below which `percent` of the ticks woke up (0.0 without ticks)."""
        return self._late.percentile_ms(percent)

    def summary(self, rate_hz: float, first_ns: int, last_ns: int) -> dict[str, object]:
        """Return the loop's figures for summary and report (ms, Hz; means of the stages in us)."""
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
            "to_gate_p50_ms": round(self._to_gate.percentile_ms(50.0), 3),
            "to_gate_p99_ms": round(self._to_gate.percentile_ms(99.0), 3),
            "stages_us": {
                stage: round(total / max(1, self._staged) * 1e-3, 1) for stage, total in self._stages.items()
            },
        }
