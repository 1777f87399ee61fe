"""Processes every sensor packet in order: sums for tare and check; median, bias, rotation, sign, filter with own dt."""

from __future__ import annotations

import math

from msgspec.structs import replace

from control import contact_threshold
from control.settings import Settings
from control.tare import add
from control.wrench import force_on_slider_world, low_pass, median_of_three
from robot_io.tick import ControlState, FtReading, Phase, TareSums

VALID_FOR_NS = 100_000_000
"""The force is valid while the newest packet is younger than this."""
MAX_DT_S = 0.1
"""A gap between packets counts as at most this long in the filter."""
SEEKING = (Phase.APPROACH, Phase.LOST, Phase.LOST_HOLD)
"""Phases in which a contact may be found."""


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
    seeks = state.phase in SEEKING
    contact = state.contact if seeks else contact_threshold.start_window(state.contact)
    before, last, packets = contact.before_last, contact.last, 0 if fresh else contact.packets
    for reading in readings:
        if packets:
            calm = median_of_three(before if packets > 1 else last, last, reading.force)
        else:
            calm = reading.force
        before, last, packets = last, reading.force, min(packets + 1, 2)
        sample = force_on_slider_world(calm, state.bias_force, settings.base_from_sensor, yaw)
        if seeks:
            contact = contact_threshold.add(contact, sample, reading.received_ns)
        dt_s = min(max((reading.received_ns - last_ns) * 1e-9, 0.0), MAX_DT_S)
        force = sample if fresh else low_pass(force, sample, dt_s, control.force_filter_tau_s)
        fresh = False
        last_ns = reading.received_ns
        # The direction of contact is unknown, so only the magnitude counts; "not >=" is also true for NaN.
        run = run + 1 if math.hypot(force[0], force[1]) >= control.force_min_N else 0
    finite = math.isfinite(force[0]) and math.isfinite(force[1]) and math.isfinite(force[2])
    valid = finite and now_ns - last_ns <= VALID_FOR_NS
    contact = replace(contact, packets=packets, before_last=before, last=last)
    return replace(
        state, force_world=force, force_valid=valid, contact_run=run, last_reading_ns=last_ns, contact=contact
    )


def in_contact(settings: Settings, state: ControlState) -> bool:
    """Return whether the filtered planar force is valid and large enough for contact to go on, or to be found again.

    A contact that was lost is found again as the first one was; see `contact_threshold`.
    """
    if not state.force_valid:
        return False
    size = math.hypot(state.force_world[0], state.force_world[1])
    least = settings.control.force_min_N
    if state.phase != Phase.LOST:
        return size >= contact_threshold.lost_below(state.contact, least)
    direction = settings.path.direction_in_world(state.theta_p)
    return size >= least or contact_threshold.found_by_mean(state.contact, direction, rising=False)


def counted(state: ControlState) -> int:
    """Return how many readings have been summed up in this phase."""
    return state.tare[0].count if state.tare else 0


def _sum_up(settings: Settings, state: ControlState, readings: tuple[FtReading, ...]) -> tuple[TareSums, ...]:
    wanted = settings.check_readings if state.phase == Phase.CHECK else settings.tare_readings
    sums = state.tare[0] if state.tare else TareSums()
    for reading in readings:
        if sums.count < wanted and reading.received_ns > state.phase_since_ns:
            sums = add(sums, (*reading.force, *reading.torque), wanted, settings.sensor_resolution)
    return (sums,) if sums.count else ()
