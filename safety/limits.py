"""Hard ceilings of the program, each with its unit and reason; a rig file may only go below them."""

from __future__ import annotations

import math

import msgspec

from robot_io.errors import ConfigError
from robot_io.rig.config import RigConfig


class Ceiling(msgspec.Struct, frozen=True):
    """One ceiling: the rig key it bounds, the value in the key's unit, and why."""

    key: str
    value: float
    reason: str


CEILINGS = (
    Ceiling("limits.max_force_N", 150.0, "the authors of the paper stop at 150 N; half the sensor's range"),
    Ceiling("limits.slow_force_N", 100.0, "slow down well before the stop at 150 N"),
    Ceiling("limits.max_torque_Nm", 20.0, "two thirds of the sensor's 30 N*m range"),
    Ceiling("limits.max_acceleration_m_per_s2", 2.5, "what the Ridgeback's own controller allows"),
    Ceiling("limits.max_yaw_acceleration_rad_per_s2", 1.0, "what the Ridgeback's own controller allows"),
    Ceiling("limits.max_heading_error_deg", 20.0, "the force is rotated by the heading"),
    Ceiling("limits.drift_hold_rad", 0.01, "0.01 rad at 1 m reach is 1 cm at the contact"),
    Ceiling("limits.drift_stop_rad", 0.02, "the arm's own limit at rest is 0.05 rad"),
)

MAX_SPEED_M_PER_S = 0.75
"""No rig may command more: 1.5 times the fastest allowed push speed of 0.5 m/s."""
MAX_TURN_RATE_RAD_PER_S = 0.25
"""The authors' limit on the base's turn rate."""
SENSOR_RANGE_N = 300.0
"""FT 300 product sheet."""
SENSOR_RANGE_NM = 30.0
"""FT 300 product sheet."""


def check(rig: RigConfig) -> None:
    """Raise ConfigError where `rig` goes above a ceiling or contradicts itself."""
    problems = []
    for ceiling in CEILINGS:
        table, key = ceiling.key.split(".")
        value = getattr(getattr(rig, table), key)
        if not math.isfinite(value) or value > ceiling.value:
            problems.append(f"{ceiling.key} = {value:g} is above the ceiling of {ceiling.value:g} ({ceiling.reason})")
    if rig.limits.slow_force_N >= rig.limits.max_force_N:
        problems.append("limits.slow_force_N must be below limits.max_force_N")
    if rig.limits.drift_hold_rad >= rig.limits.drift_stop_rad:
        problems.append("limits.drift_hold_rad must be below limits.drift_stop_rad")
    if rig.control.force_min_N >= rig.limits.slow_force_N:
        problems.append("control.force_min_N must be below limits.slow_force_N")
    if rig.sliders.shortest_m > rig.sliders.longest_m:
        problems.append("sliders.shortest_m must not be above sliders.longest_m")
    if rig.control.approach_speed_m_per_s > speed_limit_m_per_s(rig):
        problems.append(
            "control.approach_speed_m_per_s is above the envelope (limits.envelope_factor x control.push_speed_m_per_s)"
        )
    if problems:
        raise ConfigError("; ".join(problems), where=rig.name, do="Lower the value in the rig file")


def speed_limit_m_per_s(rig: RigConfig) -> float:
    """Return the envelope's speed in m/s: a factor above the push speed, never above the ceiling."""
    return min(rig.limits.envelope_factor * rig.control.push_speed_m_per_s, MAX_SPEED_M_PER_S)
