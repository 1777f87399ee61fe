"""Flange pose of a UR10 from its joints (Denavit-Hartenberg parameters published by Universal Robots).

A real arm has its own calibration, which differs from these by millimetres.
"""

from __future__ import annotations

import math

from robot_io.messages import Joints

Pose6 = tuple[float, float, float, float, float, float]

_D_M = (0.1273, 0.0, 0.0, 0.163941, 0.1157, 0.0922)
_A_M = (0.0, -0.612, -0.5723, 0.0, 0.0, 0.0)
_SIN_ALPHA = (1.0, 0.0, 0.0, 1.0, -1.0, 0.0)
_COS_ALPHA = (0.0, 1.0, 1.0, 0.0, 0.0, 1.0)


def flange_pose(q: Joints) -> Pose6:
    """Return x, y, z (m) and rotation vector (rad) of the flange in the arm's base frame, from `q` (rad)."""
    r = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    x = y = z = 0.0
    for i in range(6):
        c, s = math.cos(q[i]), math.sin(q[i])
        sa, ca = _SIN_ALPHA[i], _COS_ALPHA[i]
        px, py, pz = _A_M[i] * c, _A_M[i] * s, _D_M[i]
        x += r[0][0] * px + r[0][1] * py + r[0][2] * pz
        y += r[1][0] * px + r[1][1] * py + r[1][2] * pz
        z += r[2][0] * px + r[2][1] * py + r[2][2] * pz
        link = ((c, -s * ca, s * sa), (s, c * ca, -c * sa), (0.0, sa, ca))
        r = (_row_times(r[0], link), _row_times(r[1], link), _row_times(r[2], link))
    return (x, y, z, *rotation_vector(r))


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


def _row_times(row: Row, m: Matrix) -> Row:
    a, b, c = row
    return (
        a * m[0][0] + b * m[1][0] + c * m[2][0],
        a * m[0][1] + b * m[1][1] + c * m[2][1],
        a * m[0][2] + b * m[1][2] + c * m[2][2],
    )
