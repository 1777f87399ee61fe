"""What the shipped feeds look like at rest and in motion, drawn from their published noise; none of our code is used.

FT 300: 100 a second, 1.2 N and 0.03 N*m (1 sigma, product sheet). Motion capture: 100 a second, 0.5 mm and 0.2 degrees.
"""

import math

import numpy as np

from tools.calibrate.estimators.mean_pose import mean_pose
from tools.calibrate.estimators.steady import steady

SEEDS = range(30)
FORCE_N, TORQUE_NM = 1.2, 0.03
PLACE_M, HEADING_RAD = 0.0005, math.radians(0.2)
BIAS = np.array([-20.68, 21.95, -48.70, -0.097, 1.172, -0.321])
NOISE6 = np.array([FORCE_N] * 3 + [TORQUE_NM] * 3)


def rot(axis, degrees):
    """Return the rotation about x, y or z, written out."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return np.array({
        "x": [[1, 0, 0], [0, c, -s], [0, s, c]],
        "y": [[c, 0, s], [0, 1, 0], [-s, 0, c]],
        "z": [[c, -s, 0], [s, c, 0], [0, 0, 1]],
    }[axis])  # fmt: skip


def wrench(dice, seconds, level=BIAS):
    """Return times and readings about a level."""
    count = round(100 * seconds)
    return np.arange(count) / 100.0, level + dice.normal(size=(count, 6)) * NOISE6


def reading(dice, seconds, force=(0.0, 0.0, 0.0), bias=BIAS):
    """Return the judged readings of a force (SENSOR frame, N) beside the bias."""
    return steady(*wrench(dice, seconds, bias + np.array([*force, 0.0, 0.0, 0.0])))


def poses(dice, seconds, x, y, yaw):
    """Return poses at rest as motion capture sees them."""
    return np.array([x, y, yaw]) + dice.normal(size=(round(100 * seconds), 3)) * [PLACE_M, PLACE_M, HEADING_RAD]


def stood(dice, seconds, x, y, yaw):
    """Return the mean of poses at rest."""
    return mean_pose(poses(dice, seconds, x, y, yaw))


def keeps_its_promise(errors, uncertainties, most):
    """Check what is promised of an uncertainty (k = 2) over 30 draws; errors and uncertainties in rows."""
    errors, uncertainties = np.atleast_2d(np.array(errors).T), np.atleast_2d(np.array(uncertainties).T)
    assert errors.shape[1] == 30
    for error, uncertainty, limit in zip(errors, uncertainties, np.atleast_1d(most), strict=True):
        within = int((np.abs(error) <= uncertainty).sum())
        twice_rms = 2.0 * math.sqrt(float(((error / uncertainty) ** 2).mean()))
        assert uncertainty.max() <= limit, uncertainty
        assert within >= 27, (within, twice_rms)
        assert 0.6 <= twice_rms <= 1.4, (within, twice_rms)
