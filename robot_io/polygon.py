"""Polygons on the floor, pure: whether one is simple, where a point lies in it, and what room a rectangle has in it."""

from __future__ import annotations

import math
from itertools import combinations

from robot_io.geometry import point_outside
from robot_io.messages import Pose2D

Point = tuple[float, float]
Polygon = tuple[Point, ...]
"""Corners in m, in order (either way round), in the WORLD frame; the last is joined to the first."""

LEAST_AREA_M2 = 1e-6


def flaw(polygon: Polygon) -> str:
    """Return why these corners are no simple polygon, or an empty string."""
    if len(polygon) < 3:
        return "it needs three corners or more"
    if abs(_area(polygon)) < LEAST_AREA_M2:
        return "it has no area"
    edges = _edges(polygon)
    last = len(edges) - 1
    for i, j in combinations(range(len(edges)), 2):
        if j - i > 1 and (i, j) != (0, last) and _cross(*edges[i], *edges[j]):
            return f"its edge from corner {i + 1} crosses that from corner {j + 1}"
    return ""


def rectangle(pose: Pose2D, x: Point, y: Point) -> Polygon:
    """Return the corners of the rectangle from x[0] to x[1] and from y[0] to y[1] (m) in the frame of `pose`."""
    corners = ((x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1]))
    return tuple(point_outside(pose.x, pose.y, pose.yaw, *corner) for corner in corners)


def distance_inside(polygon: Polygon, x: float, y: float) -> float:
    """Return how far a point is from the polygon's edge in m: positive inside, negative outside."""
    inside = False
    nearest = math.inf
    for (ax, ay), (bx, by) in _edges(polygon):
        if (ay > y) != (by > y) and x < ax + (y - ay) * (bx - ax) / (by - ay):
            inside = not inside
        ux, uy = bx - ax, by - ay
        length2 = ux * ux + uy * uy
        share = ((x - ax) * ux + (y - ay) * uy) / length2 if length2 > 0.0 else 0.0
        share = min(max(share, 0.0), 1.0)
        nearest = min(nearest, math.hypot(x - ax - share * ux, y - ay - share * uy))
    return nearest if inside else -nearest


def room(polygon: Polygon, inner: Polygon) -> float:
    """Return the smallest distance (m) from a convex `inner` to the polygon's edge, negative where it sticks out."""
    least = min(distance_inside(polygon, *corner) for corner in inner)
    for corner in polygon:  # a corner of the edge that points inwards may reach between those of `inner`
        least = min(least, -distance_inside(inner, *corner))
    if least >= 0.0 and any(_cross(*a, *b) for a in _edges(polygon) for b in _edges(inner)):
        return -least
    return least


def longest_line_m(polygon: Polygon) -> float:
    """Return the greatest distance of two corners in m: no straight path inside is longer."""
    return max(math.dist(a, b) for a, b in combinations(polygon, 2))


def _edges(polygon: Polygon) -> list[tuple[Point, Point]]:
    return list(zip(polygon, (*polygon[1:], polygon[0]), strict=True))


def _area(polygon: Polygon) -> float:
    return sum(ax * by - bx * ay for (ax, ay), (bx, by) in _edges(polygon)) / 2.0


def _cross(a: Point, b: Point, c: Point, d: Point) -> bool:
    """Return whether the segments a-b and c-d cross, touching not counted."""
    return _side(a, b, c) * _side(a, b, d) < 0.0 and _side(c, d, a) * _side(c, d, b) < 0.0


def _side(a: Point, b: Point, p: Point) -> float:
    return (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
