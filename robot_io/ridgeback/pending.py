"""Samples that wait to be drained, and how often the base's pose arrives."""

from __future__ import annotations

from collections import deque

from robot_io.clock import NS_PER_S
from robot_io.messages import BaseFeed, BasePose, Stamped

MAX_PENDING = 4096
"""Samples kept until they are taken; older ones are dropped and counted."""
RATE_WINDOW = 100
"""Poses over which the rate is measured."""


class PendingSamples:
    """A bounded queue of the base's samples."""

    def __init__(self) -> None:
        self._samples: deque[Stamped[BaseFeed]] = deque()
        self._pose_times_ns: deque[int] = deque(maxlen=RATE_WINDOW)
        self.dropped = 0
        """Samples dropped because nobody took them, since `clear`."""

    def add(self, sample: Stamped[BaseFeed]) -> None:
        """Append a sample; the oldest one is dropped where 4096 wait already."""
        if isinstance(sample.value, BasePose):
            self._pose_times_ns.append(sample.received_ns)
        if len(self._samples) == MAX_PENDING:
            self._samples.popleft()
            self.dropped += 1
        self._samples.append(sample)

    def take_all(self) -> tuple[Stamped[BaseFeed], ...]:
        """Return every waiting sample, oldest first, and forget them."""
        samples = tuple(self._samples)
        self._samples.clear()
        return samples

    def pose_rate_hz(self) -> float:
        """Return the rate of the last 100 poses, 0 before the second."""
        times_ns = self._pose_times_ns
        span_ns = times_ns[-1] - times_ns[0] if len(times_ns) > 1 else 0
        return (len(times_ns) - 1) * NS_PER_S / span_ns if span_ns else 0.0

    def clear(self) -> None:
        """Forget samples, rate and count."""
        self._samples.clear()
        self._pose_times_ns.clear()
        self.dropped = 0
