"""How much older the base's messages have become on their way than they were in the run's first second; pure.

A message carries the time at which the robot stamped it. The two clocks need not agree: only the growth of the age
counts, and the baseline follows as fast as clocks may drift apart.
"""

from __future__ import annotations

import msgspec

BASELINE_NS = 1_000_000_000
RECENT = 3
"""The youngest of this many messages counts: what a pause of this machine delayed is no lag of the bridge."""
DRIFT = 500e-6
"""The fastest at which time servers let a clock run off (RFC 5905, 500 ppm)."""
MOST_STAMP_S = 2.0**32
"""Seconds of ROS have 32 bits."""


class Lag(msgspec.Struct, frozen=True, gc=False):
    """Ages are receive time minus stamp, of two clocks: ns."""

    first_ns: int = 0
    newest_ns: int = 0
    recent: tuple[int, ...] = ()
    baseline: int = 0
    growth_ns: int = 0
    """Age beyond the baseline; 0 in the first second."""

    def on_stamp(self, received_ns: int, stamp_s: float) -> Lag:
        """Take in a message; one without a stamp (none, 0, or what no clock of ROS can show) is left out."""
        if not 0.0 < stamp_s < MOST_STAMP_S:
            return self
        recent = (*self.recent, received_ns - round(stamp_s * 1e9))[-RECENT:]
        if len(recent) < RECENT:
            return Lag(self.first_ns or received_ns, received_ns, recent)
        age = min(recent)
        first = len(self.recent) < RECENT
        settling = received_ns - self.first_ns <= BASELINE_NS
        drift = 0 if settling else round(DRIFT * max(received_ns - self.newest_ns, 0))
        baseline = age if first else min(self.baseline + drift, age)
        return Lag(self.first_ns, received_ns, recent, baseline, 0 if settling else age - baseline)
