"""The legs of movej and movel, from what a program gives: clamped to what the joints do. Pure."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from robot_io.messages import Joints
from sim_backend.ur10.models import UrModel
from sim_backend.ur10.motion.commands import JointLeg, Leg, OutOfReach, ToolLeg, joints
from sim_backend.ur10.motion.kinematics import joints_at, tool_pose
from sim_backend.ur10.motion.transforms import Pose6

LegFrom = Callable[[Joints], Leg]


class Way(NamedTuple):
    """How to get there: speed, acceleration (of the leading joint, or of the tool), or a time (s) instead if not 0."""

    speed: float
    acceleration: float
    time_s: float = 0.0


def joint_move(target: Joints, way: Way, model: UrModel) -> LegFrom:
    """Return a leg straight in joint space; no joint goes faster than it can, nor beyond its range."""
    end = within_range(target, model)

    def leg(start: Joints) -> Leg:
        far = [abs(b - a) for a, b in zip(start, end, strict=True)]
        furthest = max(far)
        limits = [limit * furthest / d for limit, d in zip(model.speed_rad_per_s, far, strict=True) if d > 0.0]
        return JointLeg(start, end, min([way.speed, *limits]), way.acceleration, way.time_s)

    return leg


def joint_move_to_pose(pose: Pose6, way: Way, model: UrModel, tcp: Pose6) -> LegFrom:
    """Return a leg straight in joint space to the joints nearest that bring the tool to `pose`."""

    def leg(start: Joints) -> Leg:
        target = joints_at(pose, start, model, tcp)
        if target is None:
            raise OutOfReach
        return joint_move(target, way, model)(start)

    return leg


def tool_move(pose: Pose6, way: Way, model: UrModel, tcp: Pose6) -> LegFrom:
    """Return a leg on which the tool goes straight to `pose`."""
    return lambda start: ToolLeg(tool_pose(start, model, tcp), pose, model, tcp, way)


def within_range(q: Joints, model: UrModel) -> Joints:
    """Return joints (rad) no further than they turn; clients command infinity and NaN too."""
    ends = [min(limit, 2.0 * math.pi) if not math.isfinite(angle) else limit for angle, limit in
            zip(q, model.range_rad, strict=True)]  # fmt: skip
    return joints([a if abs(a) <= end else math.copysign(end, a) for a, end in zip(q, ends, strict=True)])
