"""Flange of a UR arm from its joints (Denavit-Hartenberg parameters published by Universal Robots), and what it holds.

A real arm has its own calibration, which differs from these by millimetres.
"""

from __future__ import annotations

import math

from robot_io.messages import Joints, Vector3
from robot_io.rig.types import Matrix3

MOUNT_YAW_RAD = math.pi / 2
"""The arm stands on the base turned by +90 degrees about the vertical."""

_NO_LENGTH: Joints = (0.0,) * 6
_SIN_ALPHA = (1.0, 0.0, 0.0, 1.0, -1.0, 0.0)
_COS_ALPHA = (0.0, 1.0, 1.0, 0.0, 0.0, 1.0)
"""The same for every model: so is the flange's rotation."""


def flange(q: Joints, d_m: Joints = _NO_LENGTH, a_m: Joints = _NO_LENGTH) -> tuple[Matrix3, Vector3]:
    """Return rotation (rows) and origin of the flange in the arm's base frame, from `q` (rad) and d and a (m)."""
    r: Matrix3 = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    x = y = z = 0.0
    for i in range(6):
        c, s = math.cos(q[i]), math.sin(q[i])
        sa, ca = _SIN_ALPHA[i], _COS_ALPHA[i]
        px, py, pz = a_m[i] * c, a_m[i] * s, d_m[i]
        x += r[0][0] * px + r[0][1] * py + r[0][2] * pz
        y += r[1][0] * px + r[1][1] * py + r[1][2] * pz
        z += r[2][0] * px + r[2][1] * py + r[2][2] * pz
        r = _times(r, ((c, -s * ca, s * sa), (s, c * ca, -c * sa), (0.0, sa, ca)))
    return r, (x, y, z)


def held_elsewhere(base_from_sensor: Matrix3, held: Joints, q: Joints) -> Matrix3:
    """Return a sensor's rotation against the base with the arm at `q`, from its rotation with the arm at `held`.

    Rotations are rows, joints rad. base_from_sensor(q) = M R(q) R(held)^T M^T base_from_sensor(held), with the flange's
    R and the mounting M of the arm.
    """
    if q == held:
        return base_from_sensor
    c, s = math.cos(MOUNT_YAW_RAD), math.sin(MOUNT_YAW_RAD)
    mount: Matrix3 = ((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0))
    before, after = _times(mount, flange(held)[0]), _times(mount, flange(q)[0])
    return _times(_times(after, _transposed(before)), base_from_sensor)


def _times(left: Matrix3, right: Matrix3) -> Matrix3:
    first, second, third = left
    return _row_times(first, right), _row_times(second, right), _row_times(third, right)


def _row_times(row: Vector3, m: Matrix3) -> Vector3:
    a, b, c = row
    return (
        a * m[0][0] + b * m[1][0] + c * m[2][0],
        a * m[0][1] + b * m[1][1] + c * m[2][1],
        a * m[0][2] + b * m[1][2] + c * m[2][2],
    )


def _transposed(m: Matrix3) -> Matrix3:
    (a, b, c), (d, e, f), (g, h, i) = m
    return (a, d, g), (b, e, h), (c, f, i)
