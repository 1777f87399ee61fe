"""`push bench physics`: the figures it promises, the C twin's agreement, and a machine without a compiler."""

import json
import shutil

import numpy as np
import pytest

from sim_backend.physics.batch import STATISTICS, parameters, run_arrays
from sim_backend.physics.lanes import Timing
from tools import cli
from tools.bench import physics as bench_physics
from tools.sweep.grid import lane_of
from tools.sweep.paper import paper_study


def test_the_c_twin_computes_the_same(tmp_path):
    run_c, reason = bench_physics.build_c(tmp_path)
    if run_c is None:
        pytest.skip(reason)
    assert 5e-324 > 0, "loading fast-math code must not make the process flush tiny numbers"
    study = paper_study({"law": "open-loop"})
    rows = parameters([lane_of(case) for case in (*study.cases[::9], *paper_study({}).cases[::9])])
    timing = Timing(steps=2000)
    outputs = []
    for run in (run_arrays, run_c):
        states = np.full((len(rows), timing.records, 6), np.nan)
        finals, statistics = np.zeros((len(rows), 6)), np.zeros((len(rows), STATISTICS))
        run(rows, timing, states, finals, statistics)
        outputs.append((states, finals, statistics))
    for ours, theirs in zip(*outputs, strict=True):
        np.testing.assert_allclose(theirs, ours, rtol=0, atol=1e-9, equal_nan=True)


def test_without_a_compiler_the_reason_is_said(tmp_path, monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda name: None)
    run_c, reason = bench_physics.build_c(tmp_path)
    assert run_c is None
    assert "compiler" in reason


@pytest.mark.long
@pytest.mark.parametrize("compiler", [True, False])
def test_the_figures_are_there(monkeypatch, capsys, compiler):
    monkeypatch.setattr(bench_physics, "ROUNDS", 1)
    monkeypatch.setattr(bench_physics, "BATCH_STEPS", 200)
    monkeypatch.setattr(bench_physics, "OSQP_STEPS", 100)
    monkeypatch.setattr(bench_physics, "PYTHON_STEPS", 100)
    if not compiler:
        monkeypatch.setattr(bench_physics, "build_c", lambda folder: (None, "no compiler here"))
    assert cli.main(["bench", "physics", "--json"]) == 0
    figures = json.loads(capsys.readouterr().out.splitlines()[-1])
    for name in ("batch_ns_per_step", "osqp_ns_per_step", "osqp_over_batch", "batch_all_cores_ns_per_step",
                 "cold_compile_s", "cached_load_s", "study_s", "closed_form_python_ns_per_call"):  # fmt: skip
        assert figures[name] > 0
    assert figures["study_steps"] == 29_160_000
    if compiler and shutil.which("gcc"):
        assert figures["batch_over_c"] == pytest.approx(
            figures["batch_ns_per_step"] / figures["c_ns_per_step"], rel=0.01
        )
        assert figures["c_reason"] is None
    if not compiler:
        assert figures["c_ns_per_step"] is None
        assert figures["batch_over_c"] is None
        assert figures["c_reason"] == "no compiler here"
