"""Converts the sensor's reading into the force on the slider in the WORLD frame.

The sensor measures the *reaction on the tool*, with bias and tool weight. Taring removes both, as long as the
arm stays where it is and the base stays level. So
    force_on_slider_world = -R_z(yaw) base_from_sensor (reading - bias).
"""

from __future__ import annotations

import math

from robot_io.messages import Vector3
from robot_io.rig.types import Matrix3


def force_on_slider_world(
    reading: Vector3, bias: Vector3, base_from_sensor: Matrix3, yaw: float
) -> tuple[float, float, float]:
    """Return the force the tool exerts on the slider in N, WORLD frame.

    reading, bias: N, SENSOR frame. base_from_sensor: rotation, rows. yaw: measured heading of the base, rad.
    """
    sx, sy, sz = reading[0] - bias[0], reading[1] - bias[1], reading[2] - bias[2]
    (a, b, c), (d, e, f), (g, h, i) = base_from_sensor
    bx = a * sx + b * sy + c * sz
    by = d * sx + e * sy + f * sz
    bz = g * sx + h * sy + i * sz
    cos, sin = math.cos(yaw), math.sin(yaw)
    return -(cos * bx - sin * by), -(sin * bx + cos * by), -bz


def low_pass(previous: Vector3, sample: Vector3, dt_s: float, tau_s: float) -> Vector3:
    """Return the first-order low-pass of a vector, exact for any `dt_s`; tau_s = 0 passes the sample through."""
    if tau_s <= 0.0:
        return sample
    gain = -math.expm1(-dt_s / tau_s)
    return (
        previous[0] + gain * (sample[0] - previous[0]),
        previous[1] + gain * (sample[1] - previous[1]),
        previous[2] + gain * (sample[2] - previous[2]),
    )


def median_of_three(first: Vector3, second: Vector3, third: Vector3) -> Vector3:
    """Return the median of three readings, axis by axis: one wild packet never reaches the law.

    It delays by one packet. Where one of the three is not a number, it is the newest (`third`).
    """
    return (
        _median(first[0], second[0], third[0]),
        _median(first[1], second[1], third[1]),
        _median(first[2], second[2], third[2]),
    )


def _median(a: float, b: float, c: float) -> float:
    if not (a - a == 0.0 and b - b == 0.0 and c - c == 0.0):  # without order there is no median
        return c
    return max(min(a, b), min(max(a, b), c))
