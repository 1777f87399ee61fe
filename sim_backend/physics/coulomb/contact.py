"""A slider on support points as a contact solver: takes the place of the ellipsoid's closed form."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot
from typing import Any

from sim_backend.physics.coulomb import kernel
from sim_backend.physics.coulomb.jit import COMPILED
from sim_backend.physics.shapes import Point
from sim_backend.physics.slider_exact import SEPARATING, AtRest, ContactSolution, Grain, Moving, Sliding
from sim_backend.physics.support import SupportPoint, centre_of, leaning

_EVEN = (1.0, 0.0, 1.0)
_MODES = (Sliding.STICKING, Sliding.LEFT, Sliding.RIGHT)


class CoulombContact:
    """The friction under a slider, point by point.

    points: where it stands (BODY frame), leaning as its load is. Used as a `ContactSolver` with the contact relative to
    the points' centre; d_m is ignored, and f_max_N is the friction of all points together on an even floor. It keeps
    its last motion, from which the search for the next begins.
    """

    def __init__(self, points: Sequence[SupportPoint]) -> None:
        self.points = tuple(points)
        self.centre_m = x0, y0 = centre_of(points)
        xs, ys, shares = [x - x0 for x, _, _ in points], [y - y0 for _, y, _ in points], [w for _, _, w in points]
        xx, xy, yy = (
            sum(w * a * b for a, b, w in zip(one, other, shares, strict=True))
            for one, other in ((xs, xs), (xs, ys), (ys, ys))
        )
        det = xx * yy - xy * xy
        self._slope_of_shift = (yy / det, -xy / det, xx / det)
        self._xs, self._ys, self._even = _floats(xs), _floats(ys), _floats(shares)
        self._shares, self._lean, self._friction = self._even, (0.0, 0.0), _floats([1.0] * len(xs))
        self._relative: list[float] | None = None
        self._shift = (0.0, 0.0)
        self._last = (int(Sliding.STICKING), 0.0, 0.0)

    def load(self, shift_m: Point, friction: Sequence[float] | None = None) -> None:
        """Shift the pressure's centre by so much, and set each point's friction over the floor's mean.

        Raises ConfigError when the slider tips over.
        """
        a, b, c = self._slope_of_shift
        self._shift, self._lean = shift_m, (a * shift_m[0] + b * shift_m[1], b * shift_m[0] + c * shift_m[1])
        self._relative = None if friction is None else list(friction)
        self._shares = self._even if friction is None else self._times_friction(self._even)

    def __call__(
        self,
        cx: float,
        cy: float,
        nx: float,
        ny: float,
        vx: float,
        vy: float,
        d_m: float,
        f_max_N: float,
        contact_friction: float,
        grain: Grain | None = None,
    ) -> ContactSolution:
        """Return the slider's response to a pusher velocity (m/s) at a contact; see `solve_exact`."""
        speed = hypot(vx, vy)
        vn, vt = vx * nx + vy * ny, vy * nx - vx * ny
        if vn < 0.0:
            return SEPARATING
        if speed < kernel.TINY:
            return AtRest(0.0)
        n, v = (nx, ny), (vn / speed, vt / speed)
        arguments = ((cx, cy), n, v, contact_friction, self._last, _EVEN if grain is None else _inverse(grain))
        mode, un, ut, turn, fn, ft = kernel.solve(self._xs, self._ys, self._shares, self._lean, *arguments)
        if mode == kernel.LIFTING:
            x0, y0 = self.centre_m
            leant = leaning(self.points, (x0 + self._shift[0], y0 + self._shift[1]))
            shares = self._times_friction(_floats([w for _, _, w in leant]))
            mode, un, ut, turn, fn, ft = kernel.solve(self._xs, self._ys, shares, (0.0, 0.0), *arguments)
        if mode == kernel.RESTING:
            return AtRest(vt)
        self._last = (mode, turn, ut)
        slip = 0.0 if mode == kernel.STICKING else (v[1] - ut) * speed
        turn *= speed
        ux, uy = (un * nx - ut * ny) * speed, (un * ny + ut * nx) * speed
        fn, ft = fn * f_max_N, ft * f_max_N
        # the twist about the points' centre, from which the contact is seen
        return Moving(_MODES[mode], ux + turn * cy, uy - turn * cx, turn, slip, fn * nx - ft * ny, fn * ny + ft * nx)

    def _times_friction(self, shares: Any) -> Any:
        if self._relative is None:
            return shares
        return _floats([w * f for w, f in zip(shares, self._relative, strict=True)])


def _inverse(grain: Grain) -> Grain:
    xx, xy, yy = grain
    det = xx * yy - xy * xy
    return (yy / det, -xy / det, xx / det)


def _floats(values: list[float]) -> Any:
    """Return what the kernel reads: an array where it is compiled, else a list, which plain Python reads faster."""
    if not COMPILED:
        return values
    import numpy as np

    return np.array(values)
