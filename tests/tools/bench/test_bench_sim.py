"""`push bench sim` measures a real run and says each figure; the host decides what they are."""

from __future__ import annotations

import json
import math

import pytest

from tools.bench import sim as bench_sim
from tools.cli import main


@pytest.mark.long
def test_bench_sim_measures_the_whole_process_and_its_parts(monkeypatch, capsys):
    monkeypatch.setattr(bench_sim, "ROUNDS", 1)
    monkeypatch.setattr(bench_sim, "PARTS_DISTANCE_M", 0.1)
    assert main(["bench", "sim", "--distance-m", "0.1", "--json"]) == 0
    out, err = capsys.readouterr()
    assert out.count("\n") == 1
    figures = json.loads(out)
    assert figures.pop("schema") == 1
    assert all(value > 0.0 and math.isfinite(value) for value in figures.values())
    assert figures["times_real_time_by_cpu"] == pytest.approx(
        figures["simulated_s"] / figures["process_cpu_s"], rel=1e-2
    )
    assert figures["write_ns_per_tick"] > 1000.0
    assert figures["simulate_ns_per_tick"] > figures["fold_ns_per_tick"] + figures["encode_ns_per_tick"]
    assert 1000 < figures["ticks"] < 1300
    assert "times_real_time_by_cpu" in err


@pytest.mark.parametrize("distance", ["0", "nan", "1e9"])
def test_a_distance_that_makes_no_sense_is_usage(distance, capsys):
    assert main(["bench", "sim", f"--distance-m={distance}", "--json"]) == 2
    assert json.loads(capsys.readouterr().out)["error"]["code"] == 2
