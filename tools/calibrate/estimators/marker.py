"""Where the marker frame of motion capture sits on the base, from driving straight and turning on the spot. Pure.

Straight: the markers move in the direction in which the base drives, so their heading less that direction is their yaw
on the base. Turning: they run around the base's middle, which stays where it is.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from robot_io.geometry import point_outside, seen_from_frame, wrap_angle
from robot_io.messages import Pose2D
from tools.calibrate.estimators.estimate import Array, CannotCalibrate, Estimate, K
from tools.calibrate.estimators.mean_pose import MeanPose, block_error

LEAST_STRAIGHT_M = 0.8
MOST_TURNED_DEG = 3.0
"""Turned this much while driving straight, the drive was none."""
LEAST_TURN_RAD = math.radians(150.0)
MOST_WANDER_M = 0.02
STEERING_RAD = math.radians(0.05)
"""1 sigma of how far the wheels' direction is off the commanded one: mecanum wheels cut to 1 mm in 1 m."""


class Straight(NamedTuple):
    """A drive: markers (WORLD) at rest before and after it, and its direction in BODY with 1 sigma, rad."""

    before: MeanPose
    after: MeanPose
    direction_rad: float
    direction_error_rad: float


def estimate_marker(straight: Straight, turning: Array, current: tuple[float, float, float]) -> Estimate:
    """Return base_from_marker: x, y (m) and yaw (rad).

    turning: poses of the markers (x, y, yaw in WORLD, in rows) while the base turned on the spot.
    Raises CannotCalibrate: too short a drive, one that was no straight line, too small a turn, a base that wandered.
    """
    circle = _circle(turning)
    yaw, yaw_error = _yaw(straight, circle)
    x, y = seen_from_frame(*circle.offset_m, -yaw)
    wander = circle.wander_m
    # An error of the yaw turns them around the base's middle: sideways as far as they are ahead of it.
    x_error, y_error = math.hypot(circle.error_m, y * yaw_error), math.hypot(circle.error_m, x * yaw_error)
    return Estimate(
        "marker",
        (x, y, yaw),
        (K * x_error, K * y_error, K * yaw_error),
        "m, m, rad",
        (wander, wander, abs(_turned(straight))),
        "driven straight and turned on the spot",
        {"frames.base_from_marker": (round(x, 5), round(y, 5), round(yaw, 6))},
        (
            f"moved by {1000 * (x - current[0]):+.1f} mm ahead, {1000 * (y - current[1]):+.1f} mm to the left and "
            f"{math.degrees(wrap_angle(yaw - current[2])):+.2f} degrees",
        ),
    )


def _turned(straight: Straight) -> float:
    return wrap_angle(straight.after.pose.yaw - straight.before.pose.yaw)


class _Circle(NamedTuple):
    """Where the markers are from the base's middle, along their own axes, 1 sigma of that, and by how much (rms) a pose
    missed the circle."""

    offset_m: tuple[float, float]
    error_m: float
    wander_m: float


def _yaw(straight: Straight, circle: _Circle) -> tuple[float, float]:
    """Return the yaw of the markers in BODY and 1 sigma, rad."""
    x0, y0 = _middle(straight.before.pose, circle)
    x1, y1 = _middle(straight.after.pose, circle)
    ahead, turned = math.hypot(x1 - x0, y1 - y0), _turned(straight)
    if ahead < LEAST_STRAIGHT_M:
        raise CannotCalibrate(
            f"the base drove {ahead:.2f} m, at least {LEAST_STRAIGHT_M:g} m are needed", do="Drive further"
        )
    if abs(math.degrees(turned)) > MOST_TURNED_DEG:
        raise CannotCalibrate(
            f"the base turned by {math.degrees(turned):+.1f} degrees on the way", do="Drive straight, without turning"
        )
    # On a slight arc the chord points along the heading half way.
    heading = straight.before.pose.yaw + turned / 2.0
    place = math.hypot(straight.before.place_error_m, straight.after.place_error_m) / ahead
    mean = math.hypot(straight.before.yaw_error_rad, straight.after.yaw_error_rad) / 2.0
    error = math.sqrt(place**2 + mean**2 + straight.direction_error_rad**2 + STEERING_RAD**2)
    return wrap_angle(heading - (math.atan2(y1 - y0, x1 - x0) - straight.direction_rad)), error


def _middle(markers: Pose2D, circle: _Circle) -> tuple[float, float]:
    """Return where the base's middle is (WORLD, m)."""
    return point_outside(markers.x, markers.y, markers.yaw, -circle.offset_m[0], -circle.offset_m[1])


def _circle(turning: Array) -> _Circle:
    headings = np.unwrap(turning[:, 2]) if len(turning) else np.zeros(0)
    swept = float(np.ptp(headings)) if len(headings) else 0.0
    if swept < LEAST_TURN_RAD:
        raise CannotCalibrate(
            f"the base turned by {math.degrees(swept):.0f} degrees, "
            f"at least {math.degrees(LEAST_TURN_RAD):.0f} are needed",
            do="Turn it further on the spot",
        )
    c, s, one, none = np.cos(headings), np.sin(headings), np.ones_like(headings), np.zeros_like(headings)
    design = np.vstack([np.column_stack([one, none, c, -s]), np.column_stack([none, one, s, c])])
    target = np.concatenate([turning[:, 0], turning[:, 1]])
    solution, *_ = np.linalg.lstsq(design, target, rcond=None)
    rest = (target - design @ solution).reshape(2, -1).T
    wander = float(np.sqrt((rest**2).mean()))
    if wander > MOST_WANDER_M:
        raise CannotCalibrate(
            f"the base's middle wandered by {1000 * wander:.0f} mm while it turned", do="Turn slowly, on the spot"
        )
    # Neighbouring poses share what makes the base wander: count as many as the blocks say.
    alone, together = float(rest.std(axis=0, ddof=1).mean()) / math.sqrt(len(rest)), block_error(rest)
    unknown = np.linalg.inv(design.T @ design)
    error = math.sqrt(float(unknown[2, 2])) * wander * max(1.0, together / max(alone, 1e-12))
    return _Circle((float(solution[2]), float(solution[3])), error, wander)
