"""Derives the mode from the active faults, and the end of the run from the mode. Pure; the strongest reaction wins.

Escalation is immediate. De-escalation is one mode a tick, after one clean second, and only where the fault's
row says that it clears by itself. STOP and DEAD are latched: they end the run. A pause by the operator asks for HOLD
like a fault, but it is none, and every check goes on.
"""

from __future__ import annotations

import math

import msgspec
from msgspec.structs import replace

from robot_io.messages import BodyTwist
from robot_io.tick import REST_M_PER_S, REST_NS, ControlState, Mode, Phase, SafetyState, TickInput
from safety.checks import (
    agreement_checks,
    arm_checks,
    base_checks,
    clock_checks,
    force_checks,
    host_checks,
    link_checks,
    motion_checks,
    sensor_checks,
    stuck_checks,
    task_checks,
    workspace_checks,
)
from safety.faults import FAULTS, Clears, strongest
from safety.finding import value_of
from safety.settings import SafetySettings

CLEAN_NS = 1_000_000_000
REST_AT_MOST_NS = 1_500_000_000
"""After a stop the run ends when the base is at rest, or after this time at the latest: the measurement itself may have
failed."""
HELD_NS = 2_000_000_000
"""A HOLD that cannot clear by itself ends the run after this long at zero."""
_CHECKS = (
    *(force_checks, sensor_checks, stuck_checks, arm_checks),
    *(base_checks, link_checks, motion_checks, agreement_checks, workspace_checks),
)
"""The force first: it compares with the last reading, on which the sensor's check moves on."""
STALENESS = ("F01", "F24", "F25", "F31", "F40", "F67-late")
"""Faults of stale data: right after a pause of this host they say more about the host than about the device."""


class Verdict(msgspec.Struct, frozen=True, gc=False):
    """The supervisor's decision on one tick."""

    mode: Mode
    faults: tuple[str, ...]
    values: tuple[float, ...]
    """What was measured for each of `faults`, in the unit of its row; NaN where nothing is measured just now."""
    finished: bool
    exit_code: int


def supervise(
    settings: SafetySettings,
    state: SafetyState,
    inp: TickInput,
    control: ControlState,
    wanted: BodyTwist,
    clamped: bool,
) -> tuple[SafetyState, Verdict]:
    """Return the state and the verdict after all checks of this tick.

    control: control's state after this tick. wanted: what it wants, BODY frame. clamped: whether the envelope
    had to clamp in the previous tick.
    """
    state, faults = _gather(settings, state, inp, control, wanted, clamped)
    latched = state.latched
    if faults:
        faults = _after_pause(state, inp, faults)
        latched += tuple(str(i) for i in faults if FAULTS[i].clears == Clears.LATCHED and i not in latched)
    asked = max(strongest(tuple(faults)), strongest(latched), Mode.HOLD if inp.paused else Mode.SILENT)
    grace_ticks = 1 if _pause(state, inp) else 0
    if grace_ticks != state.grace_ticks or latched is not state.latched:
        state = replace(state, latched=latched, grace_ticks=grace_ticks)
    mode, state = _next_mode(state, asked, control, inp.now_ns)
    stopping = mode >= Mode.STOP
    stop_since = (state.stop_since_ns or inp.now_ns) if stopping else 0
    if mode != state.mode or stop_since != state.stop_since_ns:
        state = replace(state, mode=int(mode), stop_since_ns=stop_since)
    state = _note_first(state, faults, inp.now_ns)
    finished, code = _ending(state, inp, control)
    values = {**dict.fromkeys(latched, math.nan), **{str(i): value_of(i) for i in faults}}
    return state, Verdict(mode, tuple(values), tuple(values.values()), finished, code)


def give_up(state: SafetyState, inp: TickInput) -> tuple[SafetyState, Verdict]:
    """Return the verdict on a tick whose checks failed with an exception (F68): the run ends at once."""
    latched = tuple(dict.fromkeys([*state.latched, "F68"]))
    mode = max(Mode(state.mode), FAULTS["F68"].mode)
    state = replace(state, mode=int(mode), latched=latched, stop_since_ns=state.stop_since_ns or inp.now_ns)
    state = _note_first(state, ["F68"], inp.now_ns)
    return state, Verdict(mode, latched, (math.nan,) * len(latched), True, FAULTS["F68"].exit_code)


def _note_first(state: SafetyState, faults: list[str], now_ns: int) -> SafetyState:
    """Keep the first cause of a HOLD or stronger: what follows it is a consequence, unless the run goes on without it.

    Of several in one tick the strongest counts, and a stronger row of the same family replaces a weaker one.
    """
    if Mode.PUSHING <= state.mode < Mode.HOLD:
        return replace(state, first_fault="", first_value=math.nan, first_fault_ns=0) if state.first_fault else state
    first = state.first_fault
    family = f"{first.split('-')[0]}-"
    better = [i for i in faults if FAULTS[i].mode >= Mode.HOLD and (not first or f"{i}-".startswith(family))]
    best = max(better, key=lambda i: FAULTS[i].mode, default="")
    if not best or (first and FAULTS[best].mode <= FAULTS[first].mode):
        return state
    return replace(state, first_fault=str(best), first_value=value_of(best), first_fault_ns=now_ns)


def note_command(state: SafetyState, command: BodyTwist, now_ns: int) -> SafetyState:
    """Record since when the command has been zero."""
    zero = command == BodyTwist()
    since = (state.zero_since_ns or now_ns) if zero else 0
    return state if since == state.zero_since_ns else replace(state, zero_since_ns=since)


def _gather(
    settings: SafetySettings,
    state: SafetyState,
    inp: TickInput,
    control: ControlState,
    wanted: BodyTwist,
    clamped: bool,
) -> tuple[SafetyState, list[str]]:
    state, faults = host_checks.check(settings, state, inp)
    state, found = clock_checks.check(state, inp)
    faults += found
    if state.first_ns == 0:
        state = replace(state, first_ns=inp.now_ns)
    faults += task_checks.check(inp, control, wanted, state.first_ns)
    if clamped:
        faults.append("F36")
    if control.phase == Phase.SETTLE:  # nothing moves yet, and a device that has sent no data is not a fault
        return force_checks.note(sensor_checks.note(state, inp), inp), faults
    for module in _CHECKS:
        state, found = module.check(settings, state, inp, control)
        faults += found
    return state, faults


def _pause(state: SafetyState, inp: TickInput) -> bool:
    """Return whether ticks were skipped just now; a loop that keeps skipping ticks does not count as a pause."""
    return inp.host.skipped > 0 and state.late_run == 1


def _after_pause(state: SafetyState, inp: TickInput, faults: list[str]) -> list[str]:
    """Return the faults that count: after a pause no stale data in this tick, and at most HOLD in the next."""
    if _pause(state, inp):
        return [i for i in faults if not i.startswith(STALENESS)]
    if state.grace_ticks:
        return [softer for i in faults if (softer := _at_most_hold(i) if i.startswith(STALENESS) else i)]
    return faults


def _at_most_hold(fault: str) -> str:
    """Return the row itself, the softer row of the same device, or "" where there is none."""
    if FAULTS[fault].mode <= Mode.HOLD:
        return fault
    device = fault.split("-")[0]
    return next((row for row in (f"{device}-hold", f"{device}-slow") if row in FAULTS), "")


def _next_mode(state: SafetyState, asked: Mode, control: ControlState, now_ns: int) -> tuple[Mode, SafetyState]:
    base = _working_mode(control)
    current = Mode(state.mode)
    if asked >= Mode.STOP or current >= Mode.STOP:
        return max(asked, current), state
    if asked > Mode.PUSHING and base == Mode.PUSHING:
        return max(asked, current if current > Mode.PUSHING else asked), replace(state, clean_since_ns=0)
    if current > Mode.PUSHING and base == Mode.PUSHING:
        since = state.clean_since_ns or now_ns
        if now_ns - since < CLEAN_NS:
            return current, replace(state, clean_since_ns=since)
        return Mode(current - 1), replace(state, clean_since_ns=since)
    return base, replace(state, clean_since_ns=0) if state.clean_since_ns else state


def _working_mode(control: ControlState) -> Mode:
    if control.phase == Phase.SETTLE:
        return Mode.SILENT
    if control.phase in (Phase.TARE, Phase.DONE, Phase.FAILED):
        return Mode.READY
    return Mode.PUSHING


def _ending(state: SafetyState, inp: TickInput, control: ControlState) -> tuple[bool, int]:
    """Return whether the run is over, and its exit code."""
    if state.mode >= Mode.STOP:
        # The strongest cause (first of equals) sets the exit code: a stop key is no clean end if the base kept moving.
        code = FAULTS[max(state.latched, key=lambda i: FAULTS[i].mode)].exit_code
        zero_ns = inp.now_ns - state.stop_since_ns
        twist = inp.base.odometry
        # An unknown (NaN) speed compares false, so it does not count as rest.
        rest = abs(twist.vx) < REST_M_PER_S and abs(twist.vy) < REST_M_PER_S
        return (rest and zero_ns >= REST_NS) or zero_ns >= REST_AT_MOST_NS, code
    held = [i for i in state.latched if FAULTS[i].mode == Mode.HOLD]
    if held and state.mode == Mode.HOLD and state.zero_since_ns and inp.now_ns - state.zero_since_ns >= HELD_NS:
        return True, FAULTS[held[0]].exit_code
    if control.phase == Phase.DONE:
        return True, 0
    if control.phase == Phase.FAILED:
        return True, 6
    return False, 0
