"""What the gate writes into its log ring: everything the base said, what was really sent, and why it latched."""

from __future__ import annotations

import math
from collections.abc import Callable

from robot_io.log.channels import CHANNELS, Kind
from robot_io.log.messages import GATE_SAYS, GateDecision, SafetyEvent
from robot_io.log.ros_messages import (
    BASE_FRAME,
    UNKNOWN_COVARIANCE,
    WORLD_FRAME,
    Header,
    Odometry,
    PoseStamped,
    PoseWithCovariance,
    TwistStamped,
    TwistWithCovariance,
    planar_pose,
    planar_twist,
    ros_time,
)
from robot_io.messages import BaseFeed, BaseOdometry, BasePose, BaseReport, BodyTwist, SliderPose, Stamped
from robot_io.tick import Mode


class GateLog:
    """Encodes and pushes; `push(kind, time_ns, payload)` is that of the gate's log ring."""

    def __init__(self, push: Callable[[int, int, bytes], object], wall_offset_ns: int) -> None:
        self._push_record = push
        self._offset_ns = wall_offset_ns

    def inbound(self, sample: Stamped[BaseFeed]) -> None:
        """Log one sample of the base by its receive time."""
        value, at_ns = sample.value, sample.received_ns
        header = self._header(at_ns, WORLD_FRAME)
        if isinstance(value, BasePose):
            pose = planar_pose(value.pose.x, value.pose.y, value.pose.yaw)
            self._push(Kind.BASE_POSE, at_ns, PoseStamped(header, pose))
        elif isinstance(value, SliderPose):
            pose = planar_pose(value.pose.x, value.pose.y, value.pose.yaw)
            self._push(Kind.SLIDER_POSE, at_ns, PoseStamped(header, pose))
        elif isinstance(value, BaseOdometry):
            unplaced = PoseWithCovariance(planar_pose(math.nan, math.nan, 0.0), UNKNOWN_COVARIANCE)
            twist = TwistWithCovariance(planar_twist(value.twist), UNKNOWN_COVARIANCE)
            self._push(Kind.BASE_ODOM, at_ns, Odometry(header, BASE_FRAME, unplaced, twist))
        elif isinstance(value, BaseReport):
            self._push(Kind.BASE_STATUS, at_ns, value.status)

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

    def _header(self, at_ns: int, frame: str) -> Header:
        return Header(ros_time(at_ns + self._offset_ns), frame)

    def _push(self, kind: Kind, at_ns: int, value: object) -> None:
        self._push_record(int(kind), at_ns, CHANNELS[kind].cdr_type.encode(value))
