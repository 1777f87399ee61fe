"""Taring as a fold: sums of readings at rest, then bias and a judgement.

The bias holds the sensor's own offset *and* the weight of the tool. It is valid while the arm stays at that
pose, the base stays level, and the sensor stays powered.
"""

from __future__ import annotations

import math
from enum import IntEnum

from robot_io.config import FtConfig
from robot_io.tick import FtReading, TareState, Vector6

SATURATION_FORCE_N = 150.0
"""A bias beyond this leaves less than half of the FT 300's 300 N range."""
SATURATION_TORQUE_NM = 15.0
NOISE_FACTOR = 2.0
"""At rest the readings scatter by no more than twice the product sheet's noise."""
DRIFT_ERRORS = 4.0
"""The two halves of the tare may differ by this many standard errors of the sheet's noise."""


class Refusal(IntEnum):
    """Why a tare is refused."""

    NONE = 0
    UNSETTLED = 1
    SATURATED = 2


def wanted_readings(config: FtConfig) -> int:
    """Return how many readings a tare needs (the sensor gives 100 in a second)."""
    return round(100 * config.tare_seconds_s)


def add(state: TareState, reading: FtReading, wanted: int) -> TareState:
    """Return the sums with one more reading (N, N*m in the SENSOR frame)."""
    values = (*reading.force, *reading.torque)
    first = state.first_half
    return TareState(
        state.count + 1,
        _plus(state.total, values),
        _plus(state.squares, _squared(values)),
        _plus(first, values) if state.count < wanted // 2 else first,
    )


def judge(state: TareState, config: FtConfig) -> tuple[Refusal, Vector6]:
    """Return whether the tare holds and the bias (mean) it gives; needs at least two readings."""
    n = state.count
    mean = _scaled(state.total, 1.0 / n)
    half = wanted_readings(config) // 2
    for axis in range(6):
        noise = config.noise_force_N if axis < 3 else config.noise_torque_Nm
        limit = SATURATION_FORCE_N if axis < 3 else SATURATION_TORQUE_NM
        if not math.isfinite(mean[axis]) or abs(mean[axis]) > limit:
            return Refusal.SATURATED, mean
        variance = max(state.squares[axis] / n - mean[axis] ** 2, 0.0)
        if math.sqrt(variance) > NOISE_FACTOR * noise:
            return Refusal.UNSETTLED, mean
        first = state.first_half[axis] / half
        second = (state.total[axis] - state.first_half[axis]) / max(n - half, 1)
        if abs(first - second) > DRIFT_ERRORS * noise * math.sqrt(2.0 / half):
            return Refusal.UNSETTLED, mean
    return Refusal.NONE, mean


def _plus(a: Vector6, b: Vector6) -> Vector6:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5])


def _squared(a: Vector6) -> Vector6:
    return (a[0] * a[0], a[1] * a[1], a[2] * a[2], a[3] * a[3], a[4] * a[4], a[5] * a[5])


def _scaled(a: Vector6, k: float) -> Vector6:
    return (a[0] * k, a[1] * k, a[2] * k, a[3] * k, a[4] * k, a[5] * k)
