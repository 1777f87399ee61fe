"""`push bench loop`: what it makes of wake-ups, which rounds it keeps, and what it says; the host decides the times."""

from __future__ import annotations

import contextlib
import json
import time

import pytest

from robot_io.errors import EnvironmentFault
from robot_io.ipc.realtime import RealtimeFacts
from tools.bench import loop as bench_loop
from tools.bench.clock import bare, cyclictest, full_stack
from tools.bench.clock.rounds import run_rounds, steal_ticks
from tools.bench.clock.stolen import Window
from tools.bench.clock.wakeups import Wakeups, best_of
from tools.cli import main

CYCLICTEST = """# /dev/cpu_dma_latency set to 0us
# Histogram
000028 000001
000029 000000
000030 000097
000900 000001
# Total: 000000099
# Min Latencies: 00028
# Avg Latencies: 00038
# Max Latencies: 20311
# Histogram Overflows: 00001
# Histogram Overflow at cycle number:
# Thread 0: 00042
"""


def made(p50_us: float, worst_us: float, skipped: int = 0, **facts: object) -> Wakeups:
    """Return 200 wake-ups, three of them (so the 99th percentile, too) as late as `worst_us`."""
    return Wakeups((p50_us,) * 197 + (worst_us,) * 3, skipped, facts)


def test_the_histogram_of_cyclictest_is_read_with_what_lies_beyond_it():
    found = cyclictest.read_histogram(CYCLICTEST)
    assert len(found.late_us) == 100
    assert (found.p50_us, found.p99_us, found.max_us) == (30.0, 900.0, 20_000.0)
    with pytest.raises(EnvironmentFault, match="no histogram"):
        cyclictest.read_histogram("# Histogram\n# Total: 000000000\n")


def test_the_best_of_rounds_is_taken_figure_by_figure():
    best = best_of([made(50.0, 300.0, 1), made(60.0, 200.0), made(55.0, 900.0, 4)])
    assert (best.p50_us, best.p99_us, best.max_us, best.skipped) == (50.0, 200.0, 200.0, 5)


def test_steal_is_the_eighth_number_of_the_first_line():
    assert steal_ticks("cpu  10 2 3 4 5 6 7 81 9 10\ncpu0 1 1 1 1 1 1 1 1\n") == 81
    assert steal_ticks("cpu  10 2 3 4\n") == 0


def unwatched() -> contextlib.AbstractContextManager[list[Window]]:
    """Watch nothing: of these wake-ups no times are known (test_bench_stolen.py has those that have times)."""
    return contextlib.nullcontext([])


def rounds_of(stolen: list[int], deadline_s: float = 1e9):
    """Run rounds of 10 s, in which the host takes as many ticks as listed."""
    total, time_s = [0], [0.0]

    def column() -> Wakeups:
        total[0] += stolen.pop(0)
        time_s[0] += 10.0
        return made(50.0, 90.0)

    return run_rounds({"bare": column}, deadline_s, steal=lambda: total[0], watch=unwatched, clock=lambda: time_s[0])


def test_rounds_from_which_the_host_took_time_are_dropped():
    quiet = rounds_of([0, 1, 0, 0])
    assert (quiet.count, quiet.run, quiet.too_noisy) == (3, 3, False)
    restless = rounds_of([5, 0, 2, 0, 9, 0])
    assert (restless.count, restless.run, restless.too_noisy) == (3, 6, False)
    noisy = rounds_of([5, 0, 2, 0, 9, 2])
    assert (noisy.count, noisy.run, noisy.too_noisy) == (2, 6, True)


def test_no_round_begins_that_would_end_too_late():
    found = rounds_of([0] * 6, deadline_s=25.0)
    assert (found.run, found.too_noisy) == (2, True)


@pytest.fixture
def measured(monkeypatch):
    """No measurement takes place: cyclictest gives 30 and 60 us, the others what a test says."""
    times = {"bare": (50.0, 90.0), "bare, spin": (0.3, 20.0), "full": (60.0, 100.0), "full, spin": (40.0, 110.0)}
    stages = {"wake": 60.0, "input": 30.0, "fold": 150.0, "send": 20.0, "record": 80.0}
    loop = {"to_gate_p50_ms": 0.25, "to_gate_p99_ms": 0.4, "stages_us": stages}
    monkeypatch.setattr(cyclictest, "has_cyclictest", lambda: True)
    monkeypatch.setattr(cyclictest, "measure", lambda *_: made(30.0, 60.0))
    got = RealtimeFacts(True, True, True, -1, 150.0)
    monkeypatch.setattr(bare, "measure", lambda job: (made(*times["bare, spin" if job.spin_us else "bare"]), got))
    monkeypatch.setattr(
        full_stack, "measure", lambda _rate, _s, spin, _cpu: made(*times["full, spin" if spin else "full"], **loop)
    )
    monkeypatch.setattr(bench_loop, "run_rounds", lambda columns, deadline_s, say: run_rounds(
        columns, deadline_s, steal=lambda: 0, watch=unwatched, say=say
    ))  # fmt: skip
    return times


def test_the_json_has_every_figure(measured, capsys):
    assert main(["bench", "loop", "--full-stack", "--rate", "100,500", "--json"]) == 0
    out, err = capsys.readouterr()
    found = json.loads(out)
    assert (found["schema"], found["verdict"], found["load"]) == (1, "within the aims", False)
    assert [(row["rate_hz"], row["spin_us"]) for row in found["rates"]] == [
        (100.0, 0.0), (100.0, 150.0), (500.0, 0.0), (500.0, 150.0)
    ]  # fmt: skip
    plain, spun = found["rates"][:2]
    assert plain["reference"] == "cyclictest"
    assert (plain["p50_us"], plain["p99_us"], plain["max_us"]) == (60.0, 100.0, 100.0)
    assert (plain["bare_p50_us"], plain["bare_p99_us"]) == (50.0, 90.0)
    assert (plain["ratio_p50"], plain["ratio_p99"]) == (2.0, 1.67)
    assert (plain["bare_ratio_p50"], plain["bare_ratio_p99"]) == (1.2, 1.11)
    assert (plain["rounds_kept"], plain["skipped"], plain["to_gate_p50_us"]) == (3, 0, 250.0)
    assert plain["stages_us"]["fold"] == 150.0
    assert (plain["kept_share"], plain["bare_kept_share"], plain["reference_kept_share"]) == (1.0, 1.0, 1.0)
    assert plain["skipped_stolen"] == 0
    assert (spun["p50_us"], spun["ratio_p50"], spun["ratio_p99"]) == (40.0, 1.33, 1.83)
    assert found["realtime"]["spin_us"] == 150.0
    assert "cyclictest" in err
    assert "this machine gives: real-time priority, memory locked, shallow idle; spin 150 us" in err


def test_what_lies_above_an_aim_is_named_with_its_rate(measured, capsys):
    measured["full"] = (70.0, 100.0)
    measured["full, spin"] = (40.0, 200.0)
    assert main(["bench", "loop", "--full-stack", "--rate", "200", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["verdict"] == (
        "above the aims: bare_ratio_p50 1.4 (aim 1.3) at 200 Hz without spin; "
        "ratio_p99 3.33 (aim 2) at 200 Hz with spin"
    )


def test_too_few_quiet_rounds_give_no_ratio(measured, monkeypatch, capsys):
    stolen = iter(range(0, 10_000, 100))
    monkeypatch.setattr(bench_loop, "run_rounds", lambda columns, deadline_s, say: run_rounds(
        columns, deadline_s, steal=lambda: next(stolen), watch=unwatched, say=say
    ))  # fmt: skip
    assert main(["bench", "loop", "--rate", "100", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["verdict"] == "too noisy"
    assert all(row["rounds_kept"] == 0 and row["rounds_run"] == 6 for row in found["rates"])
    assert all("ratio_p50" not in row for row in found["rates"])
    assert all(row["kept_share"] == 0.0 for row in found["rates"])


def test_without_cyclictest_the_bare_loop_is_the_reference(measured, monkeypatch, capsys):
    monkeypatch.setattr(cyclictest, "has_cyclictest", lambda: False)
    assert main(["bench", "loop", "--rate", "100", "--json"]) == 0
    out, err = capsys.readouterr()
    row = json.loads(out)["rates"][0]
    assert (row["reference"], row["ratio_p50"]) == ("bare", 1.0)
    assert "rt-tests" in err


@pytest.mark.parametrize(
    "words",
    [
        ["--rate", "10"],
        ["--rate", "fast"],
        ["--rate", ""],
        ["--duration-s", "0"],
        ["--cpu", "-2"],
        ["--picture", "x.gif"],
    ],
)
def test_what_makes_no_sense_is_usage(words, capsys):
    assert main(["bench", "loop", *words, "--json"]) == 2
    assert json.loads(capsys.readouterr().out)["error"]["code"] == 2


def test_measurements_are_shortened_to_end_within_ten_minutes(measured, capsys):
    words = ["bench", "loop", "--full-stack", "--rate", "100,200,500", "--duration-s", "120", "--json"]
    assert main(words) == 0
    out, err = capsys.readouterr()
    duration_s = json.loads(out)["duration_s"]
    # Three rates, three rounds, five measurements each, two of them with a start of about 6 s.
    assert 3 * 3 * (5 * duration_s + 2 * 6) <= 570
    assert f"each measurement takes {duration_s:.0f} s" in err


def test_the_picture_is_written(measured, tmp_path, capsys):
    for name, begins in (("a.png", b"\x89PNG"), ("a.svg", b"<?xml")):
        assert main(["bench", "loop", "--rate", "100", "--picture", str(tmp_path / name)]) == 0
        assert (tmp_path / name).read_bytes().startswith(begins)


def test_a_bare_loop_counts_every_period_once():
    before_ns = time.monotonic_ns()
    found, got = bare.measure(bare.BareJob(rate_hz=100.0, duration_s=0.3, priority=80, cpu=-1, spin_us=150.0))
    assert len(found.late_us) + found.skipped == 30
    assert found.late_us[0] >= 0.0
    woken_ns = [span.woken_ns for span in found.spans]
    assert len(woken_ns) == len(found.late_us)
    assert all(before_ns < ns < time.monotonic_ns() for ns in woken_ns)
    assert [round((span.woken_ns - span.due_ns - span.skipped * 10_000_000) * 1e-3, 3) for span in found.spans] == [
        round(us, 3) for us in found.late_us
    ]
    assert got.spin_us in (0.0, 150.0)


@pytest.mark.long
def test_a_complete_run_says_where_its_time_goes():
    before_ns = time.monotonic_ns()
    found = full_stack.measure(100.0, 3.0, 150.0)
    woken_ns = sorted(span.woken_ns for span in found.spans)
    assert before_ns < woken_ns[0] < woken_ns[-1] < time.monotonic_ns()
    assert woken_ns[-1] - woken_ns[0] == pytest.approx((len(woken_ns) - 1 + found.skipped) * 10_000_000, abs=20_000_000)
    assert len(found.late_us) > 300
    assert set(found.facts["stages_us"]) == {"wake", "input", "fold", "send", "record"}
    assert all(us > 0.0 for us in found.facts["stages_us"].values())
    assert found.facts["to_gate_p50_ms"] > 1e-3 * found.facts["stages_us"]["fold"] * 0.2
    assert set(found.facts["realtime"]) == {"fifo", "memory_locked", "idle_kept_shallow", "cpu", "spin_us"}
