"""How far and how long a push can need to move, computed from the rig before it starts; pure."""

from __future__ import annotations

import msgspec

from robot_io.rig.config import RigConfig

OVERDUE_CONTACT_M = 0.5
"""An approach goes this far beyond the place where contact is expected before it is given up (F53)."""
RESUMES = 3
"""An operator may resume a push this often."""
PATH_RATIO = 1.25
"""The way of the contact point is longer than its progress: at most 1.030 times over 200 seeds of normal pushes."""
SLIP_FACTOR = 1.1
"""Wheels that slip turn further than the base moves."""
SLOW_FACTOR = 2.0
"""A push that runs in SLOW from end to end takes twice the time."""
SPARE_M = 0.05
"""What each phase may need beyond that: coming to rest, and noise of odometry."""


class TravelLimits(msgspec.Struct, frozen=True, gc=False):
    """What the base may travel in a whole run, as sent and as measured, and how long it may move: m, s."""

    distance_m: float
    moving_s: float


class PhaseBounds(msgspec.Struct, frozen=True, gc=False):
    """What each phase of a push can need, m on its way and s in motion; a resume adds `lost` to the push."""

    approach_m: float
    approach_s: float
    push_m: float
    push_s: float
    retreat_m: float
    retreat_s: float
    lost_m: float
    lost_s: float


def phase_bounds(rig: RigConfig) -> PhaseBounds:
    """Return the bounds of a rig's approach (a resume begins it anew), push (losses of contact in it) and retreat."""
    control = rig.control
    ramp_s = max(control.ramp_s, control.push_speed_m_per_s / rig.limits.max_acceleration_m_per_s2)
    lost_m = SLIP_FACTOR * max(control.lost_distance_m, control.lost_time_s * control.push_speed_m_per_s)
    lost_s = SLOW_FACTOR * (control.lost_time_s + ramp_s)
    approach_m = SLIP_FACTOR * (rig.path.expected_contact_m + OVERDUE_CONTACT_M) + SPARE_M
    push_m = SLIP_FACTOR * PATH_RATIO * control.distance_m + lost_m + SPARE_M
    retreat_m = SLIP_FACTOR * control.retreat_m + SPARE_M
    return PhaseBounds(
        approach_m,
        SLOW_FACTOR * (approach_m / control.approach_speed_m_per_s + ramp_s),
        push_m,
        SLOW_FACTOR * (push_m / control.push_speed_m_per_s + 2.0 * ramp_s) + lost_s,
        retreat_m,
        SLOW_FACTOR * (retreat_m / control.approach_speed_m_per_s + ramp_s),
        lost_m,
        lost_s,
    )


def in_words(bounds: PhaseBounds) -> str:
    """Return the bounds as one line for the start of a run."""
    return (
        f"of these at most {bounds.approach_m:.2f} m or {bounds.approach_s:.0f} s of approach, "
        f"{bounds.push_m:.2f} m or {bounds.push_s:.0f} s of push, "
        f"{bounds.retreat_m:.2f} m or {bounds.retreat_s:.0f} s of retreat (F45, F46)"
    )


def total_bounds(rig: RigConfig) -> TravelLimits:
    """Return what one run of `rig` can need from its first motion to its end, in all.

    Approach, the push itself, one loss of contact, three resumes (each an approach or a loss again) and the retreat.
    """
    control = rig.control
    approach_m = rig.path.expected_contact_m + OVERDUE_CONTACT_M
    push_m = PATH_RATIO * control.distance_m
    lost_m = max(control.lost_distance_m, control.lost_time_s * control.push_speed_m_per_s)
    distance_m = approach_m + push_m + lost_m + RESUMES * max(approach_m, lost_m) + control.retreat_m

    ramp_s = max(control.ramp_s, control.push_speed_m_per_s / rig.limits.max_acceleration_m_per_s2)
    approach_s = approach_m / control.approach_speed_m_per_s + ramp_s
    push_s = push_m / control.push_speed_m_per_s + 2.0 * ramp_s
    lost_s = control.lost_time_s + ramp_s
    retreat_s = control.retreat_m / control.approach_speed_m_per_s + ramp_s
    moving_s = approach_s + push_s + lost_s + RESUMES * max(approach_s, lost_s) + retreat_s
    return TravelLimits(SLIP_FACTOR * distance_m, SLIP_FACTOR * SLOW_FACTOR * moving_s)
