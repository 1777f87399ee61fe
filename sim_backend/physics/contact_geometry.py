"""Where a ball touches a convex outline: nearest feature, and the first touch along a straight motion.

Everything in the slider's BODY frame, m. Plain tuples and floats: this runs every millisecond of a simulated push.
"""

from __future__ import annotations

from math import hypot, inf, sqrt

from sim_backend.physics.shapes import Circle, ConvexPolygon, Shape

Nearest = tuple[float, float, float, float, float, int]
"""Distance outside (negative inside), inward normal x, y, nearest outline point x, y, face (-1: a corner)."""
FaceRow = tuple[float, float, float, float, float, float, float, float, float]
"""Inward normal x, y, offset, u_low, u_high, end_low x, y, end_high x, y (see `shapes.Face`)."""


class Outline:
    """A shape prepared for contact queries."""

    def __init__(self, shape: Shape) -> None:
        self.rows: tuple[FaceRow, ...] = ()
        self.radius_m = 0.0
        if isinstance(shape, Circle):
            self.radius_m = shape.radius_m
        else:
            self.rows = _rows(shape)
        self.bounding_radius_m = shape.bounding_radius_m

    def nearest(self, x: float, y: float, likely_face: int = -1) -> Nearest:
        """Return the outline's nearest feature to a point; for a point inside, the face that is nearest to it.

        A face whose strip contains an outside point is the answer, so a `likely_face` saves the search.
        """
        if not self.rows:
            return self._nearest_on_circle(x, y)
        if likely_face >= 0:
            nx, ny, offset, low, high, _, _, _, _ = self.rows[likely_face]
            out = offset - (nx * x + ny * y)
            if out > 0.0 and low <= nx * y - ny * x <= high:
                return (out, nx, ny, x + out * nx, y + out * ny, likely_face)
        depth, deepest = -inf, 0
        closest, corner_x, corner_y = inf, 0.0, 0.0
        for face, (nx, ny, offset, low, high, low_x, low_y, high_x, high_y) in enumerate(self.rows):
            out = offset - (nx * x + ny * y)
            if out > 0.0:
                u = nx * y - ny * x
                if low <= u <= high:
                    return (out, nx, ny, x + out * nx, y + out * ny, face)
                end_x, end_y = (low_x, low_y) if u < low else (high_x, high_y)
                distance = hypot(end_x - x, end_y - y)
                if distance < closest:
                    closest, corner_x, corner_y = distance, end_x, end_y
            if out > depth:
                depth, deepest = out, face
        if depth <= 0.0 or closest == 0.0:
            nx, ny = self.rows[deepest][:2]
            return (depth, nx, ny, x + depth * nx, y + depth * ny, deepest)
        return (closest, (corner_x - x) / closest, (corner_y - y) / closest, corner_x, corner_y, -1)

    def first_touch(self, x: float, y: float, dx: float, dy: float, ball_radius_m: float) -> float | None:
        """Return the fraction (0..1) of the motion (dx, dy) at which a ball starting clear at (x, y) first touches."""
        if not self.rows:
            return _enter_disc(x, y, dx, dy, self.radius_m + ball_radius_m)
        first: float | None = None
        for nx, ny, offset, low, high, low_x, low_y, _, _ in self.rows:
            closing = nx * dx + ny * dy
            if closing > 0.0:
                fraction = (offset - ball_radius_m - (nx * x + ny * y)) / closing
                u = nx * (y + fraction * dy) - ny * (x + fraction * dx)
                if 0.0 <= fraction <= 1.0 and low <= u <= high and (first is None or fraction < first):
                    first = fraction
            if ball_radius_m > 0.0:
                corner = _enter_disc(x - low_x, y - low_y, dx, dy, ball_radius_m)
                if corner is not None and (first is None or corner < first):
                    first = corner
        return first

    def _nearest_on_circle(self, x: float, y: float) -> Nearest:
        radius = self.radius_m
        r = hypot(x, y)
        if r == 0.0:
            return (-radius, 1.0, 0.0, -radius, 0.0, 0)
        nx, ny = -x / r, -y / r
        return (r - radius, nx, ny, -radius * nx, -radius * ny, 0)


def _rows(shape: ConvexPolygon) -> tuple[FaceRow, ...]:
    return tuple((f.normal_x, f.normal_y, f.offset, f.u_low, f.u_high, *f.end_low, *f.end_high) for f in shape.faces)


def _enter_disc(x: float, y: float, dx: float, dy: float, radius: float) -> float | None:
    """Return the fraction of (dx, dy) at which a point starting outside enters a disc about the origin."""
    a = dx * dx + dy * dy
    b = x * dx + y * dy
    if b >= 0.0 or a == 0.0:
        return None
    c = x * x + y * y - radius * radius
    under = b * b - a * c
    if under < 0.0:
        return None
    fraction = c / (sqrt(under) - b)
    return fraction if 0.0 <= fraction <= 1.0 else None
