"""Pose of a UR arm's flange as its controller reports it: a place and a rotation vector."""

from __future__ import annotations

import math

from robot_io.messages import Joints
from sim_backend.ur10.models import UrModel
from sim_backend.world.arm_geometry import flange

Pose6 = tuple[float, float, float, float, float, float]


def flange_pose(q: Joints, model: UrModel) -> Pose6:
    """Return x, y, z (m) and rotation vector (rad) of the flange in the arm's base frame, from `q` (rad)."""
    rotation, (x, y, z) = flange(q, model.d_m, model.a_m)
    return (x, y, z, *rotation_vector(rotation))


Row = tuple[float, float, float]
Matrix = tuple[Row, Row, Row]


def rotation_vector(r: Matrix) -> Row:
    """Return axis times angle (rad) of a rotation matrix."""
    cosine = max(-1.0, min(1.0, (r[0][0] + r[1][1] + r[2][2] - 1.0) / 2.0))
    angle = math.acos(cosine)
    if angle < 1e-9:
        return (0.0, 0.0, 0.0)
    if math.pi - angle < 1e-6:  # the skew part vanishes at half a turn: take the axis from the diagonal
        ax, ay, az = (math.sqrt(max(0.0, (r[i][i] + 1.0) / 2.0)) for i in range(3))
        if ax >= ay and ax >= az:
            ay, az = math.copysign(ay, r[0][1]), math.copysign(az, r[0][2])
        elif ay >= az:
            ax, az = math.copysign(ax, r[0][1]), math.copysign(az, r[1][2])
        else:
            ax, ay = math.copysign(ax, r[0][2]), math.copysign(ay, r[1][2])
        return (ax * angle, ay * angle, az * angle)
    scale = angle / (2.0 * math.sin(angle))
    return (scale * (r[2][1] - r[1][2]), scale * (r[0][2] - r[2][0]), scale * (r[1][0] - r[0][1]))
