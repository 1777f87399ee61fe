"""Checks that pose, odometry and command tell of the same motion, over windows of way and time (F37, F43, F33-way).

Compared are ways, not speeds: what noise, age and latency of the samples can add up to is bounded, while a pose that
stands, is mirrored, scaled, turned or drifts is further off with each centimetre. The present is compared with
several moments of the past, the oldest 0.3 m or 3 s ago, whichever is longer.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from msgspec.structs import replace

from robot_io.geometry import rotated
from robot_io.tick import ControlState, Mode, MotionMark, MotionState, SafetyState, TickInput
from safety.checks.stuck_checks import STUCK_SHARE
from safety.finding import Finding
from safety.settings import SafetySettings

MARKS = 8
MARK_M, MARK_NS = 0.04, 400_000_000
"""A new moment is kept after this way and this time ..."""
MARK_AT_REST_NS = 5_000_000_000
"""... or after this time, at rest."""
AT_REST_NS = 500_000_000
"""A base that still moves this long after the command became zero is for F34 and F39."""
GAP_S = 0.25
"""A longer pause of this host does not count as motion: the base has stopped by then."""
RUN = 3
"""Consecutive samples that must disagree: one may be a flaw of motion capture."""
DIRECTION_M = 0.01
"""A shorter way has no direction."""
STILL_M, STILL_WAY_M = 0.005, 0.01
"""A pose that keeps within this of one place, over this way by odometry, stands still (F43)."""

STUCK_WAIT_M = 0.08
"""Over this commanded way at most, a pose that disagrees under a large force is left to F54."""

FLOOR_M = 0.006
"""Noise of two poses (0.5 mm each) eight times over."""
NOISE_M_PER_SQRT_S = 0.006
"""Noise of odometry: 0.01 m/s at 50 Hz adds up to 1.4 mm in a second, and with the root of the time."""
TIMING_S = 0.04
"""Age and latency of poses and odometry: their difference may change by this much."""
SLIP = 0.1
"""Wheels may lose this share of their way ..."""
AHEAD = 0.02
"""... but never gain; this much is an error of their radius."""
ACROSS = 0.05
"""A pose may be turned by 3 degrees (markers, frames), and no more."""
TURN_FLOOR_RAD = 0.035
TURN_NOISE_RAD_PER_SQRT_S = 0.012
"""Five times the noise of odometry's turn rate, added up as above."""

SURE = 0.999
"""Below this share of a floor no rounding of what follows makes a difference too large."""

COMMAND_FLOOR_M = 0.012
COMMAND_TIMING_S = 0.25
"""The base follows a command within 0.1 s; that it stands still is told sooner by F33."""
TRACKING = 0.05
"""Wheels do what they are told, to this share."""


class _Allowed(NamedTuple):
    floor_m: float
    behind: float
    ahead: float
    across: float


def check(
    settings: SafetySettings, state: SafetyState, inp: TickInput, control: ControlState
) -> tuple[SafetyState, list[str]]:
    """Return the state and the active faults of agreement; called after the checks of base and motion."""
    del control
    motion = state.motion
    if not motion.group or state.mode >= Mode.STOP:
        return state, []
    faults: list[str] = []
    motion = _add_up(motion, state, inp)
    if not motion.marks:
        return replace(state, motion=replace(motion, pose_ns=state.pose_ns, marks=(_mark(motion, state),))), []
    now = _mark(motion, state)
    if state.pose_ns != motion.pose_ns and not state.pose_jumps and not settings.pose_is_odometry:
        off = _off_by_pose(motion.marks, now, inp)
        motion = _note_place(
            replace(motion, pose_ns=state.pose_ns, pose_run=motion.pose_run + 1 if off > 1.0 else 0), now
        )
        if motion.pose_run >= RUN and not _perhaps_stuck(state, inp):
            faults.append(Finding("F43" if _way_at_one_place(motion) > STILL_WAY_M else "F37", off))
    off = _off_by_command(motion.marks, now, inp)
    motion = replace(motion, command_run=motion.command_run + 1 if off > 1.0 else 0, marks=_kept(motion.marks, now))
    if motion.command_run >= RUN:
        faults.append(Finding("F33-way", off))
    return replace(state, motion=motion), faults


def _add_up(motion: MotionState, state: SafetyState, inp: TickInput) -> MotionState:
    """Add the ways since the tick before, each turned by the measured heading."""
    time_s = min((inp.now_ns - motion.agreed_ns) * 1e-9, GAP_S) if motion.agreed_ns else 0.0
    odometry, sent = inp.base.odometry, inp.base.sent
    way = (odometry.vx * time_s, odometry.vy * time_s, odometry.omega * time_s)
    if not all(map(math.isfinite, way)):  # a fault of its own (F35)
        way = (0.0, 0.0, 0.0)
    x, y = rotated(way[0], way[1], state.pose_yaw)
    sent_x, sent_y = rotated(sent.vx * time_s, sent.vy * time_s, state.pose_yaw)
    if state.zero_since_ns and inp.now_ns - state.zero_since_ns > AT_REST_NS:
        sent_x, sent_y = x, y
    return replace(
        motion,
        agreed_ns=inp.now_ns,
        way_x=motion.way_x + x,
        way_y=motion.way_y + y,
        way_yaw=motion.way_yaw + way[2],
        sent_x=motion.sent_x + sent_x,
        sent_y=motion.sent_y + sent_y,
    )


def _mark(motion: MotionState, state: SafetyState) -> MotionMark:
    return MotionMark(
        motion.agreed_ns,
        state.pose_x,
        state.pose_y,
        state.pose_yaw,
        motion.way_x,
        motion.way_y,
        motion.way_yaw,
        motion.sent_x,
        motion.sent_y,
    )


def _kept(marks: tuple[MotionMark, ...], now: MotionMark) -> tuple[MotionMark, ...]:
    """Return the moments to compare with from now on."""
    last = marks[-1]
    time_ns = now.at_ns - last.at_ns
    way_m = max(
        math.hypot(now.way_x - last.way_x, now.way_y - last.way_y),
        math.hypot(now.sent_x - last.sent_x, now.sent_y - last.sent_y),
    )
    due = (time_ns >= MARK_NS and way_m >= MARK_M) or time_ns >= MARK_AT_REST_NS
    return (*marks, now)[-MARKS:] if due else marks


def _note_place(motion: MotionState, now: MotionMark) -> MotionState:
    """Keep the place of the pose, unless it is still the one that is kept."""
    if math.hypot(now.x - motion.still_x, now.y - motion.still_y) <= STILL_M:
        return motion
    return replace(motion, still_x=now.x, still_y=now.y, still_way_x=now.way_x, still_way_y=now.way_y)


def _way_at_one_place(motion: MotionState) -> float:
    """Return the way by odometry (m) since the pose came to the place where it still is."""
    return math.hypot(motion.way_x - motion.still_way_x, motion.way_y - motion.still_way_y)


def _perhaps_stuck(state: SafetyState, inp: TickInput) -> bool:
    """Return whether a large force may be what keeps the pose where it is, so that F54 has to name it."""
    force, pose = state.force, inp.base.pose
    if not force.stuck_since_ns or math.hypot(force.sent_x, force.sent_y) > STUCK_WAIT_M:
        return False
    way = (pose.x - force.from_x) * force.sent_x + (pose.y - force.from_y) * force.sent_y
    return way < STUCK_SHARE * (force.sent_x * force.sent_x + force.sent_y * force.sent_y)


def _off_by_pose(marks: tuple[MotionMark, ...], now: MotionMark, inp: TickInput) -> float:
    """Return the most that pose and odometry differ since any of these moments, as a share of what is allowed.

    0 where they differ so little that every direction and time allows it at this speed, as nearly always.
    """
    off, sent = 0.0, inp.base.sent
    near_m = SURE * (FLOOR_M + TIMING_S * math.hypot(sent.vx, sent.vy))
    x, y, yaw = now.x - now.way_x, now.y - now.way_y, now.yaw - now.way_yaw
    for then in marks:
        dx, dy = x - then.x + then.way_x, y - then.y + then.way_y
        if not (dx * dx + dy * dy < near_m * near_m and abs(yaw - then.yaw + then.way_yaw) < SURE * TURN_FLOOR_RAD):
            off = max(off, _of_pose(then, now, inp))
    return off


def _off_by_command(marks: tuple[MotionMark, ...], now: MotionMark, inp: TickInput) -> float:
    """Return the same of odometry and command."""
    off, sent = 0.0, inp.base.sent
    near_m = SURE * (COMMAND_FLOOR_M + COMMAND_TIMING_S * math.hypot(sent.vx, sent.vy))
    x, y = now.way_x - now.sent_x, now.way_y - now.sent_y
    for then in marks:
        dx, dy = x - then.way_x + then.sent_x, y - then.way_y + then.sent_y
        if not dx * dx + dy * dy < near_m * near_m:
            off = max(off, _of_command(then, now, inp))
    return off


def _of_pose(then: MotionMark, now: MotionMark, inp: TickInput) -> float:
    """Return how far pose and odometry differ since then, as a share of what is allowed."""
    x, y = now.way_x - then.way_x, now.way_y - then.way_y
    time_s = (now.at_ns - then.at_ns) * 1e-9
    way_m = math.hypot(x, y)
    floor_m = FLOOR_M + NOISE_M_PER_SQRT_S * math.sqrt(time_s) + TIMING_S * _speed(way_m, time_s, inp)
    off = _share(x, y, now.x - then.x - x, now.y - then.y - y, _Allowed(floor_m, SLIP, AHEAD, ACROSS))
    turned = now.way_yaw - then.way_yaw
    off_rad = abs(math.remainder(now.yaw - then.yaw - turned, math.tau))
    allowed_rad = TURN_FLOOR_RAD + TURN_NOISE_RAD_PER_SQRT_S * math.sqrt(time_s) + SLIP * abs(turned)
    return max(off, off_rad / allowed_rad)


def _of_command(then: MotionMark, now: MotionMark, inp: TickInput) -> float:
    """Return how far odometry and command differ since then, as a share of what is allowed."""
    x, y = now.sent_x - then.sent_x, now.sent_y - then.sent_y
    way_x, way_y = now.way_x - then.way_x, now.way_y - then.way_y
    time_s = (now.at_ns - then.at_ns) * 1e-9
    speed = _speed(math.hypot(x, y), time_s, inp)
    floor_m = COMMAND_FLOOR_M + NOISE_M_PER_SQRT_S * math.sqrt(time_s) + COMMAND_TIMING_S * speed
    return _share(x, y, way_x - x, way_y - y, _Allowed(floor_m, TRACKING, TRACKING, ACROSS))


def _speed(way_m: float, time_s: float, inp: TickInput) -> float:
    """Return the speed that timing is judged by: the present one, or the mean where that is more."""
    sent = math.hypot(inp.base.sent.vx, inp.base.sent.vy)
    return max(way_m / time_s, sent) if time_s > 0.0 else sent


def _share(x: float, y: float, off_x: float, off_y: float, allowed: _Allowed) -> float:
    """Return a difference (off_x, off_y) on the way (x, y) as a share of what is allowed along and across it."""
    way_m = math.hypot(x, y)
    if way_m < DIRECTION_M:
        return math.hypot(off_x, off_y) / allowed.floor_m
    along, across = (off_x * x + off_y * y) / way_m, abs(off_y * x - off_x * y) / way_m
    along_allowed = allowed.floor_m + way_m * (allowed.ahead if along > 0.0 else allowed.behind)
    return max(abs(along) / along_allowed, across / (allowed.floor_m + way_m * allowed.across))
