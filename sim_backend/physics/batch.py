"""Many lanes of a simulation study in compiled code: the arithmetic of `lanes.simulate_lane`, 35 times faster.

numba is loaded here and nowhere else, so only sweeps and tuning need it. The kernel works in the contact frame
(angle psi = phi - s/radius on a circle, phi on a face), where a slider is described by two lever arms: jn, jt.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, cos, sin
from typing import TYPE_CHECKING, Any

import numpy as np

from robot_io.errors import EnvironmentFault
from sim_backend.physics.lanes import (
    COUNTED_M,
    FADE_M,
    MAX_INTEGRAL_RAD,
    STRAIGHT_RAD,
    TURNED_RAD,
    Lane,
    LaneEnd,
    LaneResult,
    Timing,
)

try:
    from numba import njit
except ImportError as error:
    raise EnvironmentFault(
        "numba is not installed", where="sweep", do="Run `make dev` in the program's folder"
    ) from error

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

PARAMETERS = 14
LAW_NUMBERS = {"force": 0.0, "open-loop": 1.0, "line": 2.0, "force-integral": 3.0}
STATISTICS = 9
"""Columns of a result row: end, steps, max |y|, max |y_c|, max |theta_p|, min v_n/|v|, sticking, left, right."""


@njit(cache=True, nogil=True, error_model="numpy")
def _run(lanes: Any, dt: float, steps: int, every: int, states: Any, finals: Any, statistics: Any) -> None:
    """Run every row of `lanes`; fill `states` (lane, record, 6), `finals` (lane, 6), `statistics` (lane, 9)."""
    for i in range(lanes.shape[0]):
        is_round = lanes[i, 0] != 0.0
        reach, half_width, d, mu = lanes[i, 1], lanes[i, 2], lanes[i, 3], lanes[i, 4]
        y, phi, s = lanes[i, 5], lanes[i, 6], lanes[i, 7]
        gain_f, k_y, speed, f_max = lanes[i, 8] + 1.0, lanes[i, 9], lanes[i, 10], lanes[i, 11]
        law, k_i = lanes[i, 12], lanes[i, 13]
        way, integral = speed * dt, 0.0
        x, fx, fy = 0.0, 1.0, 0.0
        v_x, v_y = fx, fy  # the slider's centre moves along the force, so this gives the force's direction earlier
        straight = 0.0 if is_round else 1.0
        per_length = 1.0 / reach if is_round else 0.0
        per_d = 1.0 / d
        per_dd = per_d * per_d
        jt = -reach
        att = 1.0 + jt * jt * per_dd
        max_y = max_y_c = max_theta = 0.0
        min_ratio = 1.0
        sticking = left = right = 0
        end = 0
        step = 0
        record = 0
        until_record = 0
        while True:
            if until_record == 0:
                states[i, record, 0], states[i, record, 1], states[i, record, 2] = x, y, phi
                states[i, record, 3], states[i, record, 4], states[i, record, 5] = s, fx, fy
                record += 1
                until_record = every
            until_record -= 1
            psi = phi - s * per_length
            n_x, n_y = cos(psi), sin(psi)
            jn = -s * straight
            y_c = y + jt * n_y - jn * n_x
            max_y = max(max_y, abs(y))
            max_y_c = max(max_y_c, abs(y_c))
            if step == steps:
                break
            if abs(s) > half_width:
                end = 1
                break
            if law == 0.0:
                theta_p = gain_f * atan2(v_y, v_x) + k_y * y_c
            elif law == 1.0:
                theta_p = 0.0
            elif law == 2.0:
                theta_p = -k_y * y_c
            else:
                theta_p = gain_f * atan2(v_y, v_x) + k_y * y_c
                share = min(max((TURNED_RAD - abs(theta_p + integral)) / (TURNED_RAD - STRAIGHT_RAD), 0.0), 1.0)
                counted = min(max(y_c, -COUNTED_M), COUNTED_M) * share
                change = k_i * FADE_M / max(step * way, FADE_M) * counted * way
                integral = min(max(integral + change, -MAX_INTEGRAL_RAD), MAX_INTEGRAL_RAD)
                theta_p += integral
            max_theta = max(max_theta, abs(theta_p))
            ratio = cos(theta_p - psi)
            min_ratio = min(min_ratio, ratio)
            v_n, v_t = speed * ratio, speed * sin(theta_p - psi)
            ann = 1.0 + jn * jn * per_dd
            ant = jn * jt * per_dd
            det = 1.0 + (jn * jn + jt * jt) * per_dd
            stick_t = ann * v_t - ant * v_n
            limit = mu * v_n * det
            g_left = ann + mu * ant
            g_right = ann - mu * ant
            if v_n < 0.0:
                end = 2
                break
            if g_left > 0.0 and stick_t * g_left > limit:
                h_n = v_n / g_left
                h_t = mu * h_n
                slip = v_t - ant * h_n - att * h_t
            elif g_right > 0.0 and -stick_t * g_right > limit:
                h_n = v_n / g_right
                h_t = -mu * h_n
                slip = v_t - ant * h_n - att * h_t
            else:
                per_det = 1.0 / det
                h_n = (att * v_n - ant * v_t) * per_det
                h_t = stick_t * per_det
                slip = 0.0
            turn = (jn * h_n + jt * h_t) * per_d
            size = np.sqrt(h_n * h_n + h_t * h_t + turn * turn)
            if size < 1e-150:
                end = 2
                break
            if slip == 0.0:
                sticking += 1
            elif slip > 0.0:
                left += 1
            else:
                right += 1
            v_x, v_y = h_n * n_x - h_t * n_y, h_n * n_y + h_t * n_x
            scale = f_max / size
            fx, fy = v_x * scale, v_y * scale
            x += v_x * dt
            y += v_y * dt
            phi += turn * per_d * dt
            s += slip * dt
            step += 1
        finals[i, 0], finals[i, 1], finals[i, 2], finals[i, 3], finals[i, 4], finals[i, 5] = x, y, phi, s, fx, fy
        statistics[i, 0], statistics[i, 1] = end, step
        statistics[i, 2], statistics[i, 3], statistics[i, 4], statistics[i, 5] = max_y, max_y_c, max_theta, min_ratio
        statistics[i, 6], statistics[i, 7], statistics[i, 8] = sticking, left, right


def run_batch(lanes: Sequence[Lane], timing: Timing) -> tuple[list[LaneResult], Floats]:
    """Run lanes; return their results and the states, shape (lanes, timing.records, 6), NaN after a lane's end."""
    states = np.full((len(lanes), timing.records, 6), np.nan)
    finals, statistics = np.empty((len(lanes), 6)), np.empty((len(lanes), STATISTICS))
    run_arrays(parameters(lanes), timing, states, finals, statistics)
    results = []
    for final, row in zip(finals.tolist(), statistics.tolist(), strict=True):
        x, y, phi, s, fx, fy = final
        results.append(
            LaneResult(
                LaneEnd(int(row[0])), int(row[1]), (x, y, phi, s, fx, fy), row[2], row[3], row[4], row[5],
                int(row[6]), int(row[7]), int(row[8]),
            )
        )  # fmt: skip
    return results, states


def parameters(lanes: Sequence[Lane]) -> Floats:
    """Return lanes as the rows of numbers the kernel takes, shape (lanes, 14)."""
    rows = [
        (
            lane.round, lane.reach_m, np.inf if lane.round else lane.half_width_m, lane.d_m, lane.contact_friction,
            lane.y0_m, lane.phi0_rad, lane.s0_m, lane.k_f, lane.k_y_rad_per_m, lane.speed_m_per_s, lane.f_max_N,
            LAW_NUMBERS[lane.law], lane.k_i_rad_per_m2,
        )
        for lane in lanes
    ]  # fmt: skip
    return np.array(rows, dtype=np.float64).reshape(len(rows), PARAMETERS)


def run_arrays(rows: Floats, timing: Timing, states: Floats, finals: Floats, statistics: Floats) -> None:
    """Run the compiled kernel on prepared arrays (see `run_batch` for their shapes)."""
    _run(rows, timing.dt_s, timing.steps, timing.record_every, states, finals, statistics)
