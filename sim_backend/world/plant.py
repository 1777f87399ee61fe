"""The interfaces through which emulated and simulated devices read the world.

Times are CLOCK_MONOTONIC ns (virtual at level `sim`). The world lives on a fixed 1 ms grid and advances to
the requested time before it answers; reading never changes what happens.
"""

from __future__ import annotations

from typing import Protocol

import msgspec

from robot_io.messages import BodyTwist, Joints, Pose2D


class ArmTruth(msgspec.Struct, frozen=True, gc=False):
    """Joints of the arm: rad, rad/s."""

    position: Joints
    velocity: Joints


class BaseTruth(msgspec.Struct, frozen=True, gc=False):
    """Pose of the base in the WORLD frame and the velocity of its wheels in the BODY frame."""

    pose: Pose2D
    twist: BodyTwist
    rolled: Pose2D
    """Where the wheels would have brought the base had they not slipped: the pose that odometry counts."""


class FtSource(Protocol):
    """Source of an FT 300's readings."""

    def read_ft(self, t_ns: int) -> tuple[float, float, float, float, float, float]:
        """Return N, N*m in the SENSOR frame at `t_ns`, with bias, tool weight and noise, not quantised."""
        ...


class ArmSource(Protocol):
    """Source of a UR10's joints."""

    def read_arm(self, t_ns: int) -> ArmTruth:
        """Return the joints at `t_ns`."""
        ...


class BaseSource(Protocol):
    """Source of a Ridgeback's motion, and sink for its wheel commands."""

    def read_base(self, t_ns: int) -> BaseTruth:
        """Return pose and velocity at `t_ns`."""
        ...

    def read_slider(self, t_ns: int) -> Pose2D:
        """Return the pushed object's pose in the WORLD frame at `t_ns` (motion capture)."""
        ...

    def command_base(self, twist: BodyTwist, arrival_ns: int) -> None:
        """Give the wheel controller a new target; NaN is passed on as the real base does."""
        ...

    def set_drivers(self, active: bool, at_ns: int) -> None:
        """Switch the motors on or off (hardware stop)."""
        ...
