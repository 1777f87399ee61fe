"""The limits of a UR arm's safety settings as delivered: beyond them the controller stops it."""

from __future__ import annotations

import math
from collections.abc import Sequence

from robot_io.messages import Joints
from sim_backend.ur10.models import Six, UrModel

SPEED_MARGIN_RAD_PER_S = 0.2
RANGE_MARGIN_RAD = math.radians(3.0)
"""The default settings are these above what a joint does: an arm of half a turn a second has 3.34 rad/s, and of one
turn 363 degrees. Source: configuration data of a UR5e (client interface)."""


def speed_limits(model: UrModel) -> Six:
    """Return the speed (rad/s) of each joint that trips the safety system."""
    a, b, c, d, e, f = (speed + SPEED_MARGIN_RAD_PER_S for speed in model.speed_rad_per_s)
    return (a, b, c, d, e, f)


def position_limits(model: UrModel) -> Six:
    """Return the angle (rad), either way, of each joint that trips the safety system."""
    a, b, c, d, e, f = (turn + RANGE_MARGIN_RAD for turn in model.range_rad)
    return (a, b, c, d, e, f)


def within_positions(q: Joints, model: UrModel) -> bool:
    """Return whether joints (rad) are within their limits; NaN is not."""
    return all(abs(angle) <= limit for angle, limit in zip(q, position_limits(model), strict=True))


def too_fast(rates: Sequence[float], limits: Six) -> int | None:
    """Return the first joint (0..5) whose rate (rad/s) is beyond its limit or no number, or None."""
    return next((i for i, rate in enumerate(rates) if not abs(rate) <= limits[i]), None)
