"""What an odometry message says beside the velocity that is used: for the log."""

from __future__ import annotations

import math

import msgspec

NO_COVARIANCE = (0.0,) * 36
"""All zero says nothing of the covariance, as ROS has it (nav_msgs/Odometry)."""


class OdometryPose(msgspec.Struct, frozen=True, gc=False):
    """Pose and covariances of an odometry message as they came, in the frame that the sender names; all finite."""

    frame: str
    child_frame: str
    position: tuple[float, float, float]
    """m."""
    orientation: tuple[float, float, float, float]
    """Quaternion x y z w."""
    covariance: tuple[float, ...] = NO_COVARIANCE
    """6x6 of the pose, row by row: x y z, rotations about x y z."""
    twist_covariance: tuple[float, ...] = NO_COVARIANCE

    @property
    def whole(self) -> bool:
        """Return whether all numbers are there and finite, as a standard message needs them."""
        parts = (self.position, self.orientation, self.covariance, self.twist_covariance)
        return tuple(map(len, parts)) == (3, 4, 36, 36) and all(math.isfinite(x) for part in parts for x in part)
