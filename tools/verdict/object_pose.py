"""Where the object is at the end of a run, beside the path: its own error, whatever the pusher's is."""

from __future__ import annotations

import math
from typing import NamedTuple

from robot_io.geometry import StraightPath, wrap_angle
from robot_io.messages import Pose2D
from robot_io.rig.task import PathConfig


class ObjectPose(NamedTuple):
    """The object's offset from the path (m), and how far it has turned since its first known pose (rad)."""

    lateral_m: float
    turned_rad: float


def object_pose(path: PathConfig, poses: tuple[Pose2D, Pose2D] | None) -> ObjectPose | None:
    """Return the object's place from its first and its last pose (WORLD frame); None where they are not known."""
    if poses is None:
        return None
    first, last = poses
    if not all(map(math.isfinite, (last.x, last.y, last.yaw, first.yaw))):
        return None
    line = StraightPath.of(path.origin_m, path.direction_deg)
    return ObjectPose(line.lateral(last.x, last.y), wrap_angle(last.yaw - first.yaw))
