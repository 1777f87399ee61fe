"""How far and how long a push can need to move, computed from the rig before it starts; pure."""

from __future__ import annotations

import msgspec

from robot_io.rig.config import RigConfig

OVERDUE_CONTACT_M = 0.5
"""An approach goes this far beyond the place where contact is expected before it is given up (F53)."""
RESUMES = 3
"""An operator may resume a push this often."""
PATH_RATIO = 1.25
"""The way of the contact point is longer than its progress: 1.012 times over seeds and starts half a metre off."""
SLIP_FACTOR = 1.1
"""Wheels that slip turn further than the base moves."""
SLOW_FACTOR = 2.0
"""A push that runs in SLOW from end to end takes twice the time."""


class TravelLimits(msgspec.Struct, frozen=True, gc=False):
    """What the base may travel in a whole run, as sent and as measured, and how long it may move: m, s."""

    distance_m: float
    moving_s: float


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
