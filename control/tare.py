"""Software tare of the force-torque sensor: the mean of samples at rest, or a reason why it cannot be trusted. Pure.

The FT 300 has no zero command, and its bias of tens of newtons changes at every power cycle. The mean contains bias
and tool weight together, so it is valid only while the arm keeps its pose and the base stays level.
The samples are added to sums one by one as they arrive (`add`), then judged (`judge`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import msgspec

from robot_io.messages import Vector3, Vector6
from robot_io.named_values import Refusal as Refusal
from robot_io.tick import Counts6, TareSums

AXES = ("fx", "fy", "fz", "mx", "my", "mz")
UNITS = ("N", "N", "N", "N*m", "N*m", "N*m")

NOISE_FACTOR = 2.0
"""Refuse a standard deviation above this many times the sensor's own noise."""
DRIFT_STANDARD_ERRORS = 4.0
"""Of a drift, if the noise were known: what white noise exceeds once in 16,000 times (4 sigma)."""
DRIFT_FLOOR = (0.1, 0.1, 0.1, 0.005, 0.005, 0.005)
"""Drift (N, N*m) that is always allowed, too small to affect a push; the sensor's resolution if that is coarser."""
BIAS_SHARE = 0.5
"""A bias above this share of the range leaves too little of it for pushing."""
SMALLEST_COUNT = 8
"""Fewer samples cannot be split into quarters."""
DEAD_AT_MOST = 3
"""An axis with no more distinct values than this over a whole tare is dead, whatever noise its data sheet states."""

PLAUSIBLE_N = 3.0
"""A force below this says nothing of its direction: a saved tare may be off by so much."""
VERTICAL_SHARE = 0.5
"""An object is pressed ahead: up or down it takes less than this share of the horizontal force."""

Flags6 = tuple[bool, bool, bool, bool, bool, bool]

_ZERO: Vector6 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class Tare(msgspec.Struct, frozen=True, gc=False):
    """Bias and standard deviation per axis (N, N*m, SENSOR frame; fx fy fz mx my mz) of `count` samples."""

    bias: Vector6
    sd: Vector6
    count: int


class Judgement(msgspec.Struct, frozen=True, gc=False):
    """A tare, and why it is refused: `what` is wrong and what to `do` (both "" when it is accepted)."""

    tare: Tare
    refusal: Refusal = Refusal.NONE
    what: str = ""
    do: str = ""


def add(sums: TareSums, values: Vector6, wanted: int, resolution: Vector6) -> TareSums:
    """Return the sums with one more sample; `wanted` is the final number of samples, which determines the quarters.

    resolution: two values that differ by less than half a step of it are the same one.
    """
    n, quarter = sums.count, wanted // 4
    origin = sums.origin if n else values
    offset = _minus(values, origin)
    square = _squared(offset)
    early, late = n < quarter, n >= wanted - quarter
    second, third, distinct = _distinct(sums, values, resolution) if n else (values, values, (1,) * 6)
    return TareSums(
        n + 1,
        origin,
        _plus(sums.total, offset),
        _plus(sums.squares, square),
        _plus(sums.first, offset) if early else sums.first,
        _plus(sums.first_squares, square) if early else sums.first_squares,
        _plus(sums.last, offset) if late else sums.last,
        _plus(sums.last_squares, square) if late else sums.last_squares,
        second,
        third,
        distinct,
    )


def _distinct(sums: TareSums, values: Vector6, resolution: Vector6) -> tuple[Vector6, Vector6, Counts6]:
    """Return the second and the third distinct value of each axis, and how many there were: 4 stands for more."""
    if min(sums.distinct) > DEAD_AT_MOST:
        return sums.second, sums.third, sums.distinct
    second, third, distinct = list(sums.second), list(sums.third), list(sums.distinct)
    for i, value in enumerate(values):
        count = distinct[i]
        seen = (sums.origin[i], second[i], third[i])[:count]
        if count > DEAD_AT_MOST or any(abs(value - one) < resolution[i] / 2 for one in seen):
            continue
        if count == 1:
            second[i] = value
        elif count == 2:
            third[i] = value
        distinct[i] = count + 1
    a, b, c, d, e, f = distinct
    return _vector(second), _vector(third), (a, b, c, d, e, f)


def dead_axis(sums: TareSums, scatters: Flags6) -> str:
    """Return the name of the first axis that shows no more than 3 distinct values, "" if there is none.

    scatters: whether the readings of each axis scatter at all; those of a simulated world without noise do not.
    """
    return next((AXES[i] for i in range(6) if scatters[i] and sums.distinct[i] <= DEAD_AT_MOST), "")


def judge(
    sums: TareSums, noise: Vector6, sensor_range: Vector6, resolution: Vector6, scatters: Flags6 = (True,) * 6
) -> Judgement:
    """Return the tare of complete sums (at least SMALLEST_COUNT samples) and whether it can be trusted.

    noise, sensor_range, resolution: the sensor's figures per axis (N, N*m); the noise is one standard deviation.
    scatters: as for `dead_axis`.
    Refused: a reading that is not finite, one that is not steady (standard deviation above twice the noise, or a drift
    from the first to the last quarter beyond what noise explains and a small floor), a bias that leaves less than half
    of the range, an axis that is dead.
    """
    n, quarter = sums.count, sums.count // 4
    moments = [_mean_sd(sums.total[i], sums.squares[i], n) for i in range(6)]
    bias = [sums.origin[i] + moments[i][0] for i in range(6)]
    result = Tare(_vector(bias), _vector([sd for _, sd in moments]), n)
    wait = "Keep arm, base and tool still and free of contact, then tare again"
    for i, name in enumerate(AXES):
        unit = UNITS[i]
        if not math.isfinite(bias[i]):
            return Judgement(result, Refusal.UNSETTLED, f"{name} is {bias[i]}", "Check the sensor")
        sd, most = moments[i][1], NOISE_FACTOR * max(noise[i], resolution[i] / 2)
        if not sd <= most:
            what = f"{name} is not settled: it varies by {sd:.3g} {unit} (at most {most:.3g})"
            return Judgement(result, Refusal.UNSETTLED, what, wait)
        mean_first, sd_first = _mean_sd(sums.first[i], sums.first_squares[i], quarter)
        mean_last, sd_last = _mean_sd(sums.last[i], sums.last_squares[i], quarter)
        # Noise is measured within the quarters: over all samples a drift would raise the noise and so hide itself.
        variance = (sd_first * sd_first + sd_last * sd_last) / 2
        errors = _standard_errors(2 * (quarter - 1))
        allowed = errors * math.sqrt(2 * variance / quarter) + max(DRIFT_FLOOR[i], resolution[i])
        drift = mean_last - mean_first
        if not abs(drift) <= allowed:
            what = f"{name} is not settled: it drifts by {drift:.3g} {unit} (at most {allowed:.3g})"
            return Judgement(result, Refusal.UNSETTLED, what, wait)
        limit = BIAS_SHARE * sensor_range[i]
        if not abs(bias[i]) <= limit:
            what = f"{name} reads {bias[i]:.3g} {unit} at rest, which leaves too little range (limit {limit:g} {unit})"
            do = "Make sure that nothing presses on the tool; power-cycle the sensor"
            return Judgement(result, Refusal.SATURATED, what, do)
    if dead := dead_axis(sums, scatters):
        what = f"{dead} shows {sums.distinct[AXES.index(dead)]} distinct values in {n} readings: it measures nothing"
        return Judgement(result, Refusal.DEAD, what, "Check the sensor and its cable; power-cycle it")
    return Judgement(result)


def refusal_in_contact(sums: TareSums, scatters: Flags6, force: Vector3) -> Refusal:
    """Return why a run that starts in contact is refused: a dead axis, or a force that no object on the path can give.

    scatters: as for `dead_axis`. force: mean force on the slider at rest by the saved tare, N, PATH frame. An object in
    front of the ball is pressed along the path if at all, and hardly up or down.
    """
    if dead_axis(sums, scatters):
        return Refusal.DEAD
    level = math.hypot(force[0], force[1])
    backward = level > PLAUSIBLE_N and force[0] <= 0.0
    upright = abs(force[2]) > max(PLAUSIBLE_N, VERTICAL_SHARE * level)
    # An infinite or unknown level compares false here and there.
    finite = math.isfinite(level) and math.isfinite(force[2])
    return Refusal.IMPLAUSIBLE if backward or upright or not finite else Refusal.NONE


def _standard_errors(freedom: int) -> float:
    """Return how many estimated standard errors stand for DRIFT_STANDARD_ERRORS known ones.

    freedom: degrees of freedom of the estimate. Quantile of Student's t from that of the normal distribution
    (Abramowitz & Stegun 26.7.5): a short tare knows its own noise badly, and would refuse what is only noise.
    """
    z = DRIFT_STANDARD_ERRORS
    first, second = (z**3 + z) / 4, (5 * z**5 + 16 * z**3 + 3 * z) / 96
    return z + first / freedom + second / freedom**2


def _mean_sd(total: float, squares: float, n: int) -> tuple[float, float]:
    mean = total / n
    variance = (squares - n * mean * mean) / (n - 1)
    return mean, 0.0 if variance < 0.0 else math.sqrt(variance)  # negative by rounding; NaN stays NaN


def _plus(a: Vector6, b: Vector6) -> Vector6:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5])


def _minus(a: Vector6, b: Vector6) -> Vector6:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3], a[4] - b[4], a[5] - b[5])


def _squared(a: Vector6) -> Vector6:
    return (a[0] * a[0], a[1] * a[1], a[2] * a[2], a[3] * a[3], a[4] * a[4], a[5] * a[5])


def _vector(values: Sequence[float]) -> Vector6:
    fx, fy, fz, mx, my, mz = values
    return fx, fy, fz, mx, my, mz
