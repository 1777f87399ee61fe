"""Processes every sensor packet in order: sums for tare and check; bias, rotation, sign, and filter with its own dt."""

from __future__ import annotations

import math

from msgspec.structs import replace

from control.settings import Settings
from control.tare import add
from control.wrench import force_on_slider_world, low_pass
from robot_io.tick import ControlState, FtReading, Phase, TareSums

VALID_FOR_NS = 100_000_000
"""The force is valid while the newest packet is younger than this."""
MAX_DT_S = 0.1
"""A gap between packets counts as at most this long in the filter."""


def sense(
    settings: Settings, state: ControlState, readings: tuple[FtReading, ...], yaw: float, now_ns: int
) -> ControlState:
    """Return the state after all readings of this tick (oldest first); `yaw` is the measured heading, rad."""
    if not readings:
        valid = state.force_valid and now_ns - state.last_reading_ns <= VALID_FOR_NS
        return state if valid == state.force_valid else replace(state, force_valid=valid)
    if state.phase in (Phase.TARE, Phase.CHECK):
        state = replace(state, tare=_sum_up(settings, state, readings))
    if not state.tared:
        return replace(state, last_reading_ns=readings[-1].received_ns)
    control = settings.control
    force, last_ns, run = state.force_world, state.last_reading_ns, state.contact_run
    fresh = not state.force_valid
    for reading in readings:
        sample = force_on_slider_world(reading.force, state.bias_force, settings.base_from_sensor, yaw)
        dt_s = min(max((reading.received_ns - last_ns) * 1e-9, 0.0), MAX_DT_S)
        force = sample if fresh else low_pass(force, sample, dt_s, control.force_filter_tau_s)
        fresh = False
        last_ns = reading.received_ns
        # The direction of contact is unknown, so only the magnitude counts; "not >=" is also true for NaN.
        run = run + 1 if math.hypot(force[0], force[1]) >= control.force_min_N else 0
    finite = math.isfinite(force[0]) and math.isfinite(force[1]) and math.isfinite(force[2])
    valid = finite and now_ns - last_ns <= VALID_FOR_NS
    return replace(state, force_world=force, force_valid=valid, contact_run=run, last_reading_ns=last_ns)


def in_contact(settings: Settings, state: ControlState) -> bool:
    """Return whether the filtered planar force is valid and at least the contact threshold."""
    force = state.force_world
    return state.force_valid and math.hypot(force[0], force[1]) >= settings.control.force_min_N


def _sum_up(settings: Settings, state: ControlState, readings: tuple[FtReading, ...]) -> TareSums:
    wanted = settings.tare_readings
    sums = state.tare
    for reading in readings:
        if sums.count < wanted and reading.received_ns > state.phase_since_ns:
            sums = add(sums, (*reading.force, *reading.torque), wanted)
    return sums
