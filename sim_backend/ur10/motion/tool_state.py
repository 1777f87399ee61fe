"""Pose and speed of the tool, worked out once for all who ask in a control cycle."""

from __future__ import annotations

from robot_io.messages import Joints
from sim_backend.ur10.models import UrModel
from sim_backend.ur10.motion.kinematics import tool_pose, tool_speed
from sim_backend.ur10.motion.transforms import Pose6


class ToolState:
    """The tool of one arm."""

    def __init__(self, model: UrModel) -> None:
        self._model = model
        self._cause: tuple[Joints, Joints, Pose6] | None = None
        self._state: tuple[Pose6, Pose6] = ((0.0,) * 6, (0.0,) * 6)

    def now(self, q: Joints, qd: Joints, tcp: Pose6) -> tuple[Pose6, Pose6]:
        """Return pose (m, rotation vector in rad) and speed (m/s, rad/s) for joints and the tool's offset."""
        if self._cause != (q, qd, tcp):
            self._cause = (q, qd, tcp)
            self._state = tool_pose(q, self._model, tcp), tool_speed(q, qd, self._model, tcp)
        return self._state
