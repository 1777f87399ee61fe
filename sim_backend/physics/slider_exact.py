"""The motion of a pushed slider in closed form: the paper's program (2) on plain floats.

Contact frame: n the inward unit normal, t = (-n_y, n_x). With c the contact minus the centre of friction, J = (c x n,
c . n) and d = tau_max/f_max, the velocity of the slider at the contact is w = A h, A = I + J J'/d^2, where h is the
contact force up to a positive factor. (On a floor with a grain, its matrix P replaces I, and the slider moves along
P h.) At a given normal velocity the program's feasible set is a line along which the slip falls strictly with h_t, so
its solution is the sticking h_t clipped to the friction cone.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from math import hypot, sqrt

import msgspec

TINY = 1e-150
"""Below this the square of h underflows to zero: the slider counts as at rest (m/s)."""


class Sliding(IntEnum):
    """How the contact moves on the slider; left and right as seen along the inward normal."""

    STICKING = 0
    LEFT = 1
    RIGHT = 2


class Moving(msgspec.Struct, frozen=True, gc=False):
    """The slider moves with the pusher.

    vx, vy, omega: twist about the centre of friction, BODY axes, m/s and rad/s. slip: velocity of the contact along t
    on the slider, m/s (positive: left). fx, fy: force on the slider, BODY axes, N, on the limit surface.
    """

    mode: Sliding
    vx: float
    vy: float
    omega: float
    slip: float
    fx: float
    fy: float


class Separating(msgspec.Struct, frozen=True, gc=False):
    """The pusher separates (normal velocity below 0): no force, and the slider stays where it is."""


class AtRest(msgspec.Struct, frozen=True, gc=False):
    """The slider stays at rest in contact; the force is undefined: any inside the limit surface and the cone fits.

    slip: velocity of the contact along t, m/s (not 0 when the pusher brushes along the face).
    """

    slip: float


ContactSolution = Moving | Separating | AtRest
Grain = tuple[float, float, float]
"""Floor that resists more one way than another: xx, xy, yy (BODY) of the symmetric matrix that turns a force into the
direction of travel, the unit matrix for an isotropic floor; f_max_N is the force where it is 1."""
ContactSolver = Callable[[float, float, float, float, float, float, float, float, float, Grain | None], ContactSolution]
"""cx, cy, nx, ny, vx, vy, d_m, f_max_N, contact_friction, grain -> solution, BODY axes (see `solve_exact`)."""

SEPARATING = Separating()


def solve_exact(
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
    """Return the slider's response to a pusher velocity (m/s) at a contact, all in BODY axes.

    cx, cy: contact minus centre of friction, m. nx, ny: inward unit normal. d_m > 0, f_max_N > 0,
    contact_friction >= 0. With a wide cone (contact_friction |jn jt| > d^2 + jn^2) a contact may stick and drag the
    slider at normal velocity 0, and sticking is one of two consistent answers below it; below 0 this always returns
    `Separating`, the other one.
    """
    vn = vx * nx + vy * ny
    vt = vy * nx - vx * ny
    if vn < 0.0:
        return SEPARATING
    jn = cx * ny - cy * nx
    jt = cx * nx + cy * ny
    dd = d_m * d_m
    if grain is None:
        pnn, pnt, ptt = 1.0, 0.0, 1.0
        det = 1.0 + (jn * jn + jt * jt) / dd
    else:
        pxx, pxy, pyy = grain
        pnn = pxx * nx * nx + 2.0 * pxy * nx * ny + pyy * ny * ny
        pnt = (pyy - pxx) * nx * ny + pxy * (nx * nx - ny * ny)
        ptt = pxx * ny * ny - 2.0 * pxy * nx * ny + pyy * nx * nx
        det = pxx * pyy - pxy * pxy + (ptt * jn * jn - 2.0 * pnt * jn * jt + pnn * jt * jt) / dd
    ann = pnn + jn * jn / dd
    ant = pnt + jn * jt / dd
    att = ptt + jt * jt / dd
    stick_t = ann * vt - ant * vn  # h_t of sticking, times det A
    g_left = ann + contact_friction * ant
    g_right = ann - contact_friction * ant
    limit = contact_friction * vn * det
    # a bound whose g is not positive does not bound: that side of the cone is wide
    if g_left > 0.0 and stick_t * g_left > limit:
        mode = Sliding.LEFT
        hn = vn / g_left
        ht = contact_friction * hn
        slip = vt - ant * hn - att * ht
    elif g_right > 0.0 and -stick_t * g_right > limit:
        mode = Sliding.RIGHT
        hn = vn / g_right
        ht = -contact_friction * hn
        slip = vt - ant * hn - att * ht
    else:
        mode = Sliding.STICKING
        hn = (att * vn - ant * vt) / det
        ht = stick_t / det
        slip = 0.0
    turn = (jn * hn + jt * ht) / d_m
    if grain is None:
        un, ut, size = hn, ht, hypot(hn, ht, turn)
    else:
        un, ut = pnn * hn + pnt * ht, pnt * hn + ptt * ht
        size = sqrt(max(hn * un + ht * ut, 0.0) + turn * turn)
    if size < TINY:
        return AtRest(slip)
    scale = f_max_N / size
    fn = hn * scale
    ft = ht * scale
    return Moving(mode, un * nx - ut * ny, un * ny + ut * nx, turn / d_m, slip, fn * nx - ft * ny, fn * ny + ft * nx)
