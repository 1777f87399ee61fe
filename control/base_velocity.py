"""Converts a wanted WORLD velocity into the BODY-frame command for the base, and holds the heading."""

from __future__ import annotations

from robot_io.geometry import point_outside, seen_from_frame, wrap_angle
from robot_io.messages import BodyTwist, WorldTwist


def body_from_world(twist: WorldTwist, yaw: float) -> BodyTwist:
    """Rotate a WORLD velocity into the BODY frame by the *measured* heading `yaw` (rad)."""
    return BodyTwist(*seen_from_frame(twist.vx, twist.vy, yaw), twist.omega)


def heading_rate(yaw_wanted: float, yaw: float, gain_per_s: float, limit_rad_per_s: float) -> float:
    """Return the turn rate in rad/s that brings the base back to `yaw_wanted`."""
    return min(max(gain_per_s * wrap_angle(yaw_wanted - yaw), -limit_rad_per_s), limit_rad_per_s)


def contact_point_world(x: float, y: float, yaw: float, contact_x: float, contact_y: float) -> tuple[float, float]:
    """Return the centre of the contact ball in the WORLD frame, m.

    x, y, yaw: measured pose of the base. contact_x, contact_y: ball centre in the BODY frame. The point where
    ball and object touch is offset sideways from the centre by R sin(angle), where R is the ball's radius.
    """
    return point_outside(x, y, yaw, contact_x, contact_y)
