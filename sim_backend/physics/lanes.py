"""One lane of a simulation study: the paper's push of one slider, in plain Python with any contact solver.

The state is x, y, phi (centre and heading of the slider, path frame), s (the contact's place on the pushed face) and
the force of the previous step, which the law uses as its measurement. Explicit Euler, every right-hand side at the
old state. This is the readable reference for `batch.py`, which computes the same in compiled code.

The pusher is on the slider's -x side; s = 0 is the middle of that face (on a circle: of that side), positive towards
body +y; a circle's contact is at the angle pi - s/radius in the body frame.
"""

from __future__ import annotations

from enum import IntEnum
from math import atan2, cos, sin
from typing import Literal

import msgspec

from sim_backend.physics.slider_exact import ContactSolver, Moving, solve_exact

LaneLaw = Literal["force", "open-loop", "line", "force-integral"]
"""The shipped laws, as a rig names them."""
MAX_INTEGRAL_RAD, FADE_M = 0.5, 6.0
COUNTED_M, STRAIGHT_RAD, TURNED_RAD = 0.25, 0.2, 0.4
State = tuple[float, float, float, float, float, float]
"""x, y (m), phi (rad), s (m), fx, fy (N, path frame)."""


class LaneEnd(IntEnum):
    """How a lane ended."""

    OK = 0
    """All steps done."""
    EDGE = 1
    """The contact left the pushed face."""
    PULL = 2
    """The pusher moved away from the slider."""
    ERROR = 3
    """It could not be computed; the row says why."""


class Lane(msgspec.Struct, frozen=True):
    """Parameters of one lane. `half_width_m` is where the pushed face ends; a circle (`round`) has no end.

    reach_m: from the pushed face to the slider's centre (half the length, or the radius). d_m: tau_max/f_max.
    """

    round: bool
    reach_m: float
    half_width_m: float
    d_m: float
    contact_friction: float
    y0_m: float
    phi0_rad: float
    s0_m: float
    k_f: float = 0.1
    k_y_rad_per_m: float = 0.01
    speed_m_per_s: float = 0.1
    f_max_N: float = 1.0
    law: LaneLaw = "force"
    k_i_rad_per_m2: float = 0.0
    """Of the law with integral; its other settings are the constants above."""


class Timing(msgspec.Struct, frozen=True):
    """Duration and resolution: `steps` of `dt_s`; a state is recorded at the start and every `record_every` steps."""

    dt_s: float = 0.01
    steps: int = 60_000
    record_every: int = 1000

    @property
    def records(self) -> int:
        """Number of recorded states."""
        return self.steps // self.record_every + 1


class LaneResult(msgspec.Struct, frozen=True):
    """Result of a lane: steps done, last state, extremes over all steps, and how long each contact mode lasted."""

    end: LaneEnd
    steps: int
    final: State
    max_abs_y_m: float
    max_abs_y_c_m: float
    max_abs_theta_p_rad: float
    min_normal_speed_ratio: float
    """Least v_n / |v_p|; 1 if no step was done."""
    steps_sticking: int
    steps_left: int
    steps_right: int


def simulate_lane(
    lane: Lane, timing: Timing, solve: ContactSolver = solve_exact
) -> tuple[LaneResult, tuple[State, ...]]:
    """Run one lane; return its result and the states recorded until it ended."""
    x, y, phi, s = 0.0, lane.y0_m, lane.phi0_rad, lane.s0_m
    fx, fy, integral = 1.0, 0.0, 0.0
    records: list[State] = []
    max_y = max_y_c = max_theta = 0.0
    min_ratio, counts, end = 1.0, [0, 0, 0], LaneEnd.OK
    step = 0
    while True:
        if step % timing.record_every == 0:
            records.append((x, y, phi, s, fx, fy))
        turned = s / lane.reach_m if lane.round else 0.0
        nx, ny = cos(turned), -sin(turned)
        along = 0.0 if lane.round else s
        cx, cy = -lane.reach_m * nx, -lane.reach_m * ny + along
        c, si = cos(phi), sin(phi)
        y_c = y + si * cx + c * cy
        max_y, max_y_c = max(max_y, abs(y)), max(max_y_c, abs(y_c))
        if step == timing.steps:
            break
        if not lane.round and abs(s) > lane.half_width_m:
            end = LaneEnd.EDGE
            break
        theta_p = 0.0
        if lane.law in ("force", "force-integral"):
            theta_p = (lane.k_f + 1.0) * atan2(fy, fx) + lane.k_y_rad_per_m * y_c
        if lane.law == "line":
            theta_p = -lane.k_y_rad_per_m * y_c
        if lane.law == "force-integral":
            way = lane.speed_m_per_s * timing.dt_s
            gain = lane.k_i_rad_per_m2 * FADE_M / max(step * way, FADE_M)
            share = min(max((TURNED_RAD - abs(theta_p + integral)) / (TURNED_RAD - STRAIGHT_RAD), 0.0), 1.0)
            counted = min(max(y_c, -COUNTED_M), COUNTED_M) * share
            integral = min(max(integral + gain * counted * way, -MAX_INTEGRAL_RAD), MAX_INTEGRAL_RAD)
            theta_p += integral
        max_theta = max(max_theta, abs(theta_p))
        vx = lane.speed_m_per_s * cos(theta_p - phi)
        vy = lane.speed_m_per_s * sin(theta_p - phi)
        min_ratio = min(min_ratio, (vx * nx + vy * ny) / lane.speed_m_per_s)
        motion = solve(cx, cy, nx, ny, vx, vy, lane.d_m, lane.f_max_N, lane.contact_friction, None)
        if not isinstance(motion, Moving):
            end = LaneEnd.PULL
            break
        counts[motion.mode] += 1
        x += (c * motion.vx - si * motion.vy) * timing.dt_s
        y += (si * motion.vx + c * motion.vy) * timing.dt_s
        phi += motion.omega * timing.dt_s
        s += motion.slip * timing.dt_s
        fx, fy = c * motion.fx - si * motion.fy, si * motion.fx + c * motion.fy
        step += 1
    return (
        LaneResult(
            end, step, (x, y, phi, s, fx, fy), max_y, max_y_c, max_theta, min_ratio, counts[0], counts[1], counts[2]
        ),
        tuple(records),
    )
