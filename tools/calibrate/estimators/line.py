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
    x, y, place = _ball(first, contact_in_base_m)
    if second is None:
        direction, error, apart = first.pose.yaw, first.yaw_error_rad, 0.0
        source = "the base's place and heading"
    else:
        ahead_x, ahead_y, ahead_place = _ball(second, contact_in_base_m)
        apart = math.hypot(ahead_x - x, ahead_y - y)
        if apart < LEAST_APART_M:
            raise CannotCalibrate(
                f"the two places are {apart:.2f} m apart, at least {LEAST_APART_M:g} m are needed", do="Drive further"
            )
        direction = math.atan2(ahead_y - y, ahead_x - x)
        error = math.hypot(place, ahead_place) / apart
        source = f"two places {apart:.2f} m apart"
    told = "as good as base_from_marker and contact_in_base_m are: calibrate these first"
    degrees = math.degrees(direction)
    return Estimate(
        "path",
        (x, y, degrees),
        (K * place, K * place, K * math.degrees(error)),
        "m, m, deg",
        (first.place_error_m, first.place_error_m, math.degrees(first.yaw_error_rad)),
        source,
        {"path.origin_m": (round(x, 5), round(y, 5)), "path.direction_deg": round(degrees, 4)},
        (told,),
    )


def _ball(stood: MeanPose, contact: Vector3) -> tuple[float, float, float]:
    """Return x, y of the ball (WORLD) and 1 sigma of each, m."""
    pose = stood.pose
    x, y = point_outside(pose.x, pose.y, pose.yaw, contact[0], contact[1])
    reach = math.hypot(contact[0], contact[1])
    # The heading moves the ball across only; a coordinate of WORLD may be all of that.
    return x, y, math.hypot(stood.place_error_m, reach * stood.yaw_error_rad)
