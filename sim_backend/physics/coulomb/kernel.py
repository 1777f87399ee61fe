"""The motion of a slider on support points that a pusher drives, on plain floats, compiled where numba is installed.

Of each point's velocity only the direction counts. Velocities are per the pusher's speed; positions are from the
contact. The total friction is the gradient of the power that it takes, which is convex in the slider's motion. Where
the contact sticks its velocity is known, and the turn rate is the one at which the torque about the contact is zero.
Where it slides along the edge of its friction cone two unknowns remain, the slip and the turn rate; the force's
direction follows that of the velocity in the same sense, so there is one solution.

Arrays are lists of floats, or numpy arrays for the compiled code: the arithmetic is the same.
"""

from __future__ import annotations

from math import sqrt
from typing import Any

from sim_backend.physics.coulomb.jit import jit

Floats = Any
"""A list of floats or a numpy array of them."""

TINY = 1e-150
"""Below this the pusher counts as at rest (m/s)."""
CREEP = 1e-5
"""A point at rest holds by creeping: at this share of the pusher's speed it has 0.7 of its friction."""
SMALL = 1e-13
"""Of the force: an unbalance of the forces below this is none."""
CLOSE = 1e-9
"""... and one below this is as good as rounding allows beside a point that creeps."""
STEPS, BISECTIONS = 30, 200
STICKING, LEFT, RIGHT, RESTING, LIFTING = 0, 1, 2, 3, 4
"""How the contact moves (as in `Sliding`); the slider does not move; a point would pull, so the shares are wrong."""


@jit
def balance(
    xs: Floats, ys: Floats, loads: Floats, ux: float, uy: float, turn: float, qxx: float, qxy: float, qyy: float
) -> tuple[float, float, float, float, float, float, float, float, float]:
    """Return the friction's force x, y, its torque about the contact, and how they change with the motion.

    xs, ys, loads: the points from the contact (m) and their friction. ux, uy, turn: velocity at the contact and turn
    rate. q: what turns a velocity into the direction of friction. The changes: with ux of x; with uy of x and y; with
    the turn rate of x, y and the torque.
    """
    fx = fy = torque = hxx = hxy = hyy = hxt = hyt = htt = 0.0
    for i in range(len(xs)):
        x, y = xs[i], ys[i]
        vx, vy = ux - turn * y, uy + turn * x
        ax, ay = qxx * vx + qxy * vy, qxy * vx + qyy * vy
        square = vx * ax + vy * ay + CREEP * CREEP
        k = loads[i] / sqrt(square)
        fx += k * ax
        fy += k * ay
        torque += k * (x * ay - y * ax)
        gxx, gxy, gyy = k * (qxx - ax * ax / square), k * (qxy - ax * ay / square), k * (qyy - ay * ay / square)
        gxt, gyt = gxy * x - gxx * y, gyy * x - gxy * y
        hxx += gxx
        hxy += gxy
        hyy += gyy
        hxt += gxt
        hyt += gyt
        htt += gyt * x - gxt * y
    return fx, fy, torque, hxx, hxy, hyy, hxt, hyt, htt


@jit
def sticking_turn(
    xs: Floats, ys: Floats, loads: Floats, ux: float, uy: float, guess: float, q: tuple[float, float, float]
) -> float:
    """Return the turn rate at which friction has no torque about the contact, for a velocity there."""
    low = high = turn = guess
    below = above = False
    stride = 1.0
    for i in range(BISECTIONS):
        _, _, torque, _, _, _, _, _, slope = balance(xs, ys, loads, ux, uy, turn, q[0], q[1], q[2])
        if abs(torque) <= SMALL:
            break
        if torque < 0.0:
            low, below = turn, True
        else:
            high, above = turn, True
        further = turn - torque / slope if slope > 0.0 else turn
        if below and above:
            if i % 4 == 3 or not low < further < high:  # Newton's method alone may creep up from one side
                further = 0.5 * (low + high)
            if high - low <= 1e-15 * (abs(low) + abs(high)):
                break
        elif abs(further - turn) > stride or further == turn:
            further = turn + (stride if torque < 0.0 else -stride)
            stride *= 4.0
        if abs(further - turn) <= 1e-15 * abs(turn):
            break
        turn = further
    return turn


@jit
def sliding(
    xs: Floats, ys: Floats, loads: Floats, n: tuple[float, float], vn: float, friction: float,
    guess: tuple[float, float], q: tuple[float, float, float],
) -> tuple[bool, float, float]:  # fmt: skip
    """Return whether Newton's method found the slide, and its velocity along t and turn rate.

    friction: signed, positive where the force is on the left edge of the cone. guess: from where it starts.
    """
    nx, ny = n
    ex, ey = -ny - friction * nx, nx - friction * ny  # across the edge of the cone
    along, turn = guess
    fx, fy, torque, hxx, hxy, hyy, hxt, hyt, htt = balance(
        xs, ys, loads, vn * nx - along * ny, vn * ny + along * nx, turn, q[0], q[1], q[2]
    )
    across = ex * fx + ey * fy
    for _ in range(STEPS):
        size = across * across + torque * torque
        if size <= SMALL * SMALL:
            break
        # t = (-ny, nx)
        aa = ex * (hxy * nx - hxx * ny) + ey * (hyy * nx - hxy * ny)
        at, ta = ex * hxt + ey * hyt, hyt * nx - hxt * ny
        det = aa * htt - at * ta
        if det == 0.0:
            return False, along, turn
        step_along, step_turn = (at * torque - htt * across) / det, (ta * across - aa * torque) / det
        share = 1.0
        while True:
            a, w = along + share * step_along, turn + share * step_turn
            fx, fy, torque, hxx, hxy, hyy, hxt, hyt, htt = balance(
                xs, ys, loads, vn * nx - a * ny, vn * ny + a * nx, w, q[0], q[1], q[2]
            )
            across = ex * fx + ey * fy
            if across * across + torque * torque < size:
                break
            share *= 0.5
            if share < 0.1:
                return size <= CLOSE * CLOSE and nx * fx + ny * fy > 0.0, along, turn
        along, turn = a, w
    else:
        return False, along, turn
    return nx * fx + ny * fy > 0.0, along, turn


@jit
def sliding_by_halves(
    xs: Floats, ys: Floats, loads: Floats, n: tuple[float, float], v: tuple[float, float], mode: int, friction: float,
    turn: float, q: tuple[float, float, float],
) -> tuple[float, float]:  # fmt: skip
    """Return the slide's velocity along t and turn rate, by halving the angle in which its direction is."""
    nx, ny = n
    vn, along = v
    sense = 1.0 if mode == LEFT else -1.0
    low_n, low_t = 0.0, -sense
    high_n, high_t = v
    for _ in range(BISECTIONS):
        mid_n, mid_t = low_n + high_n, low_t + high_t
        size = sqrt(mid_n * mid_n + mid_t * mid_t)
        mid_n, mid_t = mid_n / size, mid_t / size
        if (mid_n == low_n and mid_t == low_t) or (mid_n == high_n and mid_t == high_t):
            break
        along = vn * mid_t / mid_n
        ux, uy = vn * nx - along * ny, vn * ny + along * nx
        turn = sticking_turn(xs, ys, loads, ux, uy, turn, q)
        fx, fy, _, _, _, _, _, _, _ = balance(xs, ys, loads, ux, uy, turn, q[0], q[1], q[2])
        ft = sense * (fy * nx - fx * ny)
        if ft > 0.0 and ft > friction * (fx * nx + fy * ny):
            high_n, high_t = mid_n, mid_t
        else:
            low_n, low_t = mid_n, mid_t
    return along, turn


@jit
def solve(
    xs: Floats, ys: Floats, shares: Floats, lean: tuple[float, float], c: tuple[float, float], n: tuple[float, float],
    v: tuple[float, float], friction: float, last: tuple[int, float, float], q: tuple[float, float, float],
) -> tuple[int, float, float, float, float, float]:  # fmt: skip
    """Return the mode, the velocity along n and t at the contact, the turn rate, and the force along n and t.

    xs, ys (m), shares: the points, from their centre. lean: slope of the pressure (1/m). c: the contact, from there.
    n: inward normal. v: velocity of the pusher along n and t, of size 1, v[0] at least 0. last: mode, turn rate and
    velocity along t of a motion nearby, as a start. The force is per that of all points sliding one way.
    """
    x, y, loads = xs.copy(), ys.copy(), shares.copy()
    for i in range(len(xs)):
        factor = 1.0 + lean[0] * xs[i] + lean[1] * ys[i]
        if factor < 0.0:
            return LIFTING, 0.0, 0.0, 0.0, 0.0, 0.0
        loads[i] = shares[i] * factor
        x[i] = xs[i] - c[0]
        y[i] = ys[i] - c[1]
    nx, ny = n
    mode, turn, along = last
    vn, vt = v
    if mode != STICKING and vn > 0.0:
        signed = friction if mode == LEFT else -friction
        found, along, rate = sliding(x, y, loads, n, vn, signed, (along, turn), q)
        if found and (along < vt if mode == LEFT else along > vt):
            return slid(x, y, loads, n, mode, vn, along, rate, q)
    ux, uy = vn * nx - vt * ny, vn * ny + vt * nx
    turn = sticking_turn(x, y, loads, ux, uy, turn, q)
    fx, fy, _, _, _, _, _, _, _ = balance(x, y, loads, ux, uy, turn, q[0], q[1], q[2])
    fn, ft = fx * nx + fy * ny, fy * nx - fx * ny
    if fn >= 0.0 and abs(ft) <= friction * fn:
        return STICKING, vn, vt, turn, fn, ft
    if vn == 0.0:
        return RESTING, 0.0, 0.0, 0.0, 0.0, 0.0
    mode = LEFT if ft > 0.0 else RIGHT
    signed = friction if mode == LEFT else -friction
    found, along, rate = sliding(x, y, loads, n, vn, signed, (vt, turn), q)
    if not (found and (along < vt if mode == LEFT else along > vt)):
        along, rate = sliding_by_halves(x, y, loads, n, v, mode, friction, turn, q)
    return slid(x, y, loads, n, mode, vn, along, rate, q)


@jit
def slid(
    xs: Floats, ys: Floats, loads: Floats, n: tuple[float, float], mode: int, vn: float, along: float, turn: float,
    q: tuple[float, float, float],
) -> tuple[int, float, float, float, float, float]:  # fmt: skip
    """Return what `solve` does for a slide that was found."""
    nx, ny = n
    fx, fy, _, _, _, _, _, _, _ = balance(
        xs, ys, loads, vn * nx - along * ny, vn * ny + along * nx, turn, q[0], q[1], q[2]
    )
    return mode, vn, along, turn, fx * nx + fy * ny, fy * nx - fx * ny
