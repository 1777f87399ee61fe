"""Speed along the path: a ramp up, a plateau, and a ramp down that ends at the wanted distance."""

from __future__ import annotations

import math

CREEP_M_PER_S = 0.01
"""The last millimetres are covered at this speed, so that the push never ends short of its distance."""


def push_speed(elapsed_s: float, start_speed: float, speed: float, ramp_s: float, remaining_m: float) -> float:
    """Return the speed in m/s `elapsed_s` into the push, with `remaining_m` to go.

    Ramps from `start_speed` to `speed` within `ramp_s`, and brakes at speed / ramp_s so as to stop after
    `remaining_m`; 0 from there on.
    """
    if remaining_m <= 0.0:
        return 0.0
    up = start_speed + (speed - start_speed) * min(elapsed_s / ramp_s, 1.0)
    braking = math.sqrt(2.0 * (speed / ramp_s) * remaining_m)
    return min(up, max(braking, min(CREEP_M_PER_S, speed)))


def approach_speed(elapsed_s: float, speed: float, ramp_s: float) -> float:
    """Return the speed in m/s `elapsed_s` into the approach."""
    return speed * min(elapsed_s / ramp_s, 1.0)
