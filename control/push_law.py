"""The paper's control law: eq. (3) of Heins & Schoellig, "Robust Single-Point Pushing with Force Feedback".

    theta_p = (k_f + 1) theta_f + k_y y_c

All angles are in the PATH frame. The sign of the k_y term looks wrong but is correct: left of the path
(y_c > 0) the pusher goes further left, which turns the object until its contact force points back to the path.
"""

from __future__ import annotations

import math


def force_angle(fx_path: float, fy_path: float) -> float:
    """Return theta_f in (-pi, pi], the angle of the force on the slider in the PATH frame.

    The caller makes sure that the force is not zero: the angle of (0, 0) is undefined.
    """
    angle = math.atan2(fy_path, fx_path)
    return math.pi if angle == -math.pi else angle


def push_angle(theta_f: float, lateral_m: float, k_f: float, k_y_rad_per_m: float) -> float:
    """Return theta_p in rad, not wrapped and not clipped: safety judges angles beyond +-90 degrees."""
    return (k_f + 1.0) * theta_f + k_y_rad_per_m * lateral_m


def return_angle(theta_p: float, lateral_m: float, k_y_rad_per_m: float, turn_rad: float) -> float:
    """Return theta_p turned by at most `turn_rad` towards the return direction `-k_y y_c`.

    Used while the force is lost: the pusher circles back to the path and meets the object again.
    """
    wanted = -k_y_rad_per_m * lateral_m
    return theta_p + min(max(wanted - theta_p, -turn_rad), turn_rad)
