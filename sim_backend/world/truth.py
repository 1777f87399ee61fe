"""What is true in the simulated world where the rig's `[frames]` err: `[frames]` plus `[world.truth]`.

Only the world and the emulators know it. Without errors everything is bit for bit what the rig says.
"""

from __future__ import annotations

import math

from msgspec.structs import replace

from robot_io.geometry import compose, inverse, point_outside, rotated
from robot_io.messages import Pose2D
from robot_io.rig.config import FramesConfig, RigConfig
from robot_io.rig.types import Matrix3, Vector2
from robot_io.rig.world import TruthConfig


def true_frames(rig: RigConfig) -> FramesConfig:
    """Return where sensor, ball and markers are in the world (m, rad, BODY frame)."""
    truth, frames = rig.world.truth, rig.frames
    if truth == TruthConfig():
        return frames
    x, y, z = frames.contact_in_base_m
    ahead, left = truth.contact_offset_m
    marker_x, marker_y, marker_yaw = frames.base_from_marker
    more_x, more_y, more_yaw = truth.marker_offset
    return replace(
        frames,
        base_from_sensor=turned_about_z(frames.base_from_sensor, math.radians(truth.sensor_yaw_deg)),
        contact_in_base_m=(x + ahead, y + left, z),
        base_from_marker=(marker_x + more_x, marker_y + more_y, marker_yaw + more_yaw),
    )


def marker_error(rig: RigConfig) -> Pose2D:
    """Return where a driver that believes the rig takes the base to be, seen from the base."""
    if not any(rig.world.truth.marker_offset):
        return Pose2D()
    true, believed = (Pose2D(*frames.base_from_marker) for frames in (true_frames(rig), rig.frames))
    return compose(true, inverse(believed))


def turned_about_z(rows: Matrix3, angle: float) -> Matrix3:
    """Return a rotation (rows) turned further by `angle` (rad, counter-clockwise) about the z axis outside."""
    if angle == 0.0:
        return rows
    (a, d), (b, e), (c, f) = (rotated(x, y, angle) for x, y in zip(rows[0], rows[1], strict=True))
    return (a, b, c), (d, e, f), rows[2]


def point_of(pose: Pose2D, offset_m: Vector2) -> Pose2D:
    """Return the pose of a frame at `offset_m` in the frame of `pose`, and not turned against it."""
    if not any(offset_m):
        return pose
    return Pose2D(*point_outside(pose.x, pose.y, pose.yaw, *offset_m), pose.yaw)
