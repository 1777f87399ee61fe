"""The paper's control law: eq. (3) of Heins & Schoellig, "Robust Single-Point Pushing with Force Feedback".

    theta_p = (k_f + 1) theta_f + k_y y_c

The second term is bounded (`MOST_OFFSET_RAD`): far beside the path the object is to come back, not to be turned away.
All angles are in the PATH frame. The sign of the k_y term looks wrong but is correct: left of the path
(y_c > 0) the pusher goes further left, which turns the object until its contact force points back to the path.
"""

from __future__ import annotations

import math

MOST_OFFSET_RAD = 0.25
"""Bound of k_y y_c, rad: more only turns an object away that is far beside the path (docs/laws.md)."""


def force_angle(fx_path: float, fy_path: float) -> float:
    """Return theta_f in (-pi, pi], the angle of the force on the slider in the PATH frame.

    The caller makes sure that the force is not zero: the angle of (0, 0) is undefined.
    """
    angle = math.atan2(fy_path, fx_path)
    return math.pi if angle == -math.pi else angle


def push_angle(theta_f: float, lateral_m: float, k_f: float, k_y_rad_per_m: float) -> float:
    """Return theta_p in rad, not wrapped and not clipped: `steering` judges angles beyond +-90 degrees."""
    turned = k_y_rad_per_m * lateral_m
    return (k_f + 1.0) * theta_f + min(max(turned, -MOST_OFFSET_RAD), MOST_OFFSET_RAD)


def return_angle(theta_p: float, lateral_m: float, k_y_rad_per_m: float, turn_rad: float) -> float:
    """Return theta_p turned by at most `turn_rad` towards the return direction `-k_y y_c`.

    Used while the force is lost: the pusher circles back to the path and meets the object again.
    """
    wanted = -k_y_rad_per_m * lateral_m
    return theta_p + min(max(wanted - theta_p, -turn_rad), turn_rad)
