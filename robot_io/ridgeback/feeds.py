"""Which topics a Ridgeback is read from, and what becomes of their messages; pure.

A pose is flawed when its message is (null, no upright unit quaternion), or when it comes in another frame than
the rig names or the first message had. Poses from motion capture are moved from the markers to the base; poses
from odometry count from where the base stood at the first message.
"""

from __future__ import annotations

import msgspec

from robot_io.errors import ConfigError
from robot_io.geometry import base_pose_from_marker, compose, inverse
from robot_io.messages import BaseFeed, BaseOdometry, BasePose, BaseReport, CommandEcho, Pose2D, SliderPose, Stamped
from robot_io.ridgeback.rosbridge_codec import Published, spell_type
from robot_io.ridgeback.rosbridge_messages import (
    PoseReading,
    decode_joint_states,
    decode_odometry,
    decode_status,
    decode_transform,
    decode_twist,
)
from robot_io.rig.topics import TopicsConfig


def with_full_names(topics: TopicsConfig) -> TopicsConfig:
    """Return the same topics with every name beginning with a slash: rosapi compares names as they are written."""
    names = ("command", "odometry", "base_pose", "joint_states", "status", "slider_pose")
    written = {name: getattr(topics, name) for name in names}
    return msgspec.structs.replace(topics, **{name: f"/{text.lstrip('/')}" for name, text in written.items() if text})


def feed_types(topics: TopicsConfig, pose_source: str) -> dict[str, str]:
    """Return topic -> message type of everything that is read. Raises ConfigError when a needed topic is missing."""
    pose_topic, pose_type, supported = {
        "mocap": (topics.base_pose, topics.base_pose_type, "TransformStamped"),
        "odometry": (topics.odometry, topics.odometry_type, "Odometry"),
        "joint_states": (topics.joint_states, topics.joint_states_type, "JointState"),
    }[pose_source]
    if not pose_topic:
        raise ConfigError(
            f"no topic for the base pose with pose_source {pose_source!r}",
            where="base.topics",
            do="Name it, or choose another pose_source",
        )
    for topic, type_name, wanted in (
        (pose_topic, pose_type, supported),
        (topics.odometry, topics.odometry_type, "Odometry"),
        (topics.status, topics.status_type, "Status"),
        (topics.slider_pose, topics.slider_pose_type, "TransformStamped"),
        (topics.command, topics.command_type, "Twist or TwistStamped"),
    ):
        if topic and type_name.rpartition("/")[2] not in wanted.split(" or "):
            raise ConfigError(
                f"{topic}: messages of type {type_name} cannot be used here",
                where="base.topics",
                do=f"This program accepts {wanted}",
            )
    types = {
        pose_topic: pose_type,
        topics.odometry: topics.odometry_type,
        topics.status: topics.status_type,
        topics.slider_pose: topics.slider_pose_type,
    }
    return {topic: spell_type(type_name, topics.ros_version) for topic, type_name in types.items() if topic}


class FeedReader:
    """Turns published messages into stamped samples; counts them by kind."""

    def __init__(self, topics: TopicsConfig, pose_source: str, base_from_marker: Pose2D) -> None:
        self._topics = topics
        self._pose_source = pose_source
        self._base_from_marker = base_from_marker
        self._pose_topic = {
            "mocap": topics.base_pose,
            "odometry": topics.odometry,
            "joint_states": topics.joint_states,
        }[pose_source]
        self._required = tuple(dict.fromkeys(t for t in (self._pose_topic, topics.odometry, topics.status) if t))
        self.reset()

    def reset(self) -> None:
        """Forget everything heard so far."""
        self.counters = dict.fromkeys(("pose", "pose_flawed", "odometry", "status", "slider", "echo", "unasked"), 0)
        self._heard: set[str] = set()
        self._frames: dict[str, tuple[str, str]] = {}
        self._first_frame = ""
        self._origin: Pose2D | None = None

    @property
    def pose_frame(self) -> str:
        """Return the frame that the first pose came in, "" before it."""
        return self._first_frame

    def silent_topics(self) -> list[str]:
        """Return the required topics on which nothing usable has come yet."""
        return [topic for topic in self._required if topic not in self._heard]

    def read(self, message: Published, received_ns: int) -> list[Stamped[BaseFeed]]:
        """Return the samples of one message (odometry may give two). Raises ValueError when it is not as expected."""
        topic, samples = message.topic, list[Stamped[BaseFeed]]()
        topics = self._topics
        if topic == topics.odometry:
            odometry = decode_odometry(message.msg)
            value = BaseOdometry(odometry.twist, odometry.pose)
            samples.append(self._stamped("odometry", value, received_ns, odometry.reading))
            if self._pose_source == "odometry":
                samples.append(self._base_pose(odometry.reading, received_ns))
        elif topic == self._pose_topic:
            decode = decode_transform if self._pose_source == "mocap" else decode_joint_states
            samples.append(self._base_pose(decode(message.msg), received_ns))
        elif topic == topics.status:
            samples.append(self._stamped("status", BaseReport(decode_status(message.msg)), received_ns))
        elif topic == topics.slider_pose:
            reading = decode_transform(message.msg)
            slider = SliderPose(reading.pose, reading.flaw or self._wrong_frame(topic, reading))
            samples.append(self._stamped("slider", slider, received_ns, reading))
        elif topic == topics.command:
            echo = CommandEcho(decode_twist(message.msg, topics.command_type))
            samples.append(self._stamped("echo", echo, received_ns))
        else:
            self.counters["unasked"] += 1
        self._heard.add(topic)
        return samples

    def _base_pose(self, reading: PoseReading, received_ns: int) -> Stamped[BaseFeed]:
        flaw = reading.flaw or self._wrong_frame(self._pose_topic, reading)
        self._first_frame = self._first_frame or reading.frame
        pose = reading.pose
        if flaw:
            self.counters["pose_flawed"] += 1
        elif self._pose_source == "mocap":
            pose = base_pose_from_marker(pose, self._base_from_marker)
        elif self._pose_source == "odometry":
            if self._origin is None:
                self._origin = inverse(pose)
            pose = compose(self._origin, pose)
        return self._stamped("pose", BasePose(pose, flaw), received_ns, reading)

    def _wrong_frame(self, topic: str, reading: PoseReading) -> str:
        frames = (reading.frame, reading.child_frame)
        first = self._frames.setdefault(topic, (self._topics.world_frame or reading.frame, reading.child_frame))
        return (
            "" if frames == first else f"pose of {frames[1]!r} in {frames[0]!r}, expected {first[1]!r} in {first[0]!r}"
        )

    def _stamped(
        self, kind: str, value: BaseFeed, received_ns: int, reading: PoseReading | None = None
    ) -> Stamped[BaseFeed]:
        seq = self.counters[kind]
        self.counters[kind] = seq + 1
        if reading is None:
            return Stamped(value, seq, received_ns)
        return Stamped(value, seq, received_ns, reading.stamp_s, reading.stamp_ns)
