"""The gate's judgement, pure: which command may reach the base, and when zero is sent instead.

The gate is the last line of defence. It forwards a command only when it is fresh, finite, in sequence and inside the
envelope; on silence, EOF or nonsense it sends zero and latches, and only a restart unlatches it. It
knows nothing of forces or paths, so that no error in control can affect its decisions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import msgspec

from robot_io.ipc.gate_frame import GateFrame
from robot_io.messages import BodyTwist
from robot_io.named_values import Latch as Latch
from safety.envelope import EnvelopeLimits, contact_speed, is_number, reduces, too_fast
from safety.motion_bounds import TravelLimits
from safety.travel import Travel

ZERO = BodyTwist()

FRAME_MAX_AGE_NS = 50_000_000
"""Five ticks of silence from control latch the gate, before a frame as well as after it (both may have been frozen
together), and so does a frame that is older than this when it is read."""
OWN_PAUSE_NS = 100_000_000
"""A gate process that was paused for longer than this latches when it resumes; control has stopped by then."""
STEP_MARGIN = 1.2
"""A step of the command may exceed the acceleration limit by this much (rounding, lateness)."""
REPEAT_NS = 18_000_000
"""Unchanged or growing commands are sent every 20 ms (less the jitter of a tick); reduced and zero ones at once."""
FRESH_NS, REPEAT_AT_MOST_NS = 2_000_000, 30_000_000
"""They leave with a frame that has just come, so that they are not old already: the next one is awaited, and 2 ms more,
if it is to come within 30 ms of the last command."""
CONTACT_MARGIN = 1.001
"""The contact ball may exceed the envelope by this much (rounding in the envelope's scaling)."""
OVERSPEED_SAMPLES = 3


LATCH_TEXT = {
    Latch.NONE: "not latched",
    Latch.SILENCE: "control was silent for 50 ms",
    Latch.EOF: "control has ended",
    Latch.NONSENSE: "control sent something that is not a frame",
    Latch.SEQUENCE: "a frame of control is missing or duplicated",
    Latch.STALE: "control's frame was older than 50 ms",
    Latch.NOT_FINITE: "control sent a velocity that is not a number",
    Latch.ENVELOPE: "control sent a velocity beyond the envelope",
    Latch.STEP: "control's velocity jumped",
    Latch.FROZEN_TICK: "control's tick counter has stopped",
    Latch.OVERSPEED: "the base is faster than the envelope",
    Latch.ODOMETRY: "the base's odometry is not a number",
    Latch.LINK: "the base link is gone",
    Latch.EOF_MOVING: "control died while the base was moving",
    Latch.PAUSED: "the gate itself was frozen for more than 100 ms",
    Latch.CONTACT_SPEED: "control sent a velocity at which the contact ball is beyond the envelope",
    Latch.SUSPENDED: "this machine was suspended, or its clock stood still",
    Latch.TRAVEL: "the base has travelled further than this push can need",
    Latch.MOVING_TIME: "the base has moved for longer than this push can need",
}

LATCH_FAULT = {
    Latch.EOF_MOVING: "F65",
    Latch.SILENCE: "F66",
    Latch.STALE: "F66",
    Latch.OVERSPEED: "F35",
    Latch.ODOMETRY: "F49",
    Latch.LINK: "F30",
    Latch.PAUSED: "F67",
    Latch.TRAVEL: "F47",
    Latch.SUSPENDED: "F61",
    Latch.MOVING_TIME: "F48",
}
"""The row of the fault table for each latch; any other latch is F36, a command that was refused."""


class GateState(msgspec.Struct, frozen=True, gc=False):
    """The gate's state: the last frame, the last command sent and when, and why it latched."""

    latch: Latch = Latch.NONE
    seq: int = 0
    tick: int = -1
    frame_ns: int = 0
    """When the last good frame arrived; 0 before the first."""
    twist: BodyTwist = ZERO
    """The last accepted command."""
    sent: BodyTwist = ZERO
    sent_ns: int = 0
    overspeed: int = 0
    said_ns: int = 0
    """When control sent the last good frame; 0 before the first."""


def on_frame(limits: EnvelopeLimits, state: GateState, frame: GateFrame | None, now_ns: int) -> GateState:
    """Judge one frame (None: unreadable) read at `now_ns`; a bad one latches."""
    if state.latch:
        return state
    if frame is None:
        return latched(state, Latch.NONSENSE)
    latch = _judge(limits, state, frame, now_ns)
    if latch:
        return latched(state, latch)
    return msgspec.structs.replace(
        state, seq=frame.seq, tick=frame.tick, frame_ns=now_ns, twist=frame.twist, said_ns=frame.sent_ns
    )


def on_frames(limits: EnvelopeLimits, state: GateState, frames: Sequence[GateFrame | None], now_ns: int) -> GateState:
    """Judge all frames that were waiting, oldest first; only the newest must be fresh.

    While the gate itself was delayed, control's older frames waited: their age does not count against them.
    """
    for frame in frames[:-1]:
        state = on_frame(limits, state, frame, now_ns if frame is None else min(frame.sent_ns, now_ns))
    return on_frame(limits, state, frames[-1], now_ns) if frames else state


def on_own_pause(state: GateState, pause_ns: int) -> GateState:
    """Latch when the gate itself was paused for too long: it cannot know what happened meanwhile."""
    return latched(state, Latch.PAUSED) if pause_ns > OWN_PAUSE_NS else state


def on_clock(state: GateState, now_ns: int) -> GateState:
    """Latch when control has been silent too long (never before its first frame)."""
    if state.frame_ns and now_ns - state.frame_ns > FRAME_MAX_AGE_NS:
        return latched(state, Latch.SILENCE)
    return state


def on_speed(limits: EnvelopeLimits, state: GateState, twist: BodyTwist) -> GateState:
    """Count measured speeds (odometry, BODY frame) beyond the envelope or no numbers; three in a row latch."""
    count = state.overspeed + 1 if too_fast(limits, twist) else 0
    state = msgspec.structs.replace(state, overspeed=count)
    if count < OVERSPEED_SAMPLES:
        return state
    return latched(state, Latch.OVERSPEED if is_number(twist) else Latch.ODOMETRY)


def on_travel(limits: TravelLimits, state: GateState, travel: Travel) -> GateState:
    """Latch when the base has travelled further, or moved for longer, than the whole run can need."""
    if travel.distance_m > limits.distance_m:
        return latched(state, Latch.TRAVEL)
    return latched(state, Latch.MOVING_TIME) if travel.moving_ns > limits.moving_s * 1e9 else state


def on_eof(state: GateState) -> GateState:
    """Latch because control closed its end of the socket: the normal end, or a crash in the middle of a push."""
    return latched(state, Latch.EOF if state.twist == ZERO else Latch.EOF_MOVING)


def latched(state: GateState, cause: Latch) -> GateState:
    """Return the state latched for `cause`; the first cause is kept."""
    return msgspec.structs.replace(state, latch=state.latch or cause, twist=ZERO)


def due(limits: EnvelopeLimits, state: GateState, now_ns: int) -> BodyTwist | None:
    """Return the command to send now, or None when nothing is due yet."""
    if state.frame_ns == 0 and not state.latch:
        return None
    wanted = state.twist
    if wanted != state.sent and reduces(wanted, state.sent):
        return wanted
    return wanted if now_ns - state.sent_ns >= REPEAT_NS and not _awaits(limits, state, now_ns) else None


def _awaits(limits: EnvelopeLimits, state: GateState, now_ns: int) -> bool:
    """Return whether a newer command is about to come."""
    next_ns = state.frame_ns + limits.period_ns
    old = now_ns - state.frame_ns >= FRESH_NS and not state.latch
    return old and now_ns < next_ns + FRESH_NS and next_ns <= state.sent_ns + REPEAT_AT_MOST_NS


def sent(state: GateState, twist: BodyTwist, now_ns: int) -> GateState:
    """Record the command that was actually sent."""
    return msgspec.structs.replace(state, sent=twist, sent_ns=now_ns)


def _judge(limits: EnvelopeLimits, state: GateState, frame: GateFrame, now_ns: int) -> Latch:
    if frame.seq != state.seq + 1:
        return Latch.SEQUENCE
    if frame.tick <= state.tick:
        return Latch.FROZEN_TICK
    if now_ns - frame.sent_ns > FRAME_MAX_AGE_NS:
        return Latch.STALE
    if state.said_ns and frame.sent_ns - state.said_ns > FRAME_MAX_AGE_NS:
        return Latch.SILENCE
    twist = frame.twist
    if not is_number(twist):
        return Latch.NOT_FINITE
    if math.hypot(twist.vx, twist.vy) > limits.speed * (1.0 + 1e-9) or abs(twist.omega) > limits.turn_rate * (
        1.0 + 1e-9
    ):
        return Latch.ENVELOPE
    if not reduces(twist, state.twist):
        if contact_speed(limits, twist) > CONTACT_MARGIN * limits.speed:
            return Latch.CONTACT_SPEED
        ticks = frame.tick - state.tick if state.tick >= 0 else 1
        # More ticks than fit into the longest allowed silence do not justify a larger jump.
        time_s = min(ticks * limits.period_ns, FRAME_MAX_AGE_NS + limits.period_ns) * 1e-9
        step = math.hypot(twist.vx - state.twist.vx, twist.vy - state.twist.vy)
        turn_step = abs(twist.omega - state.twist.omega)
        if (
            step > STEP_MARGIN * limits.acceleration * time_s
            or turn_step > STEP_MARGIN * limits.turn_acceleration * time_s
        ):
            return Latch.STEP
    return Latch.NONE
