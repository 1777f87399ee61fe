"""Where a slider stands on the floor: its pressure as a few support points, and how they share the load.

A support point is x, y (m, BODY frame) and its share of the load; shares add up to 1. The points are placed so that
their mean square distances are those of the pressure they stand for, in both directions and whatever their number,
because that is what resists turning while the slider is pushed straight.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, fsum, hypot, inf, isfinite, isqrt, pi, sin, sqrt
from typing import Literal

from robot_io.errors import ConfigError
from sim_backend.physics.shapes import Circle, ConvexPolygon, Point, Rectangle, Shape

SupportPoint = tuple[float, float, float]
"""x, y (m, BODY frame) and share of the load."""
PressureName = Literal["uniform", "rim", "point", "frame", "corners", "centre"]
Pressure = PressureName | tuple[SupportPoint, ...]
"""A named pressure, or the points of one's own."""

FEWEST_POINTS, MOST_POINTS = 9, 36
SUPPORT_POINTS = 16
"""How many unless said otherwise."""
SCALE_OF_UNIFORM = {"uniform": 1.0, "centre": 0.5, "point": 0.1}
"""Pressures that are even over the shape, made smaller by this about its middle."""
_DISC_CORNERS = 4
_ON_THE_EDGE_M = 1e-9
_NO_SPREAD = 1e-9
"""Points whose spread across some line is this share of their spread along it do not hold a slider up."""
_MOST_TURNS = 100


def support_points(
    shape: Shape, pressure: Pressure, count: int = SUPPORT_POINTS, cof_m: Point | None = None
) -> tuple[SupportPoint, ...]:
    """Return the points on which a slider stands.

    pressure: `uniform`, even over the area; `centre` and `point`, even over a half and a tenth of its lengths; `frame`,
    even along the outline; `corners` (of a disc: four places of its rim); `rim`, the places farthest from the middle;
    or points, whose shares are scaled to add up to 1. count: about how many, 9 to 36; a grid has the largest square
    below. cof_m: the load's centre where it is not in the middle: the pressure leans towards it, as that of a stiff
    body does. Raises ConfigError when the slider cannot stand on the points, or they are not under it.
    """
    if not isinstance(pressure, str):
        points = _own_points(shape, pressure)
    elif pressure in SCALE_OF_UNIFORM:
        points = _scaled(_even_over_area(shape, count), shape.centroid_m, SCALE_OF_UNIFORM[pressure])
    elif pressure == "frame":
        points = _even_along_outline(shape, count)
    elif pressure == "corners":
        points = _alike(_corners(shape))
    else:
        points = _alike(_rim(shape, count))
    return points if cof_m is None else leaning(points, cof_m)


def centre_of(points: Sequence[SupportPoint]) -> Point:
    """Return the centre of the pressure, which is that of friction (m, BODY frame)."""
    return (fsum(w * x for x, _, w in points), fsum(w * y for _, y, w in points))


def room_of(points: Sequence[SupportPoint], centre_m: Point) -> float:
    """Return how far the pressure's centre can move from here in any direction before the slider tips over (m)."""
    x0, y0 = centre_m
    room = inf
    for ax, ay, _ in points:
        for bx, by, _ in points:
            length = hypot(bx - ax, by - ay)
            if length > _ON_THE_EDGE_M:
                nx, ny = (ay - by) / length, (bx - ax) / length
                if all((x - ax) * nx + (y - ay) * ny >= -_ON_THE_EDGE_M for x, y, _ in points):
                    room = min(room, (x0 - ax) * nx + (y0 - ay) * ny)
    return room


def leaning(points: Sequence[SupportPoint], centre_m: Point) -> tuple[SupportPoint, ...]:
    """Return the points with the shares that a stiff body gives them when its load's centre is at `centre_m`.

    The pressure changes linearly over the body, and where it would pull, the point carries nothing. Raises ConfigError
    when no such shares exist: the slider tips over.
    """
    x0, y0 = centre_of(points)
    to_x, to_y = centre_m[0] - x0, centre_m[1] - y0
    if to_x == to_y == 0.0:
        return tuple(points)
    places = [(x - x0, y - y0) for x, y, _ in points]
    plane = (1.0, 0.0, 0.0)
    carrying = [True] * len(points)
    for _ in range(_MOST_TURNS):
        found = _plane([(x, y, p[2]) for (x, y), p, on in zip(places, points, carrying, strict=True) if on], to_x, to_y)
        if found is None:
            break
        plane = found
        now = [plane[0] + plane[1] * x + plane[2] * y > 0.0 for x, y in places]
        if now == carrying:
            return tuple(
                (x, y, w * max(plane[0] + plane[1] * dx + plane[2] * dy, 0.0))
                for (x, y, w), (dx, dy) in zip(points, places, strict=True)
            )
        carrying = now
    raise ConfigError(
        f"a slider on these {len(points)} support points tips over with its load's centre at "
        f"[{centre_m[0]:.3g}, {centre_m[1]:.3g}] m",
        where="slider",
        do="Push lower, lower the floor's friction, or spread the pressure",
    )


def _plane(points: Sequence[SupportPoint], to_x: float, to_y: float) -> tuple[float, float, float] | None:
    """Return the linear factor on the shares (1, x, y) that brings the load 1 to `to`, None where there is none."""
    w = x = y = xx = xy = yy = 0.0
    for px, py, share in points:
        w, x, y = w + share, x + share * px, y + share * py
        xx, xy, yy = xx + share * px * px, xy + share * px * py, yy + share * py * py
    if w <= 0.0:
        return None
    # eliminate the constant: moments about the middle of these points
    mxx, mxy, myy = xx - x * x / w, xy - x * y / w, yy - y * y / w
    det = mxx * myy - mxy * mxy
    if det <= _NO_SPREAD * (mxx + myy) ** 2:
        return None
    bx, by = to_x - x / w, to_y - y / w
    ax, ay = (myy * bx - mxy * by) / det, (mxx * by - mxy * bx) / det
    return ((1.0 - ax * x - ay * y) / w, ax, ay)


def _own_points(shape: Shape, points: tuple[SupportPoint, ...]) -> tuple[SupportPoint, ...]:
    total = fsum(p[2] for p in points)
    if len(points) > MOST_POINTS:
        raise ConfigError(f"{len(points)} support points are more than {MOST_POINTS}", where="slider")
    if not all(isfinite(v) for p in points for v in p) or any(p[2] <= 0 for p in points):
        raise ConfigError("a support point is [x_m, y_m, share], with a share above 0", where="slider")
    scaled = tuple((float(x), float(y), w / total) for x, y, w in points)
    if len(points) < 3 or _plane([(x, y, w) for x, y, w in scaled], 0.0, 0.0) is None:
        raise ConfigError(
            f"a slider does not stand on {len(points)} support points in a line",
            where="slider",
            do="Give at least three that are not in one line",
        )
    for x, y, _ in scaled:
        if _outside_m(shape, x, y) > _ON_THE_EDGE_M:
            raise ConfigError(f"the support point [{x:g}, {y:g}] is not under the slider", where="slider")
    return scaled


def _outside_m(shape: Shape, x: float, y: float) -> float:
    if isinstance(shape, Circle):
        return hypot(x, y) - shape.radius_m
    return max((f.offset - f.normal_x * x - f.normal_y * y for f in shape.faces), default=-inf)


def _even_over_area(shape: Shape, count: int) -> tuple[SupportPoint, ...]:
    """Return a rectangle's cells of a grid, or places on rings of equal area in a disc."""
    if isinstance(shape, Circle):
        rings = max(2, round(sqrt(count) / 2))
        around = count // rings
        radii = [shape.radius_m * sqrt((i + 0.5) / rings) for i in range(rings)]
        return _alike([p for r in radii for p in _around(r, around)])
    if not isinstance(shape, Rectangle):
        raise ConfigError("an even pressure has support points on rectangles and discs only", where="slider")
    half_x, half_y = shape.corners[3]
    steps = _even_along(isqrt(count))
    return _alike([(half_x * u, half_y * v) for u in steps for v in steps])


def _even_along_outline(shape: Shape, count: int) -> tuple[SupportPoint, ...]:
    if isinstance(shape, Circle):
        return _alike(_around(shape.radius_m, count))
    ends = [(shape.corners[i], shape.corners[(i + 1) % len(shape.corners)]) for i in range(len(shape.corners))]
    steps = _even_along(max(2, count // len(ends)))
    whole = fsum(hypot(b[0] - a[0], b[1] - a[1]) for a, b in ends)
    return tuple(
        (
            (a[0] + b[0]) / 2 + u * (b[0] - a[0]) / 2,
            (a[1] + b[1]) / 2 + u * (b[1] - a[1]) / 2,
            hypot(b[0] - a[0], b[1] - a[1]) / whole / len(steps),
        )
        for a, b in ends
        for u in steps
    )


def _even_along(count: int) -> list[float]:
    """Return places in -1..1, evenly spaced, whose mean square is that of the whole stretch, 1/3."""
    spread = sqrt(1.0 - 1.0 / (count * count))
    return [((2 * i + 1) / count - 1.0) / spread for i in range(count)]


def _around(radius_m: float, count: int) -> list[Point]:
    """Return places on a circle, a mirror image of themselves about both axes when their number is even."""
    angles = (2 * pi * (i + 0.5) / count for i in range(count))
    return [(radius_m * cos(a), radius_m * sin(a)) for a in angles]


def _corners(shape: Shape) -> Sequence[Point]:
    return _around(shape.radius_m, _DISC_CORNERS) if isinstance(shape, Circle) else shape.corners


def _rim(shape: Shape, count: int) -> Sequence[Point]:
    return shape.rim_points() if isinstance(shape, ConvexPolygon) else _around(shape.radius_m, count)


def _alike(places: Sequence[Point]) -> tuple[SupportPoint, ...]:
    return tuple((x, y, 1.0 / len(places)) for x, y in places)


def _scaled(points: tuple[SupportPoint, ...], middle: Point, scale: float) -> tuple[SupportPoint, ...]:
    x0, y0 = middle
    return tuple((x0 + scale * (x - x0), y0 + scale * (y - y0), w) for x, y, w in points)
