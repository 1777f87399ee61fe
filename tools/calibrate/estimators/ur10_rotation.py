"""Which way the flange of a UR10 points, from its joints: Denavit-Hartenberg parameters as Universal Robots publishes.

Only the twists matter to a rotation (alpha: +90, 0, 0, +90, -90, 0 degrees). An arm's own calibration differs from them
by a few hundredths of a degree.
"""

from __future__ import annotations

import math
from functools import reduce

import numpy as np

from robot_io.messages import Joints
from tools.calibrate.estimators.estimate import Array

TWISTS_RAD = (math.pi / 2, 0.0, 0.0, math.pi / 2, -math.pi / 2, 0.0)


def base_from_flange(joints: Joints) -> Array:
    """Return the rotation (3x3) of the flange in the frame of the arm's own base, for `joints` in rad."""
    turns = [_about_z(q) @ _about_x(twist) for q, twist in zip(joints, TWISTS_RAD, strict=True)]
    return reduce(np.matmul, turns)


def _about_z(angle: float) -> Array:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _about_x(angle: float) -> Array:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
