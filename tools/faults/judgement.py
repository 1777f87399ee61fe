"""Whether a row did what the table promises in a run: named in time, reacted to, and with its exit code."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from robot_io.tick import Mode
from safety.faults import FAULTS, Clears, Fault
from tools.faults.lockstep_round import NOT_ENDED, LockstepRound, Seen
from tools.faults.scenario import Scenario

LEAST_REDUCTION_M_PER_S = 1e-6
WIRE_TICKS = 2
"""What the way to the base may add to a bound."""


class Proof(NamedTuple):
    """A proved row: `measured_ticks` is None where no command is to be reduced; `why` says why it did not pass."""

    id: str
    what: str
    level: str
    measured_ticks: int | None
    bound_ticks: int
    passed: bool
    why: str = ""
    repeats: int = 0
    """Rounds on the wire that said nothing, because the host stalled."""


def level_of(*, wire: bool) -> str:
    """Return the level of a round."""
    return "emulated" if wire else "sim"


def judged(scenario: Scenario, found: LockstepRound, *, wire: bool = False) -> Proof:
    """Return what a lockstep run, or one on the wire, showed of the scenario's row."""
    row = FAULTS[scenario.row]
    bound = row.bound_ticks + (WIRE_TICKS if wire and row.mode > Mode.SILENT else 0)
    ticks = found.ticks
    named = next((i for i, seen in enumerate(ticks) if row.id in seen.faults), None)
    bad = _first_bad(scenario, found)

    def result(measured: int | None, why: str) -> Proof:
        return Proof(row.id, scenario.what, level_of(wire=wire), measured, bound, not why, why)

    if bad is None:
        return result(None, "the fault to inject changed nothing")
    if named is None:
        return result(None, f"not named; the run ended with {', '.join(ticks[-1].faults) or 'no fault'}")
    if named < bad:
        return result(None, f"named {bad - named} ticks before there was evidence")
    if row.mode == Mode.SILENT:
        return result(None, _of_warning(ticks, named))
    if row.mode >= Mode.HOLD and found.exit_code not in _codes(row):
        return result(None, f"exit code {found.exit_code} instead of {row.exit_code}")
    if scenario.standing:
        return result(None, "the base moved" if any(seen.speed for seen in ticks[named:]) else "")
    obeyed = _obeyed(
        row, ticks, bad if scenario.by_gate else named, ticks[bad - 1].speed if bad else 0.0, by_gate=scenario.by_gate
    )
    if obeyed is None:
        return result(None, "no command was reduced")
    if row.mode < Mode.STOP <= ticks[obeyed].mode:
        return result(None, f"stopped by {', '.join(ticks[obeyed].faults)} before it could act")
    measured = obeyed - bad
    return result(measured, "" if measured <= bound else "too late")


def _codes(row: Fault) -> tuple[int, ...]:
    """Return how the run may end; where a row clears by itself, a fault that lasts may hold the base for ever."""
    return (row.exit_code,) if row.clears == Clears.LATCHED else (row.exit_code, NOT_ENDED)


def _first_bad(scenario: Scenario, found: LockstepRound) -> int | None:
    if found.first_bad is None:
        return None
    begun = next((i for i in range(found.first_bad, len(found.ticks)) if found.ticks[i].begun), None)
    return None if begun is None else begun + scenario.evidence_ticks


def _obeyed(row: Fault, ticks: Sequence[Seen], since: int, before: float, *, by_gate: bool) -> int | None:
    """Return the first tick, from `since` on, whose command is reduced (zero for a STOP)."""
    for i in range(since, len(ticks)):
        seen = ticks[i]
        most = 0.0 if row.mode >= Mode.STOP else before - LEAST_REDUCTION_M_PER_S
        if (by_gate or seen.mode >= row.mode) and (seen.speed <= most or seen.speed == 0.0):
            return i
    return None


def _of_warning(ticks: Sequence[Seen], named: int) -> str:
    """Return what is wrong with a warning: it must not raise the mode."""
    after, before = ticks[named].mode, ticks[max(named - 1, 0)].mode
    return "" if after <= max(before, Mode.PUSHING) else f"the mode became {Mode(after).name}"
