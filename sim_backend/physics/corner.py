"""A point pusher at a polygon's corner: it clears the corner, continues along one of the two faces, or sticks there."""

from __future__ import annotations

from math import hypot, sqrt

from sim_backend.physics.contact_geometry import FaceRow
from sim_backend.physics.slider_exact import TINY, ContactSolver, Grain, Moving, Sliding

CornerArguments = tuple[float, float, float, float, float, Grain | None]
"""Contact minus centre of friction x, y (m, BODY), d_m, f_max_N, contact friction, grain of the floor."""
CornerChoice = tuple[Moving, float, float, int]
"""The motion, the inward normal x, y (BODY) it was found for, and the face it continues along (-1: the corner)."""


def solve_at_corner(
    rows: tuple[FaceRow, ...],
    corner: int,
    solve: ContactSolver,
    vx: float,
    vy: float,
    arguments: CornerArguments,
) -> CornerChoice | None:
    """Return a slider's response to a point pusher at corner `corner` (m/s, BODY), or None if the pusher clears it.

    Any normal between the two faces' is possible at the corner, so the program's aim, the least slip, is met by
    sticking there if that is feasible, and else by the face along which the contact slides away from the corner.
    Corner i is the high end of face i and the low end of the face before it.
    """
    before = (corner - 1) % len(rows)
    if min(_closing(rows[corner], vx, vy), _closing(rows[before], vx, vy)) <= 0.0:
        return None  # outside one face's line is outside the slider
    stuck = _stick(rows[corner], rows[before], vx, vy, arguments)
    if stuck is not None:
        return stuck
    cx, cy, d, f_max, mu, grain = arguments
    inward: list[tuple[Moving, int]] = []
    for face, sliding in ((corner, Sliding.RIGHT), (before, Sliding.LEFT)):
        solution = solve(cx, cy, rows[face][0], rows[face][1], vx, vy, d, f_max, mu, grain)
        if isinstance(solution, Moving) and solution.mode is sliding:
            inward.append((solution, face))
    if not inward:
        return None
    least, face = min(inward, key=lambda found: abs(found[0].slip))
    return (least, rows[face][0], rows[face][1], face)


def _closing(row: FaceRow, vx: float, vy: float) -> float:
    return row[0] * vx + row[1] * vy


def _stick(one: FaceRow, other: FaceRow, vx: float, vy: float, arguments: CornerArguments) -> CornerChoice | None:
    """Stick at the corner itself if some normal between the two faces' holds the force in its friction cone."""
    cx, cy, d, f_max, mu, grain = arguments
    pxx, pxy, pyy = grain or (1.0, 0.0, 1.0)
    # the force that moves the corner with the pusher: (P + q q'/d^2) h = v with q = (-c_y, c_x)
    dd = d * d
    axx, axy, ayy = pxx + cy * cy / dd, pxy - cx * cy / dd, pyy + cx * cx / dd
    det = axx * ayy - axy * axy
    hx, hy = (ayy * vx - axy * vy) / det, (axx * vy - axy * vx) / det
    turn_rate = (cx * hy - cy * hx) / dd
    ux, uy = pxx * hx + pxy * hy, pxy * hx + pyy * hy
    size = sqrt(max(hx * ux + hy * uy, 0.0) + dd * turn_rate * turn_rate)
    if size < TINY:
        return None
    nx, ny = _nearest_normal(hx, hy, one, other)
    if abs(nx * hy - ny * hx) > mu * (nx * hx + ny * hy) * (1 + 1e-12):
        return None
    scale = f_max / size
    return (Moving(Sliding.STICKING, ux, uy, turn_rate, 0.0, hx * scale, hy * scale), nx, ny, -1)


def _nearest_normal(hx: float, hy: float, one: FaceRow, other: FaceRow) -> tuple[float, float]:
    """Return the direction between two normals (less than half a turn apart) that is nearest to (hx, hy)."""
    sense = one[0] * other[1] - one[1] * other[0]
    after_one = (one[0] * hy - one[1] * hx) * sense >= 0.0
    before_other = (hx * other[1] - hy * other[0]) * sense >= 0.0
    if after_one and before_other:
        length = hypot(hx, hy)
        return (hx / length, hy / length)
    nearer = max((one, other), key=lambda row: row[0] * hx + row[1] * hy)
    return (nearer[0], nearer[1])
