"""Software tare of the FT 300: the mean of samples at rest, or a reason why it cannot be trusted. Pure.

The sensor has no zero command, and its bias of tens of newtons changes at every power cycle. The mean holds bias
and tool weight together, so it is valid only while the arm keeps its pose and the base stays level.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import msgspec

from robot_io.errors import DeviceNotReady
from robot_io.messages import SensorWrench

Vector6 = tuple[float, float, float, float, float, float]

AXES = ("fx", "fy", "fz", "mx", "my", "mz")
UNITS = ("N", "N", "N", "N*m", "N*m", "N*m")

NOISE_FACTOR = 2.0
"""Refuse a standard deviation above this many times the sensor's own noise."""
DRIFT_STANDARD_ERRORS = 4.0
DRIFT_FLOOR = (0.1, 0.1, 0.1, 0.005, 0.005, 0.005)
"""Drift that is always allowed (N, N*m): the resolution of the sensor and what no push would notice."""
BIAS_LIMIT = (150.0, 150.0, 150.0, 15.0, 15.0, 15.0)
"""Half of the measuring range (N, N*m): a greater bias leaves too little of it for pushing."""
SMALLEST_COUNT = 8
"""Fewer samples do not make quarters."""


class Tare(msgspec.Struct, frozen=True, gc=False):
    """Bias and standard deviation per axis (N, N*m, SENSOR frame; fx fy fz mx my mz) of `count` samples."""

    bias: Vector6
    sd: Vector6
    count: int


def tare(samples: Sequence[SensorWrench], noise_force_N: float, noise_torque_Nm: float, *, needed: int = 100) -> Tare:
    """Return the mean of `samples` (in order of time, at rest, out of contact).

    The noise is the sensor's own, one standard deviation per axis. Raises DeviceNotReady when there are fewer
    than `needed` samples (at least 8), when a reading is not finite, when it moves (standard deviation above
    twice the noise, or a drift from the first to the last quarter beyond 4 standard errors and a small floor),
    or when the bias leaves less than half of the range.
    """
    if len(samples) < max(needed, SMALLEST_COUNT):
        raise _refusal(
            f"only {len(samples)} of {max(needed, SMALLEST_COUNT)} samples came", "Check that the sensor streams"
        )
    noise = (noise_force_N,) * 3 + (noise_torque_Nm,) * 3
    bias, sd = [], []
    for axis, name in enumerate(AXES):
        values = [_component(sample, name) for sample in samples]
        mean = math.fsum(values) / len(values)
        deviation = _standard_deviation(values, mean)
        _require_steady(axis, values, deviation, noise[axis])
        if not abs(mean) <= BIAS_LIMIT[axis]:
            raise _refusal(
                f"{name} reads {mean:.3g} {UNITS[axis]} at rest, which leaves too little range "
                f"(limit {BIAS_LIMIT[axis]:g} {UNITS[axis]})",
                "Make sure that nothing presses on the tool; power-cycle the sensor",
            )
        bias.append(mean)
        sd.append(deviation)
    return Tare(_vector(bias), _vector(sd), len(samples))


def _require_steady(axis: int, values: Sequence[float], deviation: float, noise: float) -> None:
    name, unit = AXES[axis], UNITS[axis]
    wait = "Keep arm, base and tool still and free of contact, then tare again"
    if not deviation <= NOISE_FACTOR * noise:
        raise _refusal(
            f"{name} is not settled: it varies by {deviation:.3g} {unit} (at most {NOISE_FACTOR * noise:.3g})", wait
        )
    quarter = len(values) // 4
    first, last = values[:quarter], values[-quarter:]
    mean_first, mean_last = math.fsum(first) / quarter, math.fsum(last) / quarter
    # Noise within the quarters, because over all samples a drift would excuse itself.
    variance = (_standard_deviation(first, mean_first) ** 2 + _standard_deviation(last, mean_last) ** 2) / 2
    allowed = DRIFT_STANDARD_ERRORS * math.sqrt(2 * variance / quarter) + DRIFT_FLOOR[axis]
    if not abs(mean_last - mean_first) <= allowed:
        raise _refusal(
            f"{name} is not settled: it drifts by {mean_last - mean_first:.3g} {unit} (at most {allowed:.3g})", wait
        )


def _standard_deviation(values: Sequence[float], mean: float) -> float:
    return math.sqrt(math.fsum((value - mean) ** 2 for value in values) / (len(values) - 1))


def _component(sample: SensorWrench, name: str) -> float:
    value: float = getattr(sample, name)
    if not math.isfinite(value):
        raise _refusal(f"{name} is {value}", "Check the sensor")
    return value


def _vector(values: Sequence[float]) -> Vector6:
    fx, fy, fz, mx, my, mz = values
    return fx, fy, fz, mx, my, mz


def _refusal(what: str, do: str) -> DeviceNotReady:
    return DeviceNotReady(what, where="ft300 tare", do=do)
