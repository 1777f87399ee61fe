"""Mounting of the sensor on the flange, from the weight of the tool in several poses of the arm. Pure.

In pose i gravity points along g_i in the frame of the flange, so that the sensor reads bias + weight * R' g_i, where R
is flange_from_sensor. Differences from the mean are free of the bias: R and the weight follow by least squares.
How the arm is turned about the vertical on its base does not show in this: gravity looks the same from every side, as
it does when the base turns on a flat floor. So the yaw of base_from_sensor stays as the rig has it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from robot_io.messages import Joints
from robot_io.rig.types import Matrix3
from tools.calibrate.estimators.estimate import (
    Array,
    CannotCalibrate,
    Estimate,
    K,
    angle_between_deg,
    rows_of,
    turned_about_vertical,
)
from tools.calibrate.estimators.steady import Steady
from tools.calibrate.estimators.ur10_rotation import base_from_flange

FEWEST = 3
LEAST_SPREAD = 0.35
"""Second singular value of the gravity directions: about 30 degrees out of one line."""
LEAST_WEIGHT_N = 2.0
MOST_MISFIT = 5.0
"""Residual over what noise explains, from which on the poses contradict each other."""
MISFIT_FLOOR_N = 0.15
SETTING_RAD = math.radians(0.05)
"""1 sigma of a pose: the arm's own calibration against the published figures."""


class Pose(NamedTuple):
    """One pose of the arm: its joints (rad), and what the sensor read there at rest."""

    joints: Joints
    reading: Steady


def estimate_mounting(poses: Sequence[Pose], held_rad: Joints, base_from_sensor: Matrix3) -> Estimate:
    """Return base_from_sensor with its two tilts as the weight shows them, and its yaw as the rig has it.

    held_rad: joints for which the rig's frames are given. Value: how far the rig's tilt is off, degrees.
    Raises CannotCalibrate: fewer than 3 poses, poses too much alike, a tool too light, poses that contradict.
    """
    if len(poses) < FEWEST:
        raise CannotCalibrate(f"{len(poses)} poses are too few, {FEWEST} are needed", do="Move the arm to more poses")
    gravity = np.array([base_from_flange(pose.joints).T @ np.array([0.0, 0.0, -1.0]) for pose in poses])
    forces = np.array([pose.reading.mean[:3] for pose in poses])
    apart, felt = gravity - gravity.mean(axis=0), forces - forces.mean(axis=0)
    if np.linalg.svd(apart, compute_uv=False)[1] < LEAST_SPREAD:
        raise CannotCalibrate(
            "the poses are too much alike: the tool's weight must pull along clearly different directions",
            do="Turn the last two joints by 60 degrees and more between poses",
        )
    flange_from_sensor = _kabsch(felt, apart)
    turned = felt @ flange_from_sensor.T
    weight = float((turned * apart).sum() / (apart**2).sum())
    if weight < LEAST_WEIGHT_N:
        raise CannotCalibrate(
            f"the tool weighs {weight:.1f} N, at least {LEAST_WEIGHT_N:g} N are needed",
            do="Fix a weight to the tool for this measurement",
        )
    error_n = math.sqrt(float(np.mean([pose.reading.error[:3] ** 2 for pose in poses])) + (weight * SETTING_RAD) ** 2)
    misfit = float(np.sqrt(((turned - weight * apart) ** 2).sum() / max(1, 3 * len(poses) - 7)))
    if misfit > max(MOST_MISFIT * error_n, MISFIT_FLOOR_N):
        raise CannotCalibrate(
            f"the poses contradict each other by {misfit:.2f} N",
            do="Wait until the arm rests, keep hands and cables off the tool, and measure again",
        )
    covariance = _covariance(apart, weight, max(error_n, misfit if len(poses) > FEWEST else 0.0))
    return _result(poses, flange_from_sensor, weight, misfit, covariance, held_rad, base_from_sensor)


def _kabsch(felt: Array, wanted: Array) -> Array:
    """Return the rotation R that brings R @ felt closest to wanted (rows), both centred."""
    u, _, v = np.linalg.svd(wanted.T @ felt)
    return np.asarray(u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ v))]) @ v)


def _covariance(apart: Array, weight: float, error_n: float) -> Array:
    """Return the covariance (rad^2, flange frame) of the rotation's error; weight and bias are unknowns beside it."""
    rows = []
    for x, y, z in apart:
        cross = weight * np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
        rows.append(np.hstack([cross, np.array([[x], [y], [z]])]))
    design = np.vstack(rows)
    return np.asarray(np.linalg.pinv(design.T @ design)[:3, :3] * error_n**2)


def _result(
    poses: Sequence[Pose],
    flange_from_sensor: Array,
    weight: float,
    misfit: float,
    covariance: Array,
    held_rad: Joints,
    base_from_sensor: Matrix3,
) -> Estimate:
    arm_from_flange = base_from_flange(held_rad)
    measured, now = arm_from_flange @ flange_from_sensor, np.array(base_from_sensor)
    # The turn about the vertical that brings the measured mounting closest to the rig's: the yaw that stays.
    both = measured @ now.T
    unseen = math.atan2(both[0, 1] - both[1, 0], both[0, 0] + both[1, 1])
    mended = turned_about_vertical(unseen) @ measured
    in_body = turned_about_vertical(unseen) @ arm_from_flange
    tilts = (in_body @ covariance @ in_body.T)[:2, :2]
    uncertainty = K * math.degrees(math.sqrt(float(np.trace(tilts))))
    off = mended @ now.T
    tilt = np.degrees([off[2, 1] - off[1, 2], off[0, 2] - off[2, 0]]) / 2.0
    return Estimate(
        "frame",
        (angle_between_deg(now, mended),),
        (uncertainty,),
        "deg",
        (math.degrees(misfit / weight),),
        f"weight of the tool ({weight:.2f} N) in {len(poses)} poses",
        {"frames.base_from_sensor": rows_of(mended)},
        (
            f"the sensor is tilted by {tilt[0]:+.2f} degrees about forward and {tilt[1]:+.2f} degrees about left",
            "yaw about the vertical is unseen and stays as the rig has it: gravity cannot show how the arm is turned "
            "on its base, nor can turning the base on a flat floor; `push calibrate frame --cord` measures it",
        ),
        "yaw",
    )
