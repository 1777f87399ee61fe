"""Steps of a base that rolls on and of a slider that its ball pushes on, on plain floats.

Only what nearly every step of a push is: the base keeps its velocity, the ball keeps touching the same face or disc,
and the floor resists along the push. Whatever else comes ends it before the step in which it comes.

The same source runs plain and compiled by numba, to the same bits: there are only operations that IEEE 754 rounds
correctly (a square root instead of `hypot`), and the sine and cosine of the machine's library. It is one function,
with what `slider_exact`, `floor`, `base_plant` and `contact` say in as many: a call costs the plain one as much as
ten multiplications, and the compiled one its place in numba's cache.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from math import cos, sin, sqrt
from typing import Any, cast

from sim_backend.physics.contact import LATER_TURNS
from sim_backend.physics.floor import LIFTED
from sim_backend.physics.slider_exact import TINY

Floats = Any
"""A list of floats or, compiled, a numpy array of them."""
Kernel = Callable[[Floats, Floats, int], int]
"""given, state, steps -> steps done; see `GIVEN` and `STATE`."""

GIVEN = (
    *("vx", "vy", "omega"),  # the base's velocity, BODY frame of the base, m/s and rad/s
    *("dt", "grip", "reach_x", "reach_y"),  # s; share of the wheels' way that is not lost; the ball on the base, m
    *("radius", "longest", "rest"),  # of the ball, m; its longest step, m; the speed below which it rests, m/s
    *("xx", "xy", "yy", "shift", "off_x", "off_y"),  # the pressure's moments, m^2; how it moves with the push, m
    *("cof_x", "cof_y", "f_max", "friction"),  # centre of friction at rest, m; N; of the contact
    *("disc", "face_x", "face_y", "offset", "low", "high"),  # a disc's radius, m; or a face, see `FaceRow`
)
"""What does not change in between, in order."""
STATE = (
    *("base_x", "base_y", "base_yaw", "ball_x", "ball_y"),  # WORLD, m and rad
    *("x", "y", "heading", "cos", "sin"),  # the slider's body origin, WORLD
    *("nx", "ny", "cx", "cy", "push_x", "push_y"),  # contact and push, BODY frame of the slider
    *("force_x", "force_y", "contact_x", "contact_y", "normal_x", "normal_y", "mode"),  # the last step's, WORLD
)
"""What a step changes, in order."""


def plain(given: Floats, state: Floats, steps: int) -> int:
    """Do at most so many steps, as long as they go on as they are; change `state` and return how many were done."""
    v_x, v_y, omega, dt, grip, reach_x, reach_y, radius, longest, rest, xx, xy, yy = given[:13]
    shift, off_x, off_y, cof_x, cof_y, f_max, friction, disc, face_x, face_y, offset, low, high = given[13:]
    base_x, base_y, yaw, ball_x, ball_y, x, y, heading, c, s, nx, ny, cx, cy, push_x, push_y = state[:16]
    force_x = force_y = at_x = at_y = normal_x = normal_y = mode = 0.0
    turned = omega * dt
    done = 0
    while done < steps:
        # the base rolls on, and the ball with it
        cb, sb = cos(yaw + 0.5 * turned), sin(yaw + 0.5 * turned)
        to_base_x = base_x + (v_x * cb - v_y * sb) * (dt * grip)
        to_base_y = base_y + (v_x * sb + v_y * cb) * (dt * grip)
        cb, sb = cos(yaw + turned), sin(yaw + turned)
        to_x, to_y = to_base_x + cb * reach_x - sb * reach_y, to_base_y + sb * reach_x + cb * reach_y
        dx, dy = to_x - ball_x, to_y - ball_y
        way = sqrt(dx * dx + dy * dy)
        if not (rest * dt <= way <= longest):
            break
        ux, uy = (c * dx + s * dy) / dt, (c * dy - s * dx) / dt
        vn, vt = ux * nx + uy * ny, uy * nx - ux * ny
        if vn < 0.0:
            break
        # what the slider answers: the floor's grip depends on the push, and the push on the grip
        to_push_x, to_push_y, size, f_x, f_y, vx, vy, turn = push_x, push_y, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for _ in range(LATER_TURNS):
            size = sqrt(to_push_x * to_push_x + to_push_y * to_push_y)
            px, py = to_push_x / size, to_push_y / size
            square, lean = xx * px * px + 2.0 * xy * px * py + yy * py * py, shift + off_x * px + off_y * py
            dd = max(square - lean * lean, square * LIFTED)
            f_x, f_y = cof_x + shift * px, cof_y + shift * py
            jn, jt = (cx - f_x) * ny - (cy - f_y) * nx, (cx - f_x) * nx + (cy - f_y) * ny
            ann, ant, att, det = 1.0 + jn * jn / dd, jn * jt / dd, 1.0 + jt * jt / dd, 1.0 + (jn * jn + jt * jt) / dd
            stick_t, limit = ann * vt - ant * vn, friction * vn * det
            if ann + friction * ant > 0.0 and stick_t * (ann + friction * ant) > limit:
                mode, hn = 1.0, vn / (ann + friction * ant)
                ht = friction * hn
            elif ann - friction * ant > 0.0 and -stick_t * (ann - friction * ant) > limit:
                mode, hn = 2.0, vn / (ann - friction * ant)
                ht = -friction * hn
            else:
                mode, hn, ht = 0.0, (att * vn - ant * vt) / det, stick_t / det
            turn = (jn * hn + jt * ht) / dd
            size = sqrt(hn * hn + ht * ht + dd * turn * turn)
            if size < TINY:
                break
            vx, vy = hn * nx - ht * ny, hn * ny + ht * nx
            to_push_x, to_push_y = vx * (f_max / size), vy * (f_max / size)
        if size < TINY:
            break
        # it turns about its centre of friction, and the ball has to touch the same face of it
        on_x, on_y = x + c * f_x - s * f_y + (c * vx - s * vy) * dt, y + s * f_x + c * f_y + (s * vx + c * vy) * dt
        to_c, to_s = cos(heading + turn * dt), sin(heading + turn * dt)
        on_x, on_y = on_x - (to_c * f_x - to_s * f_y), on_y - (to_s * f_x + to_c * f_y)
        bx, by = to_c * (to_x - on_x) + to_s * (to_y - on_y), to_c * (to_y - on_y) - to_s * (to_x - on_x)
        if disc > 0.0:
            out = sqrt(bx * bx + by * by)
            if not out > disc:
                break
            to_nx, to_ny, out = -bx / out, -by / out, out - disc
        else:
            to_nx, to_ny, out = face_x, face_y, offset - (face_x * bx + face_y * by)
            if not (out > 0.0 and low <= face_x * by - face_y * bx <= high):
                break
        force_x, force_y = c * to_push_x - s * to_push_y, s * to_push_x + c * to_push_y
        at_x, at_y, normal_x, normal_y = x + c * cx - s * cy, y + s * cx + c * cy, c * nx - s * ny, s * nx + c * ny
        base_x, base_y, yaw, ball_x, ball_y = to_base_x, to_base_y, yaw + turned, to_x, to_y
        heading, c, s, push_x, push_y, nx, ny = heading + turn * dt, to_c, to_s, to_push_x, to_push_y, to_nx, to_ny
        cx, cy = bx + out * nx, by + out * ny
        gap_x, gap_y = (radius - out) * nx, (radius - out) * ny  # the Euler step's error, of second order
        x, y = on_x + c * gap_x - s * gap_y, on_y + s * gap_x + c * gap_y
        done += 1
    state[0], state[1], state[2], state[3], state[4] = base_x, base_y, yaw, ball_x, ball_y
    state[5], state[6], state[7], state[8], state[9] = x, y, heading, c, s
    state[10], state[11], state[12], state[13], state[14], state[15] = nx, ny, cx, cy, push_x, push_y
    state[16], state[17], state[18], state[19], state[20], state[21] = force_x, force_y, at_x, at_y, normal_x, normal_y
    state[22] = mode
    return done


@cache
def compiled() -> Kernel | None:
    """Return the kernel compiled, None without numba (an extra)."""
    try:
        import numba
    except ImportError:
        return None
    if vars(numba.config)["DISABLE_JIT"]:
        return None
    return cast("Kernel", numba.njit(cache=True, nogil=True, error_model="numpy")(plain))
