"""Every row of the fault table, proved: which rounds a row needs, and what came of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

from safety.faults import FAULTS
from tools.faults import pairs
from tools.faults.judgement import Proof, judged
from tools.faults.lockstep_round import run_lockstep
from tools.faults.scenarios import SCENARIOS
from tools.faults.whole_runs import CHECKS, prove_whole_run
from tools.faults.wire_proof import on_the_wire, prove_on_wire

ALL_IDS: tuple[str, ...] = (*FAULTS, *CHECKS, pairs.ID)


def prove(ids: Sequence[str]) -> Iterator[Proof]:
    """Bring about the rows `ids`, in the order of the table; a row without a scenario fails."""
    for row in ids:
        if row == pairs.ID:
            yield from pairs.prove_pairs()
            continue
        if row in CHECKS:
            yield prove_whole_run(row)
            continue
        scenarios = [scenario for scenario in SCENARIOS if scenario.row == row]
        if not scenarios:
            yield Proof(row, "", "", None, FAULTS[row].bound_ticks, False, "there is no scenario for it")
        for scenario in scenarios:
            yield judged(scenario, run_lockstep(scenario))
        for scenario in on_the_wire(row):
            yield prove_on_wire(scenario, partial(judged, wire=True))
