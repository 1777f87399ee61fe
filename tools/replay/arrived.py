"""What a tick holds of the base must stand in the log as the gate wrote it: what came in, and what really went out.

These are inputs: a tick holds only the newest of each, so that a message more says nothing; but one that a tick holds
and the log does not, or not so, was lost or edited.
"""

from __future__ import annotations

from collections.abc import Iterable

import msgspec

from robot_io.log.channels import CHANNELS
from robot_io.log.gate_log import GateLog
from robot_io.mcap.read import ChannelInfo
from robot_io.messages import BaseFeed, BaseOdometry, BasePose, BaseReport, Stamped
from robot_io.tick import ControlTick
from tools.replay.difference import Difference
from tools.replay.payloads import is_todays, same, where_they_differ

TOPICS = ("/base/pose", "/base/odom", "/base/status", "/gate/sent")
MOST_KEPT = 4096
"""Times of one topic whose messages are kept for the ticks that hold them, or that are waited for: 40 s at 100 Hz."""


class ArrivedReplay(msgspec.Struct, frozen=True):
    """How many messages that ticks hold were compared. Of `first_difference`, `tick` is the log time in ns."""

    messages: int
    identical: int
    first_difference: Difference | None


class _Topic:
    """The newest messages of one topic, and those that ticks hold and that were not seen yet, by log time."""

    def __init__(self) -> None:
        self.seen: dict[int, list[bytes]] = {}  # several that came in one read have one time
        self.wanted: dict[int, list[bytes]] = {}
        self.newest_ns = 0
        self.forgotten_ns = -1


class ArrivedReplayer:
    """Takes the ticks of a log and its messages of `TOPICS`, in any order in which both come near each other."""

    def __init__(self, wall_offset_ns: int, channels: Iterable[ChannelInfo], tolerance: float | None) -> None:
        other = {channel.topic for channel in channels if not is_todays(channel)}
        self._topics = {topic: _Topic() for topic in TOPICS if topic not in other}
        self._tolerance = tolerance
        self._offset_ns = wall_offset_ns
        self._gate = GateLog(self._want, wall_offset_ns)
        self._held = (0, 0, 0, 0)
        self._identical = 0
        self._first: Difference | None = None

    def tick(self, tick: ControlTick) -> None:
        """Take what a tick holds for the first time."""
        base = tick.input.base
        held, self._held = self._held, (base.pose_seq, base.odometry_seq, base.status_received_ns, base.sent_ns)
        try:
            if base.pose_seq != held[0] and base.pose_valid:
                self._came(base.pose_received_ns, BasePose(base.pose))
            if base.odometry_seq != held[1]:
                self._came(base.odometry_received_ns, BaseOdometry(base.odometry))
            if base.status_received_ns != held[2]:
                self._came(base.status_received_ns, BaseReport(base.status))
            if base.sent_ns != held[3]:
                self._gate.sent(base.sent_ns, base.sent)
        except ValueError as error:  # a time that ROS cannot say; nothing in a log may crash its replay
            self._first = self._first or Difference(tick.input.tick, "input.base", "a record of the base", str(error))

    def seen(self, topic: str, log_time_ns: int, payload: bytes) -> None:
        """Take a message."""
        its = self._topics.get(topic)
        if its is None:
            return
        its.newest_ns = max(its.newest_ns, log_time_ns)
        its.seen.setdefault(log_time_ns, []).append(payload)
        if len(its.seen) > MOST_KEPT:
            oldest = next(iter(its.seen))
            del its.seen[oldest]
            its.forgotten_ns = max(its.forgotten_ns, oldest)
        waiting = its.wanted.get(log_time_ns, [])
        for i, held in enumerate(waiting):
            if same(topic, payload, held, self._tolerance):
                del waiting[i]
                if not waiting:
                    del its.wanted[log_time_ns]
                self._identical += 1
                return

    def result(self, *, complete: bool) -> ArrivedReplay:
        """Return how it compared. The newest messages may be lost with the end of a log."""
        first, lost = self._first, 0
        for topic, its in self._topics.items():
            for log_time_ns, waiting in its.wanted.items():
                if complete or log_time_ns <= its.newest_ns:
                    lost += len(waiting)
                    if first is None or log_time_ns < first.tick:
                        logged = its.seen.get(log_time_ns, [None])[0]
                        first = where_they_differ(log_time_ns, topic, logged, waiting[0])
        return ArrivedReplay(self._identical + lost, self._identical, first)

    def _came(self, received_ns: int, value: BaseFeed) -> None:
        self._gate.inbound(Stamped(value, 0, received_ns))

    def _want(self, kind: int, time_ns: int, payload: bytes) -> None:
        topic, log_time_ns = CHANNELS[kind].topic, time_ns + self._offset_ns
        its = self._topics.get(topic)
        if its is None:
            return
        if any(same(topic, logged, payload, self._tolerance) for logged in its.seen.get(log_time_ns, ())):
            self._identical += 1
        elif log_time_ns > its.forgotten_ns:
            its.wanted.setdefault(log_time_ns, []).append(payload)
            if len(its.wanted) > MOST_KEPT:
                del its.wanted[next(iter(its.wanted))]
