"""Checks that this machine keeps up, that the other processes are alive, and what the operator requested."""

from __future__ import annotations

from msgspec.structs import replace

from robot_io.tick import Operator, SafetyState, TickInput
from safety.finding import NS_PER_MS, Finding
from safety.settings import SafetySettings

LATE_SLOW_TICKS = 3
LATE_SLOW_NS = 30_000_000
RECORDER_GONE_NS = 1_000_000_000
LAUNCHER_HOLD_NS, LAUNCHER_STOP_NS = 500_000_000, 2_000_000_000


def check(settings: SafetySettings, state: SafetyState, inp: TickInput) -> tuple[SafetyState, list[str]]:
    """Return the state and the active faults of the host."""
    host = inp.host
    faults: list[str] = []
    run = state.late_run + 1 if host.skipped else 0
    if host.skipped:
        faults.append("F60-late")
    if run >= LATE_SLOW_TICKS or host.skipped * settings.period_ns >= LATE_SLOW_NS:
        faults.append(Finding("F60-slow", host.skipped * settings.period_ns / NS_PER_MS))
    gone_ns = 0 if host.recorder_alive else state.recorder_gone_ns or inp.now_ns
    unrecorded_ns = max(inp.now_ns - gone_ns if gone_ns else 0, host.recorder_silent_ns)
    if unrecorded_ns >= RECORDER_GONE_NS or host.log_dropped:
        faults.append(Finding("F63", unrecorded_ns / NS_PER_MS))
    if inp.operator == Operator.STOP:
        faults.append("F64")
    if host.launcher_silent_ns >= LAUNCHER_STOP_NS:
        faults.append(Finding("F73-stop", host.launcher_silent_ns / NS_PER_MS))
    elif host.launcher_silent_ns >= LAUNCHER_HOLD_NS:
        faults.append(Finding("F73-hold", host.launcher_silent_ns / NS_PER_MS))
    if host.law_ns > settings.law_ns:
        faults.append(Finding("F57-slow", host.law_ns / NS_PER_MS))
    return replace(state, late_run=run, recorder_gone_ns=gone_ns), faults
