"""Checks that a large force moves the object: stuck (F54-stop), or too heavy for too long (F54-hold)."""

from __future__ import annotations

import math

from msgspec.structs import replace

from robot_io.tick import ControlState, ForceState, Mode, Phase, SafetyState, TickInput
from safety.finding import Finding
from safety.settings import SafetySettings

LARGE_N = 50.0
STUCK_M = 0.02
STUCK_NS = 400_000_000
"""A window at least this long and this far as commanded: the base answers a command only after up to 0.2 s."""
STUCK_SHARE = 0.25
TIMES_MEDIAN = 3.0
HIGH_NS = 10_000_000_000
BINS = 35
"""Of 1 N. Three times a larger median is above every allowed `slow_force_N`."""
SAMPLE_TICKS = 10
SURE_SAMPLES = 30
"""From here on a force that is too high no longer makes itself the usual one."""


def check(
    settings: SafetySettings, state: SafetyState, inp: TickInput, control: ControlState
) -> tuple[SafetyState, list[str]]:
    """Return the state and the active faults: of a push only, and only while nothing holds the base."""
    faults: list[str] = []
    force = state.force
    if control.phase != Phase.PUSH or not control.force_valid or state.mode >= Mode.HOLD:
        force = _unwatched(force)
    else:
        size = math.hypot(*control.force_world)
        dt_ns = settings.period_ns * (1 + inp.host.skipped)
        force, share = _watch(force, inp, size, dt_ns)
        if share < STUCK_SHARE:
            faults.append(Finding("F54-stop", share))
        force = _note_size(settings, force, inp.tick, size, dt_ns)
    if force.high_ns >= HIGH_NS:
        faults.append(Finding("F54-hold", force.high_ns * 1e-9))
    return state if force is state.force else replace(state, force=force), faults


def _unwatched(state: ForceState) -> ForceState:
    return replace(state, stuck_since_ns=0) if state.stuck_since_ns else state


def _watch(state: ForceState, inp: TickInput, size: float, dt_ns: int) -> tuple[ForceState, float]:
    """Return the state, and which share of the commanded way a large force let the base go; 1 while it is not known."""
    pose, sent = inp.base.pose, inp.base.sent
    if not size > LARGE_N or not inp.base.pose_valid:
        return _unwatched(state), 1.0
    if not state.stuck_since_ns:
        return replace(state, stuck_since_ns=inp.now_ns, sent_x=0.0, sent_y=0.0, from_x=pose.x, from_y=pose.y), 1.0
    cos, sin = math.cos(pose.yaw), math.sin(pose.yaw)
    x = state.sent_x + (cos * sent.vx - sin * sent.vy) * dt_ns * 1e-9
    y = state.sent_y + (sin * sent.vx + cos * sent.vy) * dt_ns * 1e-9
    state = replace(state, sent_x=x, sent_y=y)
    if math.hypot(x, y) < STUCK_M or inp.now_ns - state.stuck_since_ns < STUCK_NS:
        return state, 1.0
    share = ((pose.x - state.from_x) * x + (pose.y - state.from_y) * y) / (x * x + y * y)
    return (state if share < STUCK_SHARE else _unwatched(state)), share


def _note_size(settings: SafetySettings, state: ForceState, tick: int, size: float, dt_ns: int) -> ForceState:
    """Return the state after one more tick with this force: too high, or one that makes the run's median."""
    count = sum(state.histogram)
    high = size > settings.slow_force or (size > LARGE_N and count and size > TIMES_MEDIAN * _median(state.histogram))
    if high:
        state = replace(state, high_ns=state.high_ns + dt_ns)
    if tick % SAMPLE_TICKS or (high and count >= SURE_SAMPLES):
        return state
    at = min(int(size), BINS - 1)
    old = state.histogram or (0,) * BINS
    return replace(state, histogram=(*old[:at], old[at] + 1, *old[at + 1 :]))


def _median(histogram: tuple[int, ...]) -> float:
    """Return the upper edge of the newton in which the median lies: of two that both fit, the larger."""
    below, half = 0, sum(histogram) / 2
    for newton, count in enumerate(histogram):
        below += count
        if below > half:
            return newton + 1.0
    return math.inf
