"""Where the contact ball is in BODY: seen by motion capture, or plumbed to the floor at two headings. Pure."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from robot_io.geometry import seen_from_frame
from robot_io.messages import Vector3
from tools.calibrate.estimators.estimate import Array, CannotCalibrate, Estimate, K
from tools.calibrate.estimators.mean_pose import MeanPose

LEAST_TURN_DEG = 45.0
MOST_REACH_M = 3.0
MOST_SPREAD_M = 0.02
MARKER_M = 0.001
"""1 sigma of how far the origin of the ball's markers lies off its centre."""


class Sight(NamedTuple):
    """The base stood here, and the ball was there (WORLD, m)."""

    base: MeanPose
    ball_m: tuple[float, float]
    ball_error_m: float
    """1 sigma of each coordinate."""


def estimate_from_marker(sights: Sequence[Sight], contact_in_base_m: Vector3) -> Estimate:
    """Return the ball's centre in BODY from a marker on it; every sight gives it, more than one is a check."""
    seen = np.array([_in_base(sight) for sight in sights])
    reach = float(np.linalg.norm(seen.mean(axis=0)))
    own = np.array([math.hypot(s.ball_error_m, s.base.place_error_m, reach * s.base.yaw_error_rad) for s in sights])
    error = math.hypot(float(np.sqrt((own**2).sum())) / len(sights), MARKER_M)
    rest = seen - seen.mean(axis=0)
    return _result(seen.mean(axis=0), error, rest, contact_in_base_m, f"marker on the ball, seen {len(sights)} times")


def estimate_from_plumb(sights: Sequence[Sight], contact_in_base_m: Vector3) -> Estimate:
    """Return the ball's centre in BODY from floor points below it, measured along the axes of WORLD.

    Only differences between the points count, so an origin of the tape that is off does no harm. Raises
    CannotCalibrate: fewer than two points, no two headings 45 degrees apart, points that contradict each other.
    """
    if len(sights) < 2:
        raise CannotCalibrate("one plumbed point is too few, 2 are needed", do="Turn the base and plumb again")
    yaws = [sight.base.pose.yaw for sight in sights]
    widest = max(abs(math.remainder(a - b, math.tau)) for a, b in itertools.combinations(yaws, 2))
    if math.degrees(widest) < LEAST_TURN_DEG:
        raise CannotCalibrate(
            f"the headings are {math.degrees(widest):.0f} degrees apart, at least {LEAST_TURN_DEG:g} are needed",
            do="Turn the base further (90 to 180 degrees) and plumb again",
        )
    design, target = _plumb_equations(sights)
    solution, *_ = np.linalg.lstsq(design, target, rcond=None)
    rest = (target - design @ solution).reshape(-1, 2)
    if float(np.abs(rest).max()) > MOST_SPREAD_M:
        raise CannotCalibrate(
            f"the plumbed points contradict each other by {1000 * float(np.abs(rest).max()):.0f} mm",
            do="Measure x and y along the axes of motion capture, and check the numbers typed in",
        )
    reach = math.hypot(float(solution[0]), float(solution[1]))
    errors = [math.hypot(s.ball_error_m, s.base.place_error_m, reach * s.base.yaw_error_rad) for s in sights]
    covariance = np.linalg.inv(design.T @ design) * float(np.mean(np.square(errors)))
    error = math.sqrt(float(np.trace(covariance[:2, :2])) / 2.0)
    return _result(
        np.asarray(solution[:2], dtype=np.float64),
        error,
        rest,
        contact_in_base_m,
        f"plumb line at {len(sights)} headings",
    )


def _plumb_equations(sights: Sequence[Sight]) -> tuple[Array, Array]:
    """Return the linear equations of contact x, y (BODY) and offset x, y of the tape's origin (WORLD)."""
    rows, target = [], []
    for sight in sights:
        pose = sight.base.pose
        c, s = math.cos(pose.yaw), math.sin(pose.yaw)
        rows += [[c, -s, 1.0, 0.0], [s, c, 0.0, 1.0]]
        target += [sight.ball_m[0] - pose.x, sight.ball_m[1] - pose.y]
    return np.array(rows), np.array(target)


def _in_base(sight: Sight) -> tuple[float, float]:
    pose = sight.base.pose
    return seen_from_frame(sight.ball_m[0] - pose.x, sight.ball_m[1] - pose.y, pose.yaw)


def _result(value: Array, error_m: float, rest: Array, before: Vector3, source: str) -> Estimate:
    x, y = float(value[0]), float(value[1])
    if not math.hypot(x, y) < MOST_REACH_M:
        raise CannotCalibrate(
            f"the ball would be {math.hypot(x, y):.1f} m from the base's middle", do="Check the numbers typed in"
        )
    if float(np.abs(rest).max(initial=0.0)) > MOST_SPREAD_M:
        raise CannotCalibrate(
            f"the sights differ by {1000 * float(np.abs(rest).max()):.0f} mm from their mean",
            do="`push calibrate marker` first: seen from two sides, a wrong marker frame looks like this",
        )
    residual = float(np.sqrt((rest**2).mean()))
    uncertainty = K * error_m
    return Estimate(
        "contact",
        (x, y),
        (uncertainty, uncertainty),
        "m, m",
        (residual, residual),
        source,
        {"frames.contact_in_base_m": (round(x, 5), round(y, 5), before[2])},
        (f"moved by {1000 * (x - before[0]):+.1f} mm ahead and {1000 * (y - before[1]):+.1f} mm to the left",),
    )
