"""Checks that time went on for this machine as it did for the world: after a suspend every age looks fresh."""

from __future__ import annotations

from msgspec.structs import replace

from robot_io.tick import ClockState, SafetyState, TickInput
from safety.finding import NS_PER_MS, Finding

JUMP_NS = 20_000_000
"""Between two ticks; beyond it this machine was suspended, or its clock was held."""


def check(state: SafetyState, inp: TickInput) -> tuple[SafetyState, list[str]]:
    """Return the state and F61, where the two clocks of this machine have drifted apart since the last tick."""
    before, asleep_ns = state.clock, inp.host.asleep_ns
    faults: list[str] = []
    if before.known and abs(asleep_ns - before.asleep_ns) > JUMP_NS:
        faults.append(Finding("F61", (asleep_ns - before.asleep_ns) / NS_PER_MS))
    if before.known and asleep_ns == before.asleep_ns:
        return state, faults
    return replace(state, clock=ClockState(asleep_ns, True)), faults
