"""Mean of poses that motion capture saw of something at rest, with its standard error. Pure."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from robot_io.messages import Pose2D
from tools.calibrate.estimators.estimate import Array, CannotCalibrate

FEWEST = 40
BLOCKS = 10
MOST_MOVED_M = 0.005
MOST_TURNED_RAD = math.radians(0.5)


class MeanPose(NamedTuple):
    """Mean pose (WORLD), and 1 sigma of its place (each coordinate, m) and heading (rad)."""

    pose: Pose2D
    place_error_m: float
    yaw_error_rad: float


def mean_pose(poses: Array, of: str = "the base") -> MeanPose:
    """Return the mean of `poses` (x, y in m, yaw in rad, in rows, in order of time).

    Raises CannotCalibrate for fewer than 40, and where `of` moved meanwhile.
    """
    if len(poses) < FEWEST:
        raise CannotCalibrate(
            f"only {len(poses)} poses of {of} came, at least {FEWEST} are needed", do="Check that its markers are seen"
        )
    first_yaw = float(poses[0, 2])
    flat = np.column_stack([poses[:, :2], np.remainder(poses[:, 2] - first_yaw + math.pi, math.tau) - math.pi])
    quarter = len(flat) // 4
    moved = np.abs(flat[-quarter:].mean(axis=0) - flat[:quarter].mean(axis=0))
    scatter = np.sqrt(2.0 / quarter) * flat.std(axis=0)
    if max(moved[:2] - 4.0 * scatter[:2]) > MOST_MOVED_M or moved[2] - 4.0 * scatter[2] > MOST_TURNED_RAD:
        raise CannotCalibrate(
            f"{of} moved by {1000 * max(moved[:2]):.0f} mm and {math.degrees(moved[2]):.2f} degrees while measured",
            do="Let it stand, and measure again",
        )
    place, yaw = block_error(flat[:, :2]), block_error(flat[:, 2:])
    mean = flat.mean(axis=0)
    return MeanPose(
        Pose2D(float(mean[0]), float(mean[1]), math.remainder(first_yaw + float(mean[2]), math.tau)), place, yaw
    )


def block_error(columns: Array) -> float:
    """Return 1 sigma of the mean of each column, taken together, where neighbouring rows may share their noise."""
    size = len(columns) // BLOCKS
    blocks = columns[: size * BLOCKS].reshape(BLOCKS, size, -1).mean(axis=1)
    alone = columns.var(axis=0, ddof=1)
    factor = float(np.mean(blocks.var(axis=0, ddof=1) * size / np.where(alone > 0.0, alone, 1.0)))
    return math.sqrt(max(1.0, factor) * float(alone.mean()) / len(columns))
