"""An arm at rest, for a UR10 emulator that runs without a world."""

from __future__ import annotations

from robot_io.messages import Joints
from sim_backend.world.plant import ArmTruth

HELD_POSE_RAD: Joints = (1.5708, -0.1745, 1.5708, -1.3963, 1.5708, 1.3100)
"""The pose in which the paper's authors hold their arm."""


class StillArm:
    """An `ArmSource` whose joints (rad) never move."""

    def __init__(self, position: Joints = HELD_POSE_RAD) -> None:
        self._truth = ArmTruth(position, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0))

    def read_arm(self, t_ns: int) -> ArmTruth:
        """Return the joints, the same at every time."""
        return self._truth
