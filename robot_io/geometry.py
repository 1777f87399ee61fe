"""Planar poses, pure: heading of a quaternion, composition and inverse of poses on the floor."""

from __future__ import annotations

import math

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
    """Return the angle (rad) in (-pi, pi]."""
    turned = math.remainder(angle, math.tau)
    return turned if turned > -math.pi else math.pi


def compose(outer: Pose2D, inner: Pose2D) -> Pose2D:
    """Return `inner`, given in the frame of `outer`, in the frame in which `outer` is given."""
    cosine, sine = math.cos(outer.yaw), math.sin(outer.yaw)
    return Pose2D(
        outer.x + cosine * inner.x - sine * inner.y,
        outer.y + sine * inner.x + cosine * inner.y,
        wrap_angle(outer.yaw + inner.yaw),
    )


def inverse(pose: Pose2D) -> Pose2D:
    """Return the pose of the outer frame as seen from `pose`."""
    cosine, sine = math.cos(pose.yaw), math.sin(pose.yaw)
    return Pose2D(-cosine * pose.x - sine * pose.y, sine * pose.x - cosine * pose.y, wrap_angle(-pose.yaw))


def base_pose_from_marker(marker_in_world: Pose2D, base_from_marker: Pose2D) -> Pose2D:
    """Return the pose of the base from the pose of its markers, which sit at `base_from_marker` in the BODY frame."""
    return compose(marker_in_world, inverse(base_from_marker))
