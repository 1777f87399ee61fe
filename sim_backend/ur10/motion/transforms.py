"""Poses as URScript has them, x, y, z (m) and rotation vector (rad), and as rotation matrix and place."""

from __future__ import annotations

import math

from robot_io.messages import Vector3
from robot_io.rig.types import Matrix3

Pose6 = tuple[float, float, float, float, float, float]
Frame = tuple[Matrix3, Vector3]
"""Rotation (rows) and origin (m)."""


def frame_of(pose: Pose6) -> Frame:
    """Return a pose as rotation and origin."""
    x, y, z, rx, ry, rz = pose
    return matrix_of((rx, ry, rz)), (x, y, z)


def pose_of(frame: Frame) -> Pose6:
    """Return rotation and origin as a pose."""
    rotation, (x, y, z) = frame
    return (x, y, z, *rotation_vector(rotation))


def chained(first: Frame, second: Frame) -> Frame:
    """Return `second`, given in `first`, in the frame that `first` is given in (URScript's pose_trans)."""
    (r, p), (s, q) = first, second
    x, y, z = turned(r, q)
    return times(r, s), (p[0] + x, p[1] + y, p[2] + z)


def inverse(frame: Frame) -> Frame:
    """Return the frame that undoes `frame`."""
    r, p = frame
    back = transposed(r)
    x, y, z = turned(back, p)
    return back, (-x, -y, -z)


def times(left: Matrix3, right: Matrix3) -> Matrix3:
    """Return the product of two matrices."""
    columns = transposed(right)
    a, b, c = (turned(columns, row) for row in left)
    return a, b, c


def turned(r: Matrix3, v: Vector3) -> Vector3:
    """Return matrix times vector."""
    x, y, z = v
    a, b, c = (row[0] * x + row[1] * y + row[2] * z for row in r)
    return a, b, c


def transposed(r: Matrix3) -> Matrix3:
    """Return the transpose; of a rotation, its inverse."""
    (a, b, c), (d, e, f), (g, h, i) = r
    return (a, d, g), (b, e, h), (c, f, i)


def matrix_of(vector: Vector3) -> Matrix3:
    """Return the rotation about a vector by its length (rad)."""
    x, y, z = vector
    angle = math.sqrt(x * x + y * y + z * z)
    if angle < 1e-12:
        return (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
    x, y, z = x / angle, y / angle, z / angle
    c, s = math.cos(angle), math.sin(angle)
    k = 1.0 - c
    return (
        (c + x * x * k, x * y * k - z * s, x * z * k + y * s),
        (y * x * k + z * s, c + y * y * k, y * z * k - x * s),
        (z * x * k - y * s, z * y * k + x * s, c + z * z * k),
    )


def rotation_vector(r: Matrix3) -> Vector3:
    """Return axis times angle (rad) of a rotation matrix."""
    skew = (r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1])
    angle = math.atan2(math.hypot(*skew), r[0][0] + r[1][1] + r[2][2] - 1.0)
    if angle < 1e-9:
        return (skew[0] / 2.0, skew[1] / 2.0, skew[2] / 2.0)
    if math.pi - angle < 1e-6:  # the skew part vanishes at half a turn: take the axis from the diagonal
        ax, ay, az = (math.sqrt(max(0.0, (r[i][i] + 1.0) / 2.0)) for i in range(3))
        if ax >= ay and ax >= az:
            ay, az = math.copysign(ay, r[0][1]), math.copysign(az, r[0][2])
        elif ay >= az:
            ax, az = math.copysign(ax, r[0][1]), math.copysign(az, r[1][2])
        else:
            ax, ay = math.copysign(ax, r[0][2]), math.copysign(ay, r[1][2])
        return (ax * angle, ay * angle, az * angle)
    scale = angle / math.hypot(*skew)
    return (scale * skew[0], scale * skew[1], scale * skew[2])
