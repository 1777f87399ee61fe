"""Noise of what is measured of a Ridgeback: white and normal, from the seed, another stream for each feed."""

from __future__ import annotations

import random

from robot_io.messages import BodyTwist, Pose2D
from sim_backend.ridgeback.settings import RidgebackSettings

WHEEL_LEVER_M = 0.5945
"""Half the wheelbase and half the track of a Ridgeback (0.638 m and 0.551 m): the same error of the wheels' speeds
gives a turn rate of 1 over this."""


class FeedNoise:
    """Adds noise to the samples of one feed; a feed without noise draws nothing."""

    def __init__(self, settings: RidgebackSettings, feed: str) -> None:
        self._gauss = random.Random(f"{feed}-{settings.seed}").gauss
        self._place_m, self._yaw_rad = settings.mocap_noise_m, settings.mocap_noise_rad
        self._speed = settings.odometry_noise_m_per_s

    def pose(self, pose: Pose2D) -> Pose2D:
        """Return the pose as motion capture sees it (m, rad)."""
        if not self._place_m and not self._yaw_rad:
            return pose
        g = self._gauss
        return Pose2D(pose.x + g(0.0, self._place_m), pose.y + g(0.0, self._place_m), pose.yaw + g(0.0, self._yaw_rad))

    def twist(self, twist: BodyTwist) -> BodyTwist:
        """Return the velocity as the wheels measure it: standing encoders count nothing, so rest has no noise."""
        if not self._speed or twist == BodyTwist():
            return twist
        g, speed = self._gauss, self._speed
        return BodyTwist(
            twist.vx + g(0.0, speed), twist.vy + g(0.0, speed), twist.omega + g(0.0, speed / WHEEL_LEVER_M)
        )
