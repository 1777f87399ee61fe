"""What becomes of the base's messages: rule of frames, origin of odometry, what counts as heard. JSON by hand."""

import json
import math

import pytest

from robot_io.messages import BasePose, Pose2D
from robot_io.ridgeback.feeds import FeedReader
from robot_io.ridgeback.rosbridge_codec import Published
from robot_io.rig.topics import TopicsConfig

TOPICS = TopicsConfig(base_pose="/vicon/a/a", odometry="/odom", status="")


def vicon(frame: str = "/world", child: str = "vicon/a/a", x: float | None = 1.0) -> Published:
    message = {
        "header": {"seq": 1, "stamp": {"secs": 5, "nsecs": 0}, "frame_id": frame},
        "child_frame_id": child,
        "transform": {"translation": {"x": x, "y": 2.0, "z": 0.3}, "rotation": {"x": 0, "y": 0, "z": 0, "w": 1}},
    }
    return Published("/vicon/a/a", json.dumps(message).encode())


def odometry(x: float | None, y: float, yaw: float) -> Published:
    turned = {"x": 0.0, "y": 0.0, "z": math.sin(yaw / 2), "w": math.cos(yaw / 2)}
    zero = {"x": 0.0, "y": 0.0, "z": 0.0}
    message = {
        "header": {"stamp": {"secs": 5, "nsecs": 0}, "frame_id": "odom"},
        "child_frame_id": "base_link",
        "pose": {"pose": {"position": {"x": x, "y": y, "z": 0.0}, "orientation": turned}},
        "twist": {"twist": {"linear": zero, "angular": zero}},
    }
    return Published("/odom", json.dumps(message).encode())


def poses(reader: FeedReader, message: Published) -> list[BasePose]:
    return [sample.value for sample in reader.read(message, 0) if isinstance(sample.value, BasePose)]


def test_a_pose_in_another_frame_than_the_first_is_flawed():
    reader = FeedReader(TOPICS, "mocap", Pose2D())
    assert [poses(reader, vicon())[0].valid for _ in range(2)] == [True, True]
    [moved] = poses(reader, vicon(frame="/map"))
    assert moved.flaw == "pose of 'vicon/a/a' in '/map', expected 'vicon/a/a' in '/world'"
    [other] = poses(reader, vicon(child="vicon/b/b"))
    assert "expected 'vicon/a/a'" in other.flaw
    assert poses(reader, vicon())[0].valid
    assert reader.counters["pose_flawed"] == 2


def test_the_frame_of_the_first_pose_is_told():
    reader = FeedReader(TOPICS, "mocap", Pose2D())
    assert reader.pose_frame == ""
    for frame in ("/world", "/map"):
        reader.read(vicon(frame), 0)
    assert reader.pose_frame == "/world"
    reader.reset()
    assert reader.pose_frame == ""


def test_the_frame_that_a_rig_names_counts_from_the_first_message_on():
    reader = FeedReader(TopicsConfig(base_pose="/vicon/a/a", world_frame="/map"), "mocap", Pose2D())
    assert "expected 'vicon/a/a' in '/map'" in poses(reader, vicon())[0].flaw
    assert poses(reader, vicon(frame="/map"))[0].valid


def test_after_a_reset_the_first_message_counts_again():
    reader = FeedReader(TOPICS, "mocap", Pose2D())
    assert poses(reader, vicon())[0].valid
    reader.reset()
    assert poses(reader, vicon(frame="/map"))[0].valid


def test_odometry_counts_from_the_first_pose_that_can_be_used():
    reader = FeedReader(TOPICS, "odometry", Pose2D())
    assert not poses(reader, odometry(None, 0.0, 0.0))[0].valid
    [first] = poses(reader, odometry(3.0, 4.0, math.pi / 2))
    assert (first.pose.x, first.pose.y, first.pose.yaw) == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)
    [ahead] = poses(reader, odometry(3.0, 4.5, math.pi / 2))  # half a metre along its own heading
    assert (ahead.pose.x, ahead.pose.y, ahead.pose.yaw) == pytest.approx((0.5, 0.0, 0.0), abs=1e-12)


def test_only_a_message_that_can_be_read_is_heard():
    reader = FeedReader(TOPICS, "mocap", Pose2D())
    with pytest.raises(ValueError):
        reader.read(Published("/vicon/a/a", b'{"header": 1}'), 0)
    assert reader.silent_topics() == ["/vicon/a/a", "/odom"]
    reader.read(vicon(), 0)
    assert reader.silent_topics() == ["/odom"]


def test_what_was_not_asked_for_is_counted():
    reader = FeedReader(TOPICS, "mocap", Pose2D())
    assert reader.read(Published("/elsewhere", b"{}"), 0) == []
    assert reader.counters["unasked"] == 1


def test_what_odometry_says_of_its_pose_comes_along_in_its_own_frame_and_its_stamp_to_the_ns():
    message = json.loads(odometry(3.0, 4.0, 0.0).msg)
    message["header"]["stamp"] = {"secs": 1_700_000_000, "nsecs": 123_456_789}
    message["pose"]["covariance"] = [n / 8 for n in range(36)]
    message["twist"]["covariance"] = [None, *[0.5] * 35]
    [sample] = FeedReader(TOPICS, "mocap", Pose2D()).read(Published("/odom", json.dumps(message).encode()), 0)
    came = sample.value.pose
    assert (came.frame, came.child_frame, came.position) == ("odom", "base_link", (3.0, 4.0, 0.0))
    assert came.orientation == (0.0, 0.0, 0.0, 1.0)
    assert came.covariance == tuple(n / 8 for n in range(36))
    assert came.twist_covariance == (0.0,) * 36, "one with a null says nothing"
    assert sample.stamp_ns == sample.epoch_ns == 1_700_000_000_123_456_789


def test_odometry_with_a_null_in_its_pose_has_none_and_keeps_its_velocity():
    [sample] = FeedReader(TOPICS, "mocap", Pose2D()).read(odometry(None, 4.0, 0.0), 0)
    assert sample.value.pose is None
    assert sample.value.twist.vx == 0.0


@pytest.mark.parametrize("secs", [0, 5, 946_684_799, 2**31, 2**32 - 1])
def test_a_stamp_of_no_wall_clock_is_kept_but_is_no_time_of_day(secs):
    message = json.loads(odometry(1.0, 4.0, 0.0).msg)
    message["header"]["stamp"] = {"secs": secs, "nsecs": 7}
    [sample] = FeedReader(TOPICS, "mocap", Pose2D()).read(Published("/odom", json.dumps(message).encode()), 0)
    assert sample.stamp_ns == secs * 10**9 + 7
    assert sample.epoch_ns == 0
