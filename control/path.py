"""The straight path: a point and a direction in the WORLD frame.

The PATH frame has its x axis along the direction of travel and y to the left; angles are counter-clockwise.
"""

from __future__ import annotations

import math

import msgspec

from robot_io.rig.config import PathConfig


class StraightPath(msgspec.Struct, frozen=True, gc=False):
    """A line in the WORLD frame: origin in m, heading in rad, and its cosine and sine."""

    origin_x: float
    origin_y: float
    heading: float
    cos: float
    sin: float

    @classmethod
    def of(cls, config: PathConfig) -> StraightPath:
        """Build the path of a rig file."""
        heading = math.radians(config.direction_deg)
        return cls(config.origin_m[0], config.origin_m[1], heading, math.cos(heading), math.sin(heading))

    def along(self, x_world: float, y_world: float) -> float:
        """Return how far a WORLD point (m) lies along the path from its origin, in m."""
        return (x_world - self.origin_x) * self.cos + (y_world - self.origin_y) * self.sin

    def lateral(self, x_world: float, y_world: float) -> float:
        """Return the lateral offset of a WORLD point from the path in m, left positive (y_c of the paper)."""
        return (y_world - self.origin_y) * self.cos - (x_world - self.origin_x) * self.sin

    def vector_to_path(self, x_world: float, y_world: float) -> tuple[float, float]:
        """Rotate a WORLD vector into the PATH frame."""
        return x_world * self.cos + y_world * self.sin, y_world * self.cos - x_world * self.sin

    def direction_in_world(self, theta: float) -> tuple[float, float]:
        """Return the WORLD unit vector of a PATH angle in rad."""
        return math.cos(self.heading + theta), math.sin(self.heading + theta)


def wrap(angle: float) -> float:
    """Return `angle` (rad) in (-pi, pi]."""
    wrapped = math.remainder(angle, math.tau)
    return math.pi if wrapped == -math.pi else wrapped
