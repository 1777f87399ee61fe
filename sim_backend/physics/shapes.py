"""Convex shapes of sliders: polygon, rectangle and disc, with the distances their friction depends on.

The body frame is the frame the shape is given in (a rectangle's and a circle's origin is its middle). All
lengths in m. An impossible shape is a `ConfigError` of one sentence.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from robot_io.errors import ConfigError

Point = tuple[float, float]
Moment = tuple[float, float, float]
"""Mean of x^2, xy, y^2 (m^2)."""


@dataclass(frozen=True, slots=True)
class Face:
    """One straight face, BODY frame: inward unit normal, position, and its two ends.

    A point p is outside this face by `offset - n . p`; along the face, `u = t . p` with t = (-n_y, n_x) runs from
    `u_low` (at `end_low`) to `u_high` (at `end_high`). All m.
    """

    normal_x: float
    normal_y: float
    offset: float
    u_low: float
    u_high: float
    end_low: Point
    end_high: Point


@dataclass(frozen=True, slots=True)
class ConvexPolygon:
    """A convex polygon given by its corners (m, BODY frame, in either direction of rotation, at least three)."""

    corners: tuple[Point, ...]
    faces: tuple[Face, ...] = field(init=False, compare=False, repr=False)
    bounding_radius_m: float = field(init=False, compare=False, repr=False)
    """Greatest distance of a corner from the body origin."""

    def __post_init__(self) -> None:
        corners = _checked_corners(self.corners)
        object.__setattr__(self, "corners", corners)
        object.__setattr__(self, "faces", tuple(_face(a, b) for a, b in _edges(corners)))
        object.__setattr__(self, "bounding_radius_m", max(math.hypot(*c) for c in corners))

    @property
    def area_m2(self) -> float:
        """Area."""
        return _doubled_area(self.corners) / 2

    @property
    def centroid_m(self) -> Point:
        """Centre of area, BODY frame."""
        crosses = [(a[0] * b[1] - b[0] * a[1], a, b) for a, b in _edges(self.corners)]
        total = 3 * math.fsum(cross for cross, _, _ in crosses)
        return (
            math.fsum(cross * (a[0] + b[0]) for cross, a, b in crosses) / total,
            math.fsum(cross * (a[1] + b[1]) for cross, a, b in crosses) / total,
        )

    def contains(self, point: Point) -> bool:
        """Return whether a point (BODY frame) lies inside or on the edge."""
        return all(f.offset <= f.normal_x * point[0] + f.normal_y * point[1] for f in self.faces)

    def mean_distance_m(self, point: Point) -> float:
        """Mean distance of the area from a point inside (the paper's integral for uniform pressure), closed form.

        Every edge spans a triangle with the point; at distance h from the edge's line the triangle's integral of
        distance is h/6 [u L + h^2 asinh(u/h)] between the ends (u along the edge, L the end's distance).
        """
        total = 0.0
        for face in self.faces:
            h = face.normal_x * point[0] + face.normal_y * point[1] - face.offset
            if h <= 0:
                continue  # a point on the edge itself spans no triangle with it
            along = face.normal_x * point[1] - face.normal_y * point[0]
            for u, sign in ((face.u_high - along, 1.0), (face.u_low - along, -1.0)):
                total += sign * h / 6 * (u * math.hypot(u, h) + h * h * math.asinh(u / h))
        return total / self.area_m2

    def second_moment_m2(self) -> Moment:
        """Mean of x^2, xy, y^2 of the area about its centroid, closed form (sum over the edges' triangles)."""
        xx = xy = yy = 0.0
        for a, b in _edges(self.corners):
            cross = a[0] * b[1] - b[0] * a[1]
            xx += cross * (a[0] * a[0] + a[0] * b[0] + b[0] * b[0])
            yy += cross * (a[1] * a[1] + a[1] * b[1] + b[1] * b[1])
            xy += cross * (2 * a[0] * a[1] + a[0] * b[1] + b[0] * a[1] + 2 * b[0] * b[1]) / 2
        x, y = self.centroid_m
        whole = 12 * self.area_m2
        return (xx / whole - x * x, xy / whole - x * y, yy / whole - y * y)

    def rim_points(self) -> tuple[Point, ...]:
        """The corners farthest from the centroid."""
        x, y = self.centroid_m
        farthest = self.greatest_distance_m((x, y))
        return tuple(c for c in self.corners if math.hypot(c[0] - x, c[1] - y) > farthest * (1 - 1e-9))

    def grid_points(self, across: int) -> tuple[Point, ...]:
        """Points spread evenly over the area: those of an `across` x `across` grid of its bounding box inside it."""
        xs, ys = [c[0] for c in self.corners], [c[1] for c in self.corners]
        points = (
            (
                min(xs) + (i + 0.5) / across * (max(xs) - min(xs)),
                min(ys) + (j + 0.5) / across * (max(ys) - min(ys)),
            )
            for i in range(across)
            for j in range(across)
        )
        return tuple(p for p in points if self.contains(p))

    def greatest_distance_m(self, point: Point) -> float:
        """Distance of the farthest corner from a point."""
        return max(math.hypot(c[0] - point[0], c[1] - point[1]) for c in self.corners)


class Rectangle(ConvexPolygon):
    """A rectangle about the body origin: `length_m` along x (the push), `width_m` along y (the pushed face)."""

    def __init__(self, length_m: float, width_m: float) -> None:
        if not (positive(length_m) and positive(width_m)):
            raise ConfigError(
                f"a rectangle of {length_m} m by {width_m} m has no area",
                where="slider",
                do="Give two positive, finite lengths",
            )
        x, y = length_m / 2, width_m / 2
        super().__init__(((-x, y), (-x, -y), (x, -y), (x, y)))


@dataclass(frozen=True, slots=True)
class Circle:
    """A disc about the body origin."""

    radius_m: float

    def __post_init__(self) -> None:
        if not positive(self.radius_m):
            raise ConfigError(
                f"a circle of radius {self.radius_m} m has no area", where="slider", do="Give a positive, finite radius"
            )

    @property
    def bounding_radius_m(self) -> float:
        """Greatest distance of the edge from the body origin."""
        return self.radius_m

    @property
    def area_m2(self) -> float:
        """Area."""
        return math.pi * self.radius_m**2

    @property
    def centroid_m(self) -> Point:
        """Centre of area, BODY frame."""
        return (0.0, 0.0)

    def contains(self, point: Point) -> bool:
        """Return whether a point (BODY frame) lies inside or on the edge."""
        return math.hypot(*point) <= self.radius_m

    def mean_distance_m(self, point: Point) -> float:
        """Mean distance of the area from a point inside (the paper's integral for uniform pressure).

        In polar form about the point the integral is that of (distance to the edge)^3/3 over the angle: 2/3 of the
        radius for the middle, else a periodic trapezoid, exact to rounding unless the point is almost on the edge.
        """
        e = math.hypot(*point)
        if e == 0:
            return 2 * self.radius_m / 3
        samples = 4096
        angles = (2 * math.pi * i / samples for i in range(samples))
        reach = (math.sqrt(self.radius_m**2 - (e * math.sin(a)) ** 2) - e * math.cos(a) for a in angles)
        return math.fsum(r**3 for r in reach) * (2 * math.pi / samples) / 3 / self.area_m2

    def second_moment_m2(self) -> Moment:
        """Mean of x^2, xy, y^2 of the area about the middle."""
        return (self.radius_m**2 / 4, 0.0, self.radius_m**2 / 4)

    def rim_points(self) -> tuple[Point, ...]:
        """Twelve points around the rim."""
        angles = (2 * math.pi * i / 12 for i in range(12))
        return tuple((self.radius_m * math.cos(a), self.radius_m * math.sin(a)) for a in angles)

    def grid_points(self, across: int) -> tuple[Point, ...]:
        """Points spread evenly over the area: those of an `across` x `across` grid of its bounding box inside it."""
        places = [(2 * (i + 0.5) / across - 1) * self.radius_m for i in range(across)]
        return tuple((x, y) for x in places for y in places if self.contains((x, y)))

    def greatest_distance_m(self, point: Point) -> float:
        """Distance of the farthest edge point from a point."""
        return self.radius_m + math.hypot(*point)


Shape = ConvexPolygon | Circle


def positive(value: float) -> bool:
    """Return whether a length is a finite number above 0."""
    return math.isfinite(value) and value > 0


def _edges(corners: tuple[Point, ...]) -> list[tuple[Point, Point]]:
    return [(a, corners[(i + 1) % len(corners)]) for i, a in enumerate(corners)]


def _doubled_area(corners: tuple[Point, ...]) -> float:
    return math.fsum(a[0] * b[1] - b[0] * a[1] for a, b in _edges(corners))


def _checked_corners(corners: tuple[Point, ...]) -> tuple[Point, ...]:
    """Return the corners counter-clockwise, or raise ConfigError."""
    points = tuple((float(x), float(y)) for x, y in corners)
    if len(points) < 3:
        raise ConfigError(f"a polygon needs at least three corners, not {len(points)}", where="slider")
    if not all(math.isfinite(v) for p in points for v in p):
        raise ConfigError("a corner of the polygon is not a finite number", where="slider")
    if _doubled_area(points) < 0:
        points = points[::-1]
    size = max(math.hypot(b[0] - a[0], b[1] - a[1]) for a, b in _edges(points))
    if _doubled_area(points) <= 1e-12 * size * size:
        raise ConfigError("the polygon has no area", where="slider")
    for a, b in _edges(points):
        for p in points:
            side = (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
            if p not in (a, b) and side <= 1e-12 * size * size:
                raise ConfigError(
                    "the polygon is not convex (or repeats a corner)",
                    where="slider",
                    do="Give the corners in order around a convex outline, without points on a straight edge",
                )
    if len(set(points)) != len(points):
        raise ConfigError("the polygon repeats a corner", where="slider")
    return points


def _face(a: Point, b: Point) -> Face:
    """Return the face from corner a to corner b of a counter-clockwise outline."""
    ex, ey = b[0] - a[0], b[1] - a[1]
    length = math.hypot(ex, ey)
    nx, ny = -ey / length + 0.0, ex / length + 0.0  # + 0.0 turns -0.0 into 0.0
    # counter-clockwise with the inside on the left: t = (-n_y, n_x) points from b to a
    return Face(nx, ny, nx * a[0] + ny * a[1], nx * b[1] - ny * b[0], nx * a[1] - ny * a[0], b, a)
