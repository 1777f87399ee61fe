"""What the gate writes into its log ring: everything the base said, what was really sent, and why it latched.

The stamp in a header is the one that came in the message where that is a wall time, else the time of arrival; the log
time is that of arrival. A pose or a velocity that is flawed is never on the topic of the sound ones.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from robot_io.log.channels import CHANNELS, Kind
from robot_io.log.messages import GATE_SAYS, BaseClock, FlawedSample, GateDecision, SafetyEvent
from robot_io.log.ros_messages import (
    BASE_FRAME,
    WORLD_FRAME,
    Header,
    Odometry,
    Point,
    Pose,
    PoseStamped,
    PoseWithCovariance,
    Quaternion,
    TwistStamped,
    TwistWithCovariance,
    planar_pose,
    planar_twist,
    ros_time,
)
from robot_io.messages import (
    BaseFeed,
    BaseOdometry,
    BasePose,
    BaseReport,
    BodyTwist,
    ClockOffset,
    Pose2D,
    SliderPose,
    Stamped,
)
from robot_io.odometry_pose import NO_COVARIANCE
from robot_io.tick import Mode

UNKNOWN_VARIANCE = 1e6
"""Of each axis (m^2, rad^2) of an odometry pose that did not come: nothing is known of it."""
_UNKNOWN = PoseWithCovariance(
    planar_pose(0.0, 0.0, 0.0), tuple(UNKNOWN_VARIANCE if i % 7 == 0 else 0.0 for i in range(36))
)
_NOWHERE, _NO_TWIST = Pose2D(math.nan, math.nan, math.nan), BodyTwist(math.nan, math.nan, math.nan)
NOT_A_NUMBER = "a number is not finite"


class GateLog:
    """Encodes and pushes; `push(kind, time_ns, payload)` is that of the gate's log ring."""

    def __init__(self, push: Callable[[int, int, bytes], object], wall_offset_ns: int) -> None:
        self._push_record = push
        self._offset_ns = wall_offset_ns

    def inbound(self, sample: Stamped[BaseFeed]) -> None:
        """Log one sample of the base by its receive time."""
        value, at_ns = sample.value, sample.received_ns
        if isinstance(value, BasePose):
            self._pose(Kind.BASE_POSE, sample, value.pose, value.flaw)
        elif isinstance(value, SliderPose):
            self._pose(Kind.SLIDER_POSE, sample, value.pose, value.flaw)
        elif isinstance(value, BaseOdometry):
            self._odometry(sample, value)
        elif isinstance(value, BaseReport):
            self._push(Kind.BASE_STATUS, at_ns, value.status)

    def clock(self, now_ns: int, offset: ClockOffset | None) -> None:
        """Log how far the base's clock is ahead, where that is known."""
        if offset is not None:
            found = BaseClock(self._header(now_ns, BASE_FRAME), offset.ahead_s, offset.within_s)
            self._push(Kind.BASE_CLOCK, now_ns, found)

    def sent(self, now_ns: int, twist: BodyTwist) -> None:
        """Log what really went out to the base."""
        self._push(Kind.GATE_SENT, now_ns, TwistStamped(self._header(now_ns, BASE_FRAME), planar_twist(twist)))

    def latched(self, now_ns: int, seq: int, tick: int, latch: int, text: str, fault: str) -> None:
        """Log why the gate latched; `fault` names the row of the fault table ("" for the normal end)."""
        header = self._header(now_ns, BASE_FRAME)
        self._push(Kind.GATE_DECISION, now_ns, GateDecision(header, seq, tick, latch, True, text))
        if fault:
            stop = int(Mode.STOP)
            self._push(
                Kind.SAFETY_EVENT, now_ns, SafetyEvent(header, tick, "fault", fault, f"{GATE_SAYS}{text}", stop, stop)
            )

    def _pose(self, kind: Kind, sample: Stamped[BaseFeed], pose: Pose2D, flaw: str) -> None:
        header = self._stamped(sample, WORLD_FRAME)
        if not flaw and not _finite(pose.x, pose.y, pose.yaw):
            flaw = NOT_A_NUMBER
        if flaw:
            self._flawed(kind, sample, header, flaw, pose)
        else:
            self._push(kind, sample.received_ns, PoseStamped(header, planar_pose(pose.x, pose.y, pose.yaw)))

    def _odometry(self, sample: Stamped[BaseFeed], value: BaseOdometry) -> None:
        twist, came = value.twist, value.pose
        if not _finite(twist.vx, twist.vy, twist.omega):
            self._flawed(Kind.BASE_ODOM, sample, self._stamped(sample, BASE_FRAME), NOT_A_NUMBER, _NOWHERE, twist)
            return
        placed, frame, child = _UNKNOWN, WORLD_FRAME, BASE_FRAME
        covariance: tuple[float, ...] = NO_COVARIANCE
        if came is not None and came.whole:
            pose = Pose(Point(*came.position), Quaternion(*came.orientation))
            placed, covariance = PoseWithCovariance(pose, came.covariance), came.twist_covariance
            frame, child = came.frame, came.child_frame
        moving = TwistWithCovariance(planar_twist(twist), covariance)
        self._push(Kind.BASE_ODOM, sample.received_ns, Odometry(self._stamped(sample, frame), child, placed, moving))

    def _flawed(
        self,
        kind: Kind,
        sample: Stamped[BaseFeed],
        header: Header,
        flaw: str,
        pose: Pose2D,
        twist: BodyTwist = _NO_TWIST,
    ) -> None:
        flawed = FlawedSample(header, CHANNELS[kind].topic, flaw, pose, twist)
        self._push(Kind.BASE_FLAWED, sample.received_ns, flawed)

    def _stamped(self, sample: Stamped[BaseFeed], frame: str) -> Header:
        return Header(ros_time(sample.epoch_ns or sample.received_ns + self._offset_ns), frame)

    def _header(self, at_ns: int, frame: str) -> Header:
        return Header(ros_time(at_ns + self._offset_ns), frame)

    def _push(self, kind: Kind, at_ns: int, value: object) -> None:
        self._push_record(int(kind), at_ns, CHANNELS[kind].cdr_type.encode(value))


def _finite(*numbers: float) -> bool:
    return all(map(math.isfinite, numbers))
