"""The plane, pure: vectors and points between frames, headings, poses on the floor, and the straight path."""

from __future__ import annotations

import math

import msgspec

from robot_io.messages import Pose2D

UNIT_TOLERANCE = 0.01
"""How far the length of a rotation quaternion may be from 1."""
UPRIGHT_COSINE = 0.9
"""Cosine of the greatest tilt of a body that still stands on the floor (26 degrees); beyond it yaw means nothing."""


def yaw_from_quaternion(x: float, y: float, z: float, w: float) -> float | None:
    """Return the heading (rad, counter-clockwise about the vertical), or None for no upright unit quaternion."""
    length = math.sqrt(x * x + y * y + z * z + w * w)
    if not abs(length - 1.0) <= UNIT_TOLERANCE:  # written so that NaN is refused
        return None
    x, y, z, w = x / length, y / length, z / length, w / length
    if 1.0 - 2.0 * (x * x + y * y) < UPRIGHT_COSINE:
        return None
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def wrap_angle(angle: float) -> float:
    """Return the angle (rad) in (-pi, pi]; NaN stays NaN."""
    turned = math.remainder(angle, math.tau)
    return math.pi if turned == -math.pi else turned


def rotated(x: float, y: float, angle: float) -> tuple[float, float]:
    """Return a vector given in a frame turned by `angle` (rad, counter-clockwise) as seen from outside that frame."""
    cosine, sine = math.cos(angle), math.sin(angle)
    return cosine * x - sine * y, sine * x + cosine * y


def seen_from_frame(x: float, y: float, angle: float) -> tuple[float, float]:
    """Return a vector as seen from a frame turned by `angle` (rad, counter-clockwise): the inverse of `rotated`."""
    cosine, sine = math.cos(angle), math.sin(angle)
    return cosine * x + sine * y, cosine * y - sine * x


def point_outside(frame_x: float, frame_y: float, angle: float, x: float, y: float) -> tuple[float, float]:
    """Return the point (x, y) of a frame at (frame_x, frame_y), turned by `angle` (rad), as seen from outside."""
    cosine, sine = math.cos(angle), math.sin(angle)
    return frame_x + cosine * x - sine * y, frame_y + sine * x + cosine * y


def compose(outer: Pose2D, inner: Pose2D) -> Pose2D:
    """Return `inner`, given in the frame of `outer`, in the frame in which `outer` is given."""
    x, y = point_outside(outer.x, outer.y, outer.yaw, inner.x, inner.y)
    return Pose2D(x, y, wrap_angle(outer.yaw + inner.yaw))


def inverse(pose: Pose2D) -> Pose2D:
    """Return the pose of the outer frame as seen from `pose`."""
    cosine, sine = math.cos(pose.yaw), math.sin(pose.yaw)
    return Pose2D(-cosine * pose.x - sine * pose.y, sine * pose.x - cosine * pose.y, wrap_angle(-pose.yaw))


def base_pose_from_marker(marker_in_world: Pose2D, base_from_marker: Pose2D) -> Pose2D:
    """Return the pose of the base from the pose of its markers, which sit at `base_from_marker` in the BODY frame."""
    return compose(marker_in_world, inverse(base_from_marker))


class StraightPath(msgspec.Struct, frozen=True, gc=False):
    """A line in the WORLD frame: origin in m, heading in rad, and its cosine and sine.

    The PATH frame has its x axis along the direction of travel and y to the left; angles are counter-clockwise.
    """

    origin_x: float
    origin_y: float
    heading: float
    cos: float
    sin: float

    @classmethod
    def of(cls, origin_m: tuple[float, float], direction_deg: float) -> StraightPath:
        """Build the path through a WORLD point in a WORLD direction."""
        heading = math.radians(direction_deg)
        return cls(origin_m[0], origin_m[1], heading, math.cos(heading), math.sin(heading))

    def along(self, x_world: float, y_world: float) -> float:
        """Return how far a WORLD point (m) lies along the path from its origin, in m."""
        return (x_world - self.origin_x) * self.cos + (y_world - self.origin_y) * self.sin

    def lateral(self, x_world: float, y_world: float) -> float:
        """Return the lateral offset of a WORLD point from the path in m, left positive (y_c of the paper)."""
        return (y_world - self.origin_y) * self.cos - (x_world - self.origin_x) * self.sin

    def vector_to_path(self, x_world: float, y_world: float) -> tuple[float, float]:
        """Rotate a WORLD vector into the PATH frame."""
        return x_world * self.cos + y_world * self.sin, y_world * self.cos - x_world * self.sin

    def point_in_world(self, along: float, lateral: float) -> tuple[float, float]:
        """Return a PATH point (m) in the WORLD frame."""
        return (
            self.origin_x + self.cos * along - self.sin * lateral,
            self.origin_y + self.sin * along + self.cos * lateral,
        )

    def direction_in_world(self, theta: float) -> tuple[float, float]:
        """Return the WORLD unit vector of a PATH angle in rad."""
        return math.cos(self.heading + theta), math.sin(self.heading + theta)
