"""Checks that motion has an end and a direction, whatever a pose says: way and time of each phase (F45, F46, F59)."""

from __future__ import annotations

import math

from msgspec.structs import replace

from robot_io.tick import ControlState, Mode, MotionState, Phase, SafetyState, TickInput
from safety.finding import Finding
from safety.settings import SafetySettings
from safety.travel import Travel

APPROACH, PUSH, RETREAT = 1, 2, 3
GROUPS: dict[int, int] = {
    Phase.APPROACH: APPROACH,
    Phase.PUSH: PUSH,
    Phase.LOST: PUSH,
    Phase.REST: PUSH,
    Phase.RETREAT: RETREAT,
    Phase.CHECK: RETREAT,
    Phase.DONE: RETREAT,
}
"""LOST_HOLD and FAILED belong to what came before them; SETTLE and TARE to no motion of ours."""
FAR_M = 1000.0
"""As for points of the floor in a rig file."""
JUDGED_FROM_M, JUDGED_TO_M = 0.02, 0.05
"""The direction of motion is judged between these ways from the start of approach and push."""
STANDING_M = 0.005
"""A shorter way by pose has no direction: that it is so short is for F43."""
ASIDE_DEG = 15.0
ASIDE_TICKS = 3


def check(
    settings: SafetySettings, state: SafetyState, inp: TickInput, control: ControlState
) -> tuple[SafetyState, list[str]]:
    """Return the state and the active faults of way, time and direction.

    It is called after the checks of the base, which keep the newest good pose.
    """
    faults: list[str] = []
    furthest = max(abs(state.pose_x), abs(state.pose_y))
    if furthest > FAR_M:
        faults.append(Finding("R07", furthest))
    motion = state.motion
    group = GROUPS.get(control.phase, motion.group)
    if not group:
        return state, faults
    if group != motion.group:
        motion = _begin(motion, state, inp, group)
    motion = _allow_resumes(settings, motion, state, inp, control)
    motion = _lead(settings, _travel(motion, inp), motion, inp, control)
    way_m, moving_s = max(motion.sent_m, motion.measured_m), motion.moving_ns * 1e-9
    bounds = settings.phases
    if group == APPROACH and way_m > bounds.approach_m:
        faults.append(Finding("F45-approach", way_m))
    if group == PUSH and way_m > bounds.push_m:
        faults.append(Finding("F45-push", way_m))
    if group == RETREAT and way_m > bounds.retreat_m:
        faults.append(Finding("F45-retreat", way_m))
    if group == APPROACH and moving_s > bounds.approach_s:
        faults.append(Finding("F46-approach", moving_s))
    if group == PUSH and moving_s > bounds.push_s:
        faults.append(Finding("F46-push", moving_s))
    if group == RETREAT and moving_s > bounds.retreat_s:
        faults.append(Finding("F46-retreat", moving_s))
    aside = _aside_deg(motion, state) if group != RETREAT and state.mode < Mode.STOP else 0.0
    if aside > ASIDE_DEG or motion.aside_run:
        motion = replace(motion, aside_run=motion.aside_run + 1 if aside > ASIDE_DEG else 0)
    if motion.aside_run >= ASIDE_TICKS:
        faults.append(Finding("F59", aside))
    return replace(state, motion=motion), faults


def _begin(motion: MotionState, state: SafetyState, inp: TickInput, group: int) -> MotionState:
    """Return the motion with the counts of a new group at zero."""
    return replace(
        motion,
        group=group,
        at_ns=motion.at_ns or inp.now_ns,
        sent_m=0.0,
        measured_m=0.0,
        moving_ns=0,
        from_x=state.pose_x,
        from_y=state.pose_y,
        lead_x=0.0,
        lead_y=0.0,
        aside_run=0,
    )


def _allow_resumes(
    settings: SafetySettings, motion: MotionState, state: SafetyState, inp: TickInput, control: ControlState
) -> MotionState:
    """Give a resumed search its whole way again, and a resumed push one more loss of contact."""
    if control.resumes == motion.resumes:
        return motion
    motion = replace(motion, resumes=control.resumes)
    if motion.group == APPROACH:
        return _begin(motion, state, inp, APPROACH)
    bounds = settings.phases
    return replace(
        motion,
        sent_m=max(motion.sent_m - bounds.lost_m, 0.0),
        measured_m=max(motion.measured_m - bounds.lost_m, 0.0),
        moving_ns=max(motion.moving_ns - round(bounds.lost_s * 1e9), 0),
    )


def _travel(motion: MotionState, inp: TickInput) -> MotionState:
    """Count way and time up to this tick."""
    base = inp.base
    travel = Travel(
        True,
        motion.at_ns,
        motion.sent_m,
        motion.measured_m,
        motion.moving_ns,
        motion.vx,
        motion.vy,
        motion.measured_ns,
    )
    if base.odometry_received_ns != travel.measured_ns:
        travel = travel.on_speed(base.odometry, base.odometry_received_ns)
    travel = travel.on_time(inp.now_ns, base.sent)
    return replace(
        motion,
        at_ns=travel.at_ns,
        sent_m=travel.sent_m,
        measured_m=travel.measured_m,
        moving_ns=travel.moving_ns,
        vx=travel.vx,
        vy=travel.vy,
        measured_ns=travel.measured_ns,
    )


def _lead(
    settings: SafetySettings, motion: MotionState, before: MotionState, inp: TickInput, control: ControlState
) -> MotionState:
    """Add up the direction that control asks for, over the way that was sent."""
    way_m = motion.sent_m - before.sent_m
    if way_m <= 0.0 or before.sent_m > JUDGED_TO_M or not math.isfinite(control.theta_p):
        return motion
    angle = settings.workspace.path.heading + control.theta_p
    return replace(
        motion, lead_x=motion.lead_x + way_m * math.cos(angle), lead_y=motion.lead_y + way_m * math.sin(angle)
    )


def _aside_deg(motion: MotionState, state: SafetyState) -> float:
    """Return the angle between the way by pose and the way asked for; 0 where it is not judged."""
    x, y = state.pose_x - motion.from_x, state.pose_y - motion.from_y
    if not JUDGED_FROM_M <= motion.sent_m <= JUDGED_TO_M or math.hypot(x, y) < STANDING_M:
        return 0.0
    lead_x, lead_y = motion.lead_x, motion.lead_y
    return math.degrees(abs(math.atan2(lead_x * y - lead_y * x, lead_x * x + lead_y * y)))
