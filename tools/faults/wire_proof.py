"""Rows on the wire: which can be caused there, and what came of each; a round that the host stalled is repeated."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

from tools.faults.judgement import Proof
from tools.faults.lockstep_round import PERIOD_NS, LockstepRound
from tools.faults.scenario import Moment, Scenario
from tools.faults.scenarios import SCENARIOS
from tools.faults.wire_round import run_on_wire

REPEATS = 3
STALL_MS = 10.0
NOTHING_ARRIVES = ("F30",)
"""Over a lost link no zero comes: the base stops by its own timeout."""


class _Kind(NamedTuple):
    """Scenarios of one kind differ in a number only: one of them is enough on the wire."""

    row: str
    kinds: tuple[str, ...]


def on_the_wire(row: str) -> Iterator[Scenario]:
    """Yield the scenarios of a row that faults at the devices' edges bring about in the middle of a push."""
    seen = set()
    for scenario in SCENARIOS:
        kind = _Kind(scenario.row, tuple(word.partition("=")[0] for word in scenario.words))
        if scenario.row == row and _can_be_caused(scenario) and kind not in seen:
            seen.add(kind)
            yield scenario


def _can_be_caused(scenario: Scenario) -> bool:
    by_facts = scenario.alter or scenario.core or scenario.gate or scenario.silent or scenario.dead
    needs_more = scenario.settings or scenario.edge_beside_m is not None
    pushing = scenario.moment == Moment.PUSH and scenario.row not in NOTHING_ARRIVES
    return bool(scenario.words) and pushing and not by_facts and not needs_more


def prove_on_wire(scenario: Scenario, judge: Callable[[Scenario, LockstepRound], Proof]) -> Proof:
    """Run a scenario on the wire and judge it; a failure while the host stalled says nothing and is repeated."""
    for repeats in range(1 + REPEATS):
        found = run_on_wire(scenario)
        proof = judge(scenario, found.seen)._replace(repeats=repeats)
        if proof.passed:
            return proof
        why = proof.why if found.seen.ticks else f"{proof.why}: {found.said}"
        proof = proof._replace(why=why)
        if found.stall_ms(proof.bound_ticks * PERIOD_NS) <= STALL_MS:
            return proof
    return proof._replace(why=f"not measured, the host stalled in each round; in the last: {why}")
