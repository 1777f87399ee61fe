"""Every row of the fault table, proved: which rounds a row needs, and what came of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from safety.faults import FAULTS
from tools.faults.judgement import Proof, judged
from tools.faults.lockstep_round import run_lockstep
from tools.faults.scenarios import SCENARIOS

ALL_IDS: tuple[str, ...] = tuple(FAULTS)


def prove(ids: Sequence[str]) -> Iterator[Proof]:
    """Bring about the rows `ids`, in the order of the table; a row without a scenario fails."""
    for row in ids:
        scenarios = [scenario for scenario in SCENARIOS if scenario.row == row]
        if not scenarios:
            yield Proof(row, "", "", None, FAULTS[row].bound_ticks, False, "there is no scenario for it")
        for scenario in scenarios:
            yield judged(scenario, run_lockstep(scenario))
