"""Origin and direction of the path: from where the base stands, or through two places that it was driven to. Pure."""

from __future__ import annotations

import math

from robot_io.geometry import point_outside
from robot_io.messages import Vector3
from tools.calibrate.estimators.estimate import CannotCalibrate, Estimate, K
from tools.calibrate.estimators.mean_pose import MeanPose

LEAST_APART_M = 0.5


def estimate_line(first: MeanPose, second: MeanPose | None, contact_in_base_m: Vector3) -> Estimate:
    """Return the path's origin (m, WORLD: the ball where the base stood first) and its direction (degrees).

    second: where the base stood farther along the path; None: the path goes where the base was heading.
    Raises CannotCalibrate for two places less than 0.5 m apart.
    """
    x, y, x_error, y_error = _ball(first, contact_in_base_m)
    if second is None:
        direction, error, apart = first.pose.yaw, first.yaw_error_rad, 0.0
        source = "the base's place and heading"
    else:
        ahead_x, ahead_y, *_ = _ball(second, contact_in_base_m)
        apart = math.hypot(ahead_x - x, ahead_y - y)
        if apart < LEAST_APART_M:
            raise CannotCalibrate(
                f"the two places are {apart:.2f} m apart, at least {LEAST_APART_M:g} m are needed", do="Drive further"
            )
        direction = math.atan2(ahead_y - y, ahead_x - x)
        reach = math.hypot(contact_in_base_m[0], contact_in_base_m[1])
        beside = [math.hypot(one.place_error_m, reach * one.yaw_error_rad) for one in (first, second)]
        error = math.hypot(*beside) / apart
        source = f"two places {apart:.2f} m apart"
    told = "as good as base_from_marker and contact_in_base_m are: calibrate these first"
    degrees = math.degrees(direction)
    return Estimate(
        "path",
        (x, y, degrees),
        (K * x_error, K * y_error, K * math.degrees(error)),
        "m, m, deg",
        (first.place_error_m, first.place_error_m, math.degrees(first.yaw_error_rad)),
        source,
        {"path.origin_m": (round(x, 5), round(y, 5)), "path.direction_deg": round(degrees, 4)},
        (told,),
    )


def _ball(stood: MeanPose, contact: Vector3) -> tuple[float, float, float, float]:
    """Return x, y of the ball (WORLD) and 1 sigma of each, m."""
    pose = stood.pose
    x, y = point_outside(pose.x, pose.y, pose.yaw, contact[0], contact[1])
    # An error of the heading turns the ball around the base's middle.
    x_error = math.hypot(stood.place_error_m, (y - pose.y) * stood.yaw_error_rad)
    y_error = math.hypot(stood.place_error_m, (x - pose.x) * stood.yaw_error_rad)
    return x, y, x_error, y_error
