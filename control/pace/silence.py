"""How long another process has given no sign of life."""

from __future__ import annotations


class Silence:
    """Times the silence of one process, only while this one runs: whoever was paused cannot have heard anything."""

    def __init__(self) -> None:
        self._since_ns = 0

    def heard(self, now_ns: int) -> None:
        """Note a sign of life; the first one starts the watch."""
        self._since_ns = now_ns

    def leave_out(self, pause_ns: int) -> None:
        """Leave out a pause of this process itself."""
        if self._since_ns:
            self._since_ns += pause_ns

    def so_far_ns(self, now_ns: int) -> int:
        """Return how long nothing has been heard, 0 before the first sign."""
        return max(0, now_ns - self._since_ns) if self._since_ns else 0
