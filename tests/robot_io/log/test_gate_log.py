"""What the gate logs of the base: the sender's stamp, odometry as it came, and nothing flawed among the sound."""

from __future__ import annotations

import math
from typing import Any

import pytest

from robot_io.log.channels import CHANNELS
from robot_io.log.gate_log import GateLog
from robot_io.messages import BaseOdometry, BasePose, BodyTwist, ClockOffset, Pose2D, SliderPose, Stamped
from robot_io.odometry_pose import OdometryPose

OFFSET_NS = 1_700_000_000 * 10**9
ARRIVED_NS, STAMP_NS = 5_000_000_007, OFFSET_NS + 4_996_000_003
NAN = math.nan


def logged(value: Any, stamp_ns: int = STAMP_NS) -> list[tuple[str, int, Any]]:
    """Return topic, time and message of what one sample becomes."""
    found: list[tuple[str, int, Any]] = []

    def push(kind: int, time_ns: int, payload: bytes) -> None:
        found.append((CHANNELS[kind].topic, time_ns, CHANNELS[kind].cdr_type.decode(payload)))

    GateLog(push, OFFSET_NS).inbound(Stamped(value, 0, ARRIVED_NS, stamp_ns=stamp_ns))
    return found


def stamp_of(message: Any) -> int:
    return int(message.header.stamp.sec * 10**9 + message.header.stamp.nanosec)


@pytest.mark.parametrize(("stamp_ns", "expected"), [
    (STAMP_NS, STAMP_NS), (0, OFFSET_NS + ARRIVED_NS), (123 * 10**9, OFFSET_NS + ARRIVED_NS),
    (2**32 * 10**9, OFFSET_NS + ARRIVED_NS), (-5, OFFSET_NS + ARRIVED_NS),
])  # fmt: skip
def test_the_stamp_is_the_sender_s_where_it_is_a_wall_time_and_the_log_time_is_arrival(stamp_ns, expected):
    for value in (BasePose(Pose2D(1.0, 2.0, 0.0)), SliderPose(Pose2D()), BaseOdometry(BodyTwist(0.1, 0.0, 0.0))):
        [(_, time_ns, message)] = logged(value, stamp_ns)
        assert time_ns == ARRIVED_NS
        assert stamp_of(message) == expected


def test_odometry_is_logged_as_it_came():
    covariance = tuple(float(n) for n in range(36))
    came = OdometryPose("odom", "base_footprint", (1.0, 2.0, 0.5), (0.0, 0.0, 0.6, 0.8), covariance, covariance[::-1])
    [(topic, _, message)] = logged(BaseOdometry(BodyTwist(0.1, -0.2, 0.3), came))
    assert topic == "/base/odom"
    assert (message.header.frame_id, message.child_frame_id) == ("odom", "base_footprint")
    at, turned = message.pose.pose.position, message.pose.pose.orientation
    assert (at.x, at.y, at.z, turned.z, turned.w) == (1.0, 2.0, 0.5, 0.6, 0.8)
    assert (message.pose.covariance, message.twist.covariance) == (covariance, covariance[::-1])
    twist = message.twist.twist
    assert (twist.linear.x, twist.linear.y, twist.angular.z) == (0.1, -0.2, 0.3)


def test_odometry_without_a_pose_says_that_nothing_is_known_of_it_and_holds_no_nan():
    [(_, _, message)] = logged(BaseOdometry(BodyTwist(0.1, 0.0, 0.0)))
    assert [message.pose.covariance[7 * axis] for axis in range(6)] == [1e6] * 6
    assert message.pose.pose.position.x == 0.0
    assert message.pose.pose.orientation.w == 1.0


@pytest.mark.parametrize("came", [
    OdometryPose("odom", "b", (1.0, NAN, 0.0), (0.0, 0.0, 0.0, 1.0)),
    OdometryPose("odom", "b", (1.0, 2.0, 0.0), (0.0, 0.0, 0.0, 1.0), (0.0,) * 35),
    OdometryPose("odom", "b", (1.0, 2.0, 0.0), (0.0, 0.0, 0.0, 1.0), twist_covariance=(math.inf,) * 36),
])  # fmt: skip
def test_a_pose_of_odometry_that_is_not_whole_is_as_one_that_did_not_come(came):
    twist = BodyTwist(0.1, 0.0, 0.0)
    assert logged(BaseOdometry(twist, came)) == logged(BaseOdometry(twist))


@pytest.mark.parametrize(("value", "topic", "flaw"), [
    (BasePose(Pose2D(NAN, 2.0, 0.5), "a number of the pose is null"), "/base/pose", "a number of the pose is null"),
    (BasePose(Pose2D(1.0, NAN, 0.5)), "/base/pose", "a number is not finite"),
    (SliderPose(Pose2D(1.0, 2.0, 0.5), "another frame"), "/slider/pose", "another frame"),
    (BaseOdometry(BodyTwist(NAN, 0.0, 0.0)), "/base/odom", "a number is not finite"),
    (BaseOdometry(BodyTwist(0.0, 0.0, math.inf)), "/base/odom", "a number is not finite"),
])  # fmt: skip
def test_what_is_flawed_is_on_a_topic_of_its_own_with_the_reason(value, topic, flaw):
    [(where, time_ns, message)] = logged(value)
    assert where == "/base/flawed"
    assert (message.topic, message.flaw, time_ns, stamp_of(message)) == (topic, flaw, ARRIVED_NS, STAMP_NS)
    if isinstance(value, BaseOdometry):
        assert str(message.twist) == str(value.twist)
    else:
        assert str(message.pose) == str(value.pose)


def test_the_clock_of_the_base_is_logged_where_it_is_known():
    found: list[Any] = []
    log = GateLog(lambda kind, _, payload: found.append(CHANNELS[kind].cdr_type.decode(payload)), OFFSET_NS)
    log.clock(7, None)
    assert not found
    log.clock(7, ClockOffset(-0.25, 0.001))
    assert (found[0].ahead_s, found[0].within_s) == (-0.25, 0.001)
