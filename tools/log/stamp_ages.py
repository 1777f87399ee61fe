"""How old messages are when they arrive, by the stamps in them: latency, as far as the two clocks allow to say."""

from __future__ import annotations

import struct

import msgspec

from robot_io.clock import NS_PER_MS, NS_PER_S

_STAMP = struct.Struct("<iI")
_STAMP_AT = 4
"""Of a message that begins with a header: behind the encapsulation."""
MOST_KEPT = 4096


class Latency(msgspec.Struct, frozen=True):
    """Arrival minus stamp of the messages of a topic, ms; the stamp is by the sender's clock.

    `latency_ms` is the median of what is left when the offset of the clocks is taken out, known to `within_ms`; None
    where the offset is not known. It holds for a sender that has the clock of the base's computer.
    """

    messages: int
    least_ms: float
    median_ms: float
    p95_ms: float
    most_ms: float
    latency_ms: float | None
    within_ms: float | None

    def in_words(self) -> str:
        """Return it as a line for people."""
        if self.latency_ms is None or self.within_ms is None:
            late_ms = self.median_ms - self.least_ms
            return (
                f"at the median {late_ms:.1f} ms more than the fastest message; the offset of the sender's clock is "
                "not known, so the latency itself is not either"
            )
        most_ms = self.p95_ms - self.median_ms + self.latency_ms
        return (
            f"{self.latency_ms:.1f} ms from stamp to arrival (95 % below {most_ms:.1f} ms), if the sender has the "
            f"base's clock, known to {self.within_ms:.1f} ms"
        )


class StampAges:
    """Collects the ages of one topic's messages; of many, every second, fourth, ... one."""

    def __init__(self) -> None:
        self.messages = 0
        self._stride = 1
        self._ages_ns: list[int] = []
        self._least_ns = self._most_ns = 0

    def note(self, payload: bytes, arrived_ns: int) -> None:
        """Take a message that begins with a header, and its log time; one too short for a header is left out."""
        if len(payload) < _STAMP_AT + _STAMP.size:
            return
        sec, nanosec = _STAMP.unpack_from(payload, _STAMP_AT)
        age_ns = arrived_ns - (sec * NS_PER_S + nanosec)
        self._least_ns = min(self._least_ns, age_ns) if self.messages else age_ns
        self._most_ns = max(self._most_ns, age_ns) if self.messages else age_ns
        if self.messages % self._stride == 0:
            self._ages_ns.append(age_ns)
        self.messages += 1
        if len(self._ages_ns) >= MOST_KEPT:
            self._ages_ns = self._ages_ns[::2]
            self._stride *= 2

    def latency(self, ahead_s: float | None, within_s: float) -> Latency | None:
        """Return the figures; None where the messages have no stamps of their own. ahead_s: of the sender's clock."""
        if not self._ages_ns or self._least_ns == self._most_ns == 0:
            return None
        ages = sorted(self._ages_ns)
        median_ms, p95_ms = (ages[int(len(ages) * part)] / NS_PER_MS for part in (0.5, 0.95))
        return Latency(
            self.messages,
            self._least_ns / NS_PER_MS,
            median_ms,
            p95_ms,
            self._most_ns / NS_PER_MS,
            None if ahead_s is None else median_ms + ahead_s * 1000.0,
            None if ahead_s is None else within_s * 1000.0,
        )
