"""How often derived topics are written: since format 5 some of them less often than the ticks they come from.

A thinned message comes with the first record in each span of time, and spans are counted from 1970 on: so a log derives
the same again, whatever stands between.
"""

from __future__ import annotations

from robot_io.clock import NS_PER_S
from robot_io.messages import ArmRecord
from robot_io.rig.config import RigConfig

VIEWER_NS = NS_PER_S // 25
WORLD_STATE_NS = NS_PER_S // 100


class Thinned:
    """Says of records given in order which of them is the first in its span; a span of 0 lets all pass."""

    def __init__(self, span_ns: int) -> None:
        self._span_ns = span_ns
        self._last = -1

    def due(self, time_ns: int) -> bool:
        """Return whether a record of this log time is to be written."""
        if not self._span_ns:
            return True
        span = time_ns // self._span_ns
        if span == self._last:
            return False
        self._last = span
        return True


def holds_world_state(rig: RigConfig, t_ns: int) -> bool:
    """Return whether a log holds the state of the simulated world at a time of its own, which has one every 10 ms."""
    return rig.log.topics != "lean" or t_ns // VIEWER_NS != (t_ns - WORLD_STATE_NS) // VIEWER_NS


class TickThinning:
    """What of one tick after another is written besides its measurements and signals."""

    def __init__(self, rig: RigConfig, log_format: int) -> None:
        self._whole = log_format < 5
        lean = rig.log.topics == "lean" and not self._whole
        self._viewers = Thinned(VIEWER_NS if lean else 0)
        self._frames = Thinned(VIEWER_NS if lean else 0)
        self._timing = Thinned(NS_PER_S)
        self._arm = Thinned(NS_PER_S)
        self._arm_said: tuple[object, ...] = ()

    def viewers(self, now_ns: int) -> bool:
        """Return whether the topics that only viewers need are due."""
        return self._viewers.due(now_ns)

    def frames(self, time_ns: int) -> bool:
        """Return whether the frames of the base are due."""
        return self._frames.due(time_ns)

    def timing(self, now_ns: int, skipped: int) -> bool:
        """Return whether a tick's timing is due: one a second, and wherever periods were skipped."""
        return self._whole or self._timing.due(now_ns) or skipped > 0

    def arm_status(self, time_ns: int, arm: ArmRecord) -> bool:
        """Return whether the arm's status is due: when it says anything new but the time, and once a second."""
        joints = arm.joints
        said = (joints.device_state, joints.state, arm.link, arm.error, arm.servo)
        known, self._arm_said = self._arm_said, said
        return self._arm.due(time_ns) or self._whole or said != known
