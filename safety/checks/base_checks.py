"""Checks that the base responds, that its pose is plausible, and that it moves as commanded."""

from __future__ import annotations

import math

from msgspec.structs import replace

from robot_io.messages import NO_BASE, Pose2D
from robot_io.tick import ControlState, Mode, SafetyState, TickInput
from safety.envelope import OVERSPEED_FACTOR, is_number, too_fast
from safety.finding import NS_PER_MS, Finding
from safety.gate import Latch
from safety.settings import SafetySettings

STALE_HOLD_NS = 100_000_000
STALE_STOP_NS = 250_000_000
POSE_SLOW_PERIODS, POSE_STOP_PERIODS = 3, 6
POSE_SLOW_FLOOR_NS, POSE_STOP_FLOOR_NS = 50_000_000, 120_000_000
STATUS_LATE_NS = 3_000_000_000
"""The base reports its stops and motors once a second."""
GATE_RECORD_STOP_NS = 100_000_000
OVERSPEED_SAMPLES = 2
IGNORE_SHARE = 0.5
"""Share of the commanded speed: half of 0.1 m/s is the 0.05 m/s of the fault table ..."""
IGNORE_LEAST_M_PER_S = 0.02
"""... and at least the error that odometry may have at rest."""
IGNORE_NS = 300_000_000
MOVING_M_PER_S = 0.03
MOVING_NS = 100_000_000
STOPPING_NS = 200_000_000
BASE_DECELERATION = 2.5
"""m/s^2, the limit in the Ridgeback's own controller."""
JUMP_M, JUMP_RAD = 0.03, 0.05
JUMPS = 3


def check(
    settings: SafetySettings, state: SafetyState, inp: TickInput, control: ControlState
) -> tuple[SafetyState, list[str]]:
    """Return the state and the active faults of base, localisation and gate."""
    faults = _of_link(inp)
    state, pose_faults = _of_pose(settings, state, inp, control)
    state, motion_faults = _of_motion(settings, state, inp)
    return state, faults + pose_faults + motion_faults


def trusted_pose(settings: SafetySettings, state: SafetyState, inp: TickInput) -> Pose2D:
    """Return the pose for control: the newest, or the last valid one while that is invalid (F42) or a jump (F41).

    Before the first valid pose it is the newest, even if that is invalid; no pose where that is not finite.
    """
    if not state.pose_seq:
        return inp.base.pose if _finite(inp.base.pose) else NO_BASE.pose
    if _usable(inp) and not _jumps(settings, state, inp):
        return inp.base.pose
    return Pose2D(state.pose_x, state.pose_y, state.pose_yaw)


def _usable(inp: TickInput) -> bool:
    return inp.base.pose_valid and _finite(inp.base.pose)


def _finite(pose: Pose2D) -> bool:
    return math.isfinite(pose.x) and math.isfinite(pose.y) and math.isfinite(pose.yaw)


def _jumps(settings: SafetySettings, state: SafetyState, inp: TickInput) -> int:
    """Return how many consecutive poses, including this one, are further away than the base can have moved."""
    base, pose = inp.base, inp.base.pose
    if base.pose_seq == state.pose_seq:
        return state.pose_jumps
    if not state.pose_seq:  # nothing to compare with yet
        return 0
    time_s = (base.pose_received_ns - state.pose_ns) * 1e-9
    moved = math.hypot(pose.x - state.pose_x, pose.y - state.pose_y)
    turned = abs(math.remainder(pose.yaw - state.pose_yaw, math.tau))
    speed, turn = settings.envelope.speed * OVERSPEED_FACTOR, settings.envelope.turn_rate * OVERSPEED_FACTOR
    far = moved > JUMP_M + speed * time_s or turned > JUMP_RAD + turn * time_s
    return state.pose_jumps + 1 if far else 0


def _of_link(inp: TickInput) -> list[str]:
    base = inp.base
    faults: list[str] = []
    if base.latched and base.latch_cause == Latch.LINK:
        faults.append("F30")
    elif base.latched and base.latch_cause == Latch.TRAVEL:
        faults.append(Finding("F47", base.travel_m))
    elif base.latched and base.latch_cause == Latch.MOVING_TIME:
        faults.append(Finding("F48", base.moving_s))
    elif base.latched or not inp.host.gate_alive:
        faults.append("F67")
    if inp.now_ns - base.published_ns > GATE_RECORD_STOP_NS:
        faults.append(Finding("F67-late", (inp.now_ns - base.published_ns) / NS_PER_MS))
    # Odometry itself, not just any message: all motion checks below depend on it.
    silent_ns = inp.now_ns - base.odometry_received_ns
    if silent_ns > STALE_STOP_NS:
        faults.append(Finding("F31-stop", silent_ns / NS_PER_MS))
    elif silent_ns > STALE_HOLD_NS:
        faults.append(Finding("F31-hold", silent_ns / NS_PER_MS))
    status_ns = inp.now_ns - base.status_received_ns if base.status_received_ns else 0
    if status_ns > STATUS_LATE_NS:
        faults.append(Finding("F38-late", status_ns / NS_PER_MS))
    if base.status_received_ns and (base.status.stop_engaged or not base.status.drivers_active):
        faults.append("F38")
    return faults


def _of_pose(
    settings: SafetySettings, state: SafetyState, inp: TickInput, control: ControlState
) -> tuple[SafetyState, list[str]]:
    base, pose = inp.base, inp.base.pose
    faults: list[str] = []
    age_ns = inp.now_ns - base.pose_received_ns
    if age_ns > max(POSE_STOP_PERIODS * settings.pose_period_ns, POSE_STOP_FLOOR_NS):
        faults.append(Finding("F40-stop", age_ns / NS_PER_MS))
    elif age_ns > max(POSE_SLOW_PERIODS * settings.pose_period_ns, POSE_SLOW_FLOOR_NS):
        faults.append(Finding("F40-slow", age_ns / NS_PER_MS))
    if not _usable(inp):
        return state, [*faults, "F42"]
    if base.pose_seq != state.pose_seq:
        jumps = _jumps(settings, state, inp)
        # A jump keeps the old reference, so that a pose that stays away is counted each time.
        if jumps:
            state = replace(state, pose_seq=base.pose_seq, pose_jumps=jumps)
        else:
            state = replace(
                state,
                pose_seq=base.pose_seq,
                pose_jumps=0,
                pose_x=pose.x,
                pose_y=pose.y,
                pose_yaw=pose.yaw,
                pose_ns=base.pose_received_ns,
            )
    if state.pose_jumps >= JUMPS:
        faults.append("F41")
    turned = abs(math.remainder(pose.yaw - control.held_yaw, math.tau))
    if turned > settings.max_heading_error:
        faults.append(Finding("F44", turned))
    return state, faults


def _of_motion(settings: SafetySettings, state: SafetyState, inp: TickInput) -> tuple[SafetyState, list[str]]:
    base, twist = inp.base, inp.base.odometry
    faults: list[str] = []
    speed = math.hypot(twist.vx, twist.vy)
    run, seq = state.overspeed_run, state.overspeed_seq
    if base.odometry_seq != seq:
        run, seq = (run + 1 if too_fast(settings.envelope, twist) else 0), base.odometry_seq
    if run >= OVERSPEED_SAMPLES and is_number(twist):
        faults.append(Finding("F35", speed))
    elif run >= OVERSPEED_SAMPLES:
        faults.append("F49")
    sent = base.sent
    off = math.hypot(twist.vx - sent.vx, twist.vy - sent.vy)
    ignored = max(IGNORE_SHARE * math.hypot(sent.vx, sent.vy), IGNORE_LEAST_M_PER_S)
    ignoring = off > ignored and state.mode >= Mode.PUSHING and state.mode < Mode.STOP
    ignore_since = (state.ignore_since_ns or inp.now_ns) if ignoring else 0
    if ignore_since and inp.now_ns - ignore_since >= IGNORE_NS:
        faults.append(Finding("F33", off))
    zero_ns = inp.now_ns - state.zero_since_ns if state.zero_since_ns else 0
    settled = zero_ns >= STOPPING_NS + settings.push_speed / BASE_DECELERATION * 1e9
    fresh = inp.now_ns - base.odometry_received_ns <= STALE_HOLD_NS  # an old speed says nothing about the present
    moving = settled and fresh and speed > MOVING_M_PER_S and state.mode >= Mode.STOP
    moving_since = (state.moving_since_ns or inp.now_ns) if moving else 0
    if moving_since and inp.now_ns - moving_since >= MOVING_NS:
        faults.append(Finding("F34", speed))
    return replace(
        state,
        overspeed_run=run,
        overspeed_seq=seq,
        ignore_since_ns=ignore_since,
        moving_since_ns=moving_since,
    ), faults
