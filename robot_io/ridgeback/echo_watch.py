"""Whether our commands come back from the command topic, and which of those heard there are not ours; pure."""

from __future__ import annotations

from collections import deque

from robot_io.messages import BodyTwist

REMEMBERED = 256
"""Commands: five seconds of them."""
SAME = 1e-9
"""m/s or rad/s; a bridge repeats a number to the last digit or nearly so."""


class EchoWatch:
    """Times are in ns of the caller's clock."""

    def __init__(self) -> None:
        self._sent: deque[BodyTwist] = deque(maxlen=REMEMBERED)
        self.unheard_since_ns = 0
        """When the oldest command left that may not have been heard back; 0 when there is none."""
        self.heard = 0
        """How many of ours were heard."""
        self.foreign = 0
        """How many were heard that are not ours."""
        self.newest_foreign = BodyTwist()

    def on_sent(self, twist: BodyTwist, now_ns: int) -> None:
        """Note a command that left."""
        if not self._sent or self._sent[-1] != twist:
            self._sent.append(twist)
        if self.heard and not self.unheard_since_ns:  # before the first, ROS may still be connecting
            self.unheard_since_ns = now_ns

    def on_heard(self, twist: BodyTwist) -> None:
        """Note a velocity heard on the command topic."""
        if any(_same(twist, ours) for ours in reversed(self._sent)):
            self.heard += 1
            self.unheard_since_ns = 0
        else:
            self.foreign += 1
            self.newest_foreign = twist


def _same(a: BodyTwist, b: BodyTwist) -> bool:
    return max(abs(a.vx - b.vx), abs(a.vy - b.vy), abs(a.omega - b.omega)) <= SAME
