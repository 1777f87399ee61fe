"""Hard ceilings of the program, each with its unit and reason; a rig file may only set lower values."""

from __future__ import annotations

import math

import msgspec

from robot_io.errors import ConfigError
from robot_io.rig.config import RigConfig


class Ceiling(msgspec.Struct, frozen=True):
    """One ceiling: the rig key it bounds, the value in the key's unit, and the reason."""

    key: str
    value: float
    reason: str


CEILINGS = (
    Ceiling("limits.max_force_N", 150.0, "the authors of the paper stop at 150 N"),
    Ceiling("limits.slow_force_N", 100.0, "slow down well before the stop at 150 N"),
    Ceiling("limits.max_torque_Nm", 20.0, "two thirds of the range of the authors' sensor"),
    Ceiling("limits.max_acceleration_m_per_s2", 2.5, "the limit in the Ridgeback's own controller"),
    Ceiling("limits.max_yaw_acceleration_rad_per_s2", 1.0, "the limit in the Ridgeback's own controller"),
    Ceiling("limits.max_heading_error_deg", 20.0, "the force is rotated by the heading"),
    Ceiling("limits.drift_hold_rad", 0.01, "0.01 rad at 1 m reach is 1 cm at the contact"),
    Ceiling("limits.drift_stop_rad", 0.02, "the arm's own limit at rest is 0.05 rad"),
)

MAX_SPEED_M_PER_S = 0.75
"""No rig may command a higher speed: 1.5 times the fastest allowed push speed of 0.5 m/s."""
MAX_TURN_RATE_RAD_PER_S = 0.25
"""The authors' limit on the base's turn rate."""
RANGE_SHARE = 0.9
"""A limit on force or torque above this share of the sensor's range could never be measured."""
SENSOR_RATE_HZ = (50.0, 8000.0)
"""A slower sensor would be stale between two readings; a faster one could not be read in time."""


def check(rig: RigConfig) -> None:
    """Raise ConfigError where `rig` exceeds a ceiling or contradicts itself."""
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
    problems += _of_sensor(rig)
    if problems:
        raise ConfigError("; ".join(problems), where=rig.name, do="Lower the value in the rig file")


def _of_sensor(rig: RigConfig) -> list[str]:
    """Return the problems with the facts that the sensor's kind declares, or with limits beyond its range."""
    facts = rig.ft.declared
    numbers = (*facts.range, facts.rate_hz, *facts.resolution, *facts.noise)
    if not all(math.isfinite(value) and value > 0.0 for value in numbers):
        return [f"ft.kind {rig.ft.kind!r} declares a range, rate, resolution or noise that is not above 0"]
    problems = []
    low, high = SENSOR_RATE_HZ
    if not low <= facts.rate_hz <= high:
        problems.append(f"ft.kind {rig.ft.kind!r} declares {facts.rate_hz:g} Hz; supported: {low:g} to {high:g} Hz")
    for key, value, unit, axes in (
        ("limits.max_force_N", rig.limits.max_force_N, "N", facts.range[:3]),
        ("limits.max_torque_Nm", rig.limits.max_torque_Nm, "N*m", facts.range[3:]),
    ):
        most = RANGE_SHARE * min(axes)
        if value > most:
            problems.append(
                f"{key} = {value:g} is above {most:g} {unit}, {RANGE_SHARE:g} of the range of the sensor's weakest axis"
            )
    return problems


def speed_limit_m_per_s(rig: RigConfig) -> float:
    """Return the envelope's speed in m/s: a factor above the push speed, never above the ceiling."""
    return min(rig.limits.envelope_factor * rig.control.push_speed_m_per_s, MAX_SPEED_M_PER_S)
