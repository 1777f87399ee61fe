"""What a recorder learns of a whole run while it writes it: how old messages were, and where the object went."""

from __future__ import annotations

from robot_io.errors import LogDamaged
from robot_io.geometry import yaw_from_quaternion
from robot_io.log.channels import CHANNELS, Kind
from robot_io.log.messages import BASE_CLOCK
from robot_io.log.ros_messages import POSE_STAMPED
from robot_io.messages import Pose2D
from tools.log.stamp_ages import Latency, StampAges

STAMPED = (Kind.BASE_POSE, Kind.SLIDER_POSE, Kind.BASE_ODOM)
"""Records that have their sender's stamp."""


class Heard:
    """Ages of the stamped messages, the clock of the base's computer, the object's first and last pose."""

    def __init__(self) -> None:
        self._ages = {CHANNELS[kind].topic: StampAges() for kind in STAMPED}
        self._object: tuple[bytes, bytes] | None = None
        self.clock: bytes | None = None
        """The record that says how far that clock is ahead."""

    @property
    def object_poses(self) -> tuple[Pose2D, Pose2D] | None:
        """The first and the last pose of the object, WORLD frame; None if no valid one was written."""
        if self._object is None:
            return None
        first, last = (_planar(payload) for payload in self._object)
        return (first, last) if first and last else None

    @property
    def latencies(self) -> dict[str, Latency]:
        """How old the messages of the base and the motion capture were when they arrived, by topic."""
        ahead_s, within_s = None, 0.0
        if self.clock is not None:
            clock = BASE_CLOCK.decode(self.clock)
            ahead_s, within_s = clock.ahead_s, clock.within_s
        found = {topic: ages.latency(ahead_s, within_s) for topic, ages in self._ages.items()}
        return {topic: latency for topic, latency in found.items() if latency is not None}

    def stamped(self, kind: int, payload: bytes, log_time_ns: int) -> None:
        """Take one of the `STAMPED` records."""
        self._ages[CHANNELS[kind].topic].note(payload, log_time_ns)

    def object_at(self, payload: bytes) -> None:
        """Take a pose of the object."""
        self._object = (self._object[0] if self._object else payload, payload)

    def clock_of_base(self, payload: bytes) -> None:
        """Take the record of that clock. Raises LogDamaged if it cannot be decoded."""
        BASE_CLOCK.decode(payload)
        self.clock = payload


def _planar(payload: bytes) -> Pose2D | None:
    """Return a pose on the floor, None if the message cannot be decoded or lies on its side."""
    try:
        pose = POSE_STAMPED.decode(payload).pose
    except LogDamaged:
        return None
    turned = pose.orientation
    yaw = yaw_from_quaternion(turned.x, turned.y, turned.z, turned.w)
    return None if yaw is None else Pose2D(pose.position.x, pose.position.y, yaw)
