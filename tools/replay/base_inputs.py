"""Check that the base data in ticks matches the gate's log: what it received, and what it actually sent.

A tick holds only the newest message of each topic, so an additional message in the log proves nothing; but a message
that a tick holds and the log lacks, or holds with different content, was lost or edited. A tick does not hold the pose
and the covariances of odometry, nor why a pose is flawed: these are not compared.
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
from tools.replay.payloads import is_current_type, payload_difference, payloads_equal

TOPICS = ("/base/pose", "/base/odom", "/base/status", "/base/flawed", "/gate/sent")
_FROM_FORMAT = {"/base/flawed": 4}
"""Logs of earlier formats have no such topic: a pose or odometry that was flawed was on the topic of the others."""
_NOT_HELD = {
    "/base/odom": frozenset(("header.frame_id", "child_frame_id", "pose", "twist.covariance")),
    "/base/flawed": frozenset(("flaw", "pose.x", "pose.y", "pose.yaw")),
}
_EVERYTHING_HELD = frozenset[str]()
FIRST_FORMAT = 2
"""Logs before it held the base's messages in another way."""
MOST_KEPT = 4096
"""Log times per topic for which messages, seen or expected, wait for their counterpart: 40 s at 100 Hz."""


class BaseInputsReplay(msgspec.Struct, frozen=True):
    """How many messages held by ticks were compared. In `first_difference`, `tick` is the log time in ns."""

    messages: int
    identical: int
    first_difference: Difference | None


class _Topic:
    """The newest messages of one topic, and those that ticks hold but the log has not shown yet, by log time."""

    def __init__(self) -> None:
        self.seen: dict[int, list[bytes]] = {}  # messages received in one read share a time
        self.wanted: dict[int, list[bytes]] = {}
        self.newest_ns = 0
        self.forgotten_ns = -1


class BaseInputsReplayer:
    """Compares the ticks of a log with its messages of `TOPICS`; a tick and its messages must be near each other."""

    def __init__(
        self,
        wall_offset_ns: int,
        channels: Iterable[ChannelInfo],
        log_format: int,
        tolerance: float | None,
        *,
        since_ns: int = 0,
    ) -> None:
        """since_ns: when the log began, where it is a later part: what came until then is not in it."""
        other = {channel.topic for channel in channels if not is_current_type(channel)}
        other |= {topic for topic, first_format in _FROM_FORMAT.items() if log_format < first_format}
        self._topics = {topic: _Topic() for topic in TOPICS if topic not in other}
        self._tolerance = tolerance
        self._offset_ns = wall_offset_ns
        self._since_ns = since_ns
        self._gate = GateLog(self._expect, wall_offset_ns)
        self._held = (0, 0, 0, 0)
        self._identical = 0
        self._first: Difference | None = None

    def tick(self, tick: ControlTick) -> None:
        """Take what a tick holds that no earlier tick held."""
        base = tick.input.base
        held, self._held = self._held, (base.pose_seq, base.odometry_seq, base.status_received_ns, base.sent_ns)
        try:
            if base.pose_seq != held[0]:
                pose = BasePose(base.pose, "" if base.pose_valid else "flawed")
                self._received(base.pose_received_ns, pose, base.pose_stamp_ns)
            if base.odometry_seq != held[1]:
                self._received(base.odometry_received_ns, BaseOdometry(base.odometry), base.odometry_stamp_ns)
            if base.status_received_ns != held[2]:
                self._received(base.status_received_ns, BaseReport(base.status))
            if base.sent_ns != held[3]:
                self._gate.sent(base.sent_ns, base.sent)
        except ValueError as error:  # a time that ROS cannot express; nothing in a log may crash its replay
            self._first = self._first or Difference(tick.input.tick, "input.base", "a record of the base", str(error))

    def seen(self, topic: str, log_time_ns: int, payload: bytes) -> None:
        """Take a message."""
        state = self._topics.get(topic)
        if state is None:
            return
        state.newest_ns = max(state.newest_ns, log_time_ns)
        state.seen.setdefault(log_time_ns, []).append(payload)
        if len(state.seen) > MOST_KEPT:
            oldest = next(iter(state.seen))
            del state.seen[oldest]
            state.forgotten_ns = max(state.forgotten_ns, oldest)
        waiting = state.wanted.get(log_time_ns, [])
        for i, held in enumerate(waiting):
            if self._equal(topic, payload, held):
                del waiting[i]
                if not waiting:
                    del state.wanted[log_time_ns]
                self._identical += 1
                return

    def result(self, *, complete: bool) -> BaseInputsReplay:
        """Return the comparison. If the log is not complete, its newest messages may be missing."""
        first, lost = self._first, 0
        for topic, state in self._topics.items():
            for log_time_ns, waiting in state.wanted.items():
                if complete or log_time_ns <= state.newest_ns:
                    lost += len(waiting)
                    if first is None or log_time_ns < first.tick:
                        logged = state.seen.get(log_time_ns, [None])[-1]  # of those in one read, ticks hold the last
                        first = payload_difference(log_time_ns, topic, logged, waiting[0], _not_held(topic))
        return BaseInputsReplay(self._identical + lost, self._identical, first)

    def _received(self, received_ns: int, value: BaseFeed, stamp_ns: int = 0) -> None:
        self._gate.inbound(Stamped(value, 0, received_ns, stamp_ns=stamp_ns))

    def _equal(self, topic: str, one: bytes, other: bytes) -> bool:
        return payloads_equal(topic, one, other, self._tolerance, _not_held(topic))

    def _expect(self, kind: int, time_ns: int, payload: bytes) -> None:
        topic, log_time_ns = CHANNELS[kind].topic, time_ns + self._offset_ns
        state = self._topics.get(topic)
        if state is None or time_ns <= self._since_ns:
            return
        if any(self._equal(topic, logged, payload) for logged in state.seen.get(log_time_ns, ())):
            self._identical += 1
        elif log_time_ns > state.forgotten_ns:
            state.wanted.setdefault(log_time_ns, []).append(payload)
            if len(state.wanted) > MOST_KEPT:
                del state.wanted[next(iter(state.wanted))]


def _not_held(topic: str) -> frozenset[str]:
    return _NOT_HELD.get(topic, _EVERYTHING_HELD)
