"""Levels sim and emulated are the same push: same verdict, distance within 2 cm, a force of the same size."""

from __future__ import annotations

import json
import statistics

from robot_io.tick import Phase
from tests.replay.runs import ticks_in


def pushing_force(log) -> float:
    forces = [tick.after.control.force_world for tick in ticks_in(log) if tick.before[0].control.phase == Phase.PUSH]
    assert len(forces) > 100
    return statistics.median((x * x + y * y) ** 0.5 for x, y, _ in forces)


def test_sim_and_emulated_come_to_the_same_end(sim_run, emulated_run):
    sim, emulated = (json.loads((run / "summary.json").read_text()) for run in (sim_run, emulated_run))
    assert sim["verdict"] == emulated["verdict"] == "done"
    assert sim["exit_code"] == emulated["exit_code"] == 0
    for figure in ("distance_m", "lateral_error_m"):
        assert abs(sim[figure] - emulated[figure]) < 0.02, figure
    assert abs(sim["distance_m"] - 0.2) < 0.02
    forces = pushing_force(sim_run / "run.mcap"), pushing_force(emulated_run / "run.mcap")
    assert abs(forces[0] - forces[1]) < 2.0
    assert min(forces) > 5.0
