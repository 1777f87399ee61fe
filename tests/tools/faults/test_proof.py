"""`push faults`: the table, the proof of each row, and that the proof itself can fail."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from robot_io.tick import Mode
from safety.faults import FAULTS
from tests.replay.runs import PUSH, ROOT, push
from tools.faults import whole_runs, wire_proof
from tools.faults.judgement import Proof, judged
from tools.faults.lockstep_round import LockstepRound, Seen
from tools.faults.scenario import Scenario
from tools.faults.scenarios import SCENARIOS
from tools.faults.wire_round import Waited, WireRound


def test_the_table_says_everything_of_a_row(tmp_path):
    done = push("faults", "--json", state=tmp_path)
    assert done.returncode == 0, done.stderr
    rows = {row["id"]: row for row in json.loads(done.stdout)["rows"]}
    assert set(rows) == set(FAULTS)
    row = rows["F50-stop"]
    assert (row["limit"], row["unit"], row["reaction"], row["bound_ticks"], row["exit_code"]) == (
        150,
        "N",
        "STOP",
        1,
        5,
    )
    for row in rows.values():
        assert row["cause"].endswith(".")
        assert row["next_step"].endswith(".")
    plain = push("faults", state=tmp_path).stdout
    assert all(i in plain for i in FAULTS)


def test_only_takes_a_row_or_its_family(tmp_path):
    for only, ids in (("F01", ["F01-slow", "F01-hold", "F01-stop"]), ("F01-hold", ["F01-hold"]), ("F02", ["F02"])):
        done = push("faults", "--only", only, "--json", state=tmp_path)
        assert [row["id"] for row in json.loads(done.stdout)["rows"]] == ids
    done = push("faults", "--only", "F0", "--json", state=tmp_path)
    assert done.returncode == 2
    assert "no row `F0`" in json.loads(done.stdout)["error"]["what"]


def test_a_family_is_proved_in_lockstep(tmp_path):
    done = push("faults", "--run", "--only", "F73", "--json", state=tmp_path)
    assert done.returncode == 0, done.stderr
    rows = json.loads(done.stdout.splitlines()[-1])["rows"]
    assert [(row["id"], row["level"], row["bound_ticks"]) for row in rows] == [
        ("F73-hold", "sim", 50),
        ("F73-stop", "sim", 200),
    ]
    for row in rows:
        assert row["pass"]
        assert 0 < row["measured_ticks"] <= row["bound_ticks"]


@pytest.mark.long
def test_a_family_is_proved_on_the_wire_too_where_commands_may_come_two_ticks_later(tmp_path):
    done = push("faults", "--run", "--only", "F40", "--json", state=tmp_path)
    rows = json.loads(done.stdout.splitlines()[-1])["rows"]
    assert done.returncode == 0, rows
    assert [(row["id"], row["level"], row["bound_ticks"]) for row in rows] == [
        ("F40-slow", "sim", 5),
        ("F40-slow", "emulated", 7),
        ("F40-stop", "sim", 12),
        ("F40-stop", "emulated", 14),
    ]
    for row in rows:
        assert 0 < row["measured_ticks"] <= row["bound_ticks"]


@pytest.mark.long
def test_rows_without_a_reaction_are_judged_by_a_check_of_their_own(tmp_path):
    for only in ("F13", "F62"):
        done = push("faults", "--run", "--only", only, "--json", state=tmp_path)
        [row] = json.loads(done.stdout.splitlines()[-1])["rows"]
        assert (row["id"], row["measured_ticks"], row["pass"]) == (only, None, True)


def test_such_a_check_can_fail(monkeypatch):
    monkeypatch.setattr(whole_runs, "LAG_S", 5.0)
    proof = whole_runs.prove_whole_run("F13")
    assert not proof.passed
    assert "exit code" in proof.why

    def stamped(self, tick, now_ns):
        inp, output = usual(self, tick, now_ns)
        self._log.record(0, time.time_ns(), b"")
        return inp, output

    usual = whole_runs.Lockstep._tick
    monkeypatch.setattr(whole_runs.Lockstep, "_tick", stamped)
    assert "differ" in whole_runs.prove_whole_run("F62").why


def test_what_an_hour_keeps_is_noticed(monkeypatch):
    quarter = {"loop": {"ticks": 90_000, "rate_hz": 100.0}}
    monkeypatch.setattr(whole_runs, "_run", lambda _: quarter)
    assert whole_runs.an_hour() == ""
    with contextlib.ExitStack() as kept:

        def leaking(_):
            kept.enter_context(Path("/dev/null").open())
            return quarter

        monkeypatch.setattr(whole_runs, "_run", leaking)
        assert whole_runs.an_hour() == "3 descriptors more are open"
    monkeypatch.setattr(whole_runs, "_run", lambda _: quarter)
    monkeypatch.setattr(whole_runs, "_kept", iter(((1000, 6), (3049, 6))).__next__)
    assert whole_runs.an_hour() == "it has grown by 2049 kB"


@pytest.mark.long
@pytest.mark.timeout(1300)
def test_every_row_is_proved_within_20_minutes(tmp_path):
    command, environment = [sys.executable, "-c", PUSH], os.environ | {"XDG_STATE_HOME": str(tmp_path)}
    done = subprocess.run(
        [*command, "faults", "--run", "--json"],
        cwd=ROOT, env=environment, capture_output=True, text=True, timeout=1200, check=False,
    )  # fmt: skip
    failed = [row for row in json.loads(done.stdout.splitlines()[-1])["rows"] if not row["pass"]]
    assert failed == []
    assert done.returncode == 0


def test_every_row_has_a_scenario():
    assert {scenario.row for scenario in SCENARIOS} == set(FAULTS)


# --- the judgement, on rounds made by hand: the fault can be seen from tick 3 on --------------------------------

PUSHING = Seen(3, 0.1, Mode.PUSHING, (), 0.0, True)


def a_round(*ticks: Seen, exit_code: int = 5, first_bad: int | None = 3) -> LockstepRound:
    return LockstepRound([PUSHING] * 3 + list(ticks), first_bad, exit_code)


def stopped(row: str = "F22") -> Seen:
    return Seen(3, 0.0, Mode.STOP, (row,), 0.0, True)


F22 = Scenario("F22", "by hand")  # STOP within 2 ticks, exit 5


def test_the_ticks_to_the_first_zero_are_counted():
    for late, passes in ((0, True), (1, True), (2, True), (3, False)):
        proof = judged(F22, a_round(*[PUSHING] * late, stopped(), stopped()))
        assert (proof.measured_ticks, proof.passed) == (late, passes), proof


@pytest.mark.parametrize(
    ("found", "why"),
    [
        (a_round(PUSHING, stopped("F23")), "not named"),
        (a_round(PUSHING, PUSHING), "not named"),
        (a_round(stopped(), exit_code=0), "exit code 0"),
        (a_round(stopped(), first_bad=None), "changed nothing"),
        (LockstepRound([PUSHING, stopped(), stopped(), stopped()], 3, 5), "before there was evidence"),
        (a_round(Seen(3, 0.1, Mode.STOP, ("F22",), 0.0, True)), "no command was reduced"),
        (a_round(Seen(3, 0.05, Mode.STOP, ("F22",), 0.0, True)), "no command was reduced"),
    ],
)
def test_a_row_that_breaks_its_promise_does_not_pass(found, why):
    proof = judged(F22, found)
    assert not proof.passed
    assert why in proof.why


def test_a_row_that_slows_needs_a_smaller_command_only():
    slow = Seen(3, 0.09, Mode.SLOW, ("F50-slow",), 0.0, True)
    proof = judged(Scenario("F50-slow", "by hand"), a_round(slow))
    assert (proof.measured_ticks, proof.passed) == (0, True)
    proof = judged(Scenario("F50-slow", "by hand"), a_round(slow._replace(speed=0.1)))
    assert not proof.passed


def test_a_row_that_slows_has_not_acted_where_another_stopped_the_base():
    slow = Seen(3, 0.0, Mode.STOP, ("F55-slow", "F55-stop"), 0.0, True)
    proof = judged(Scenario("F55-slow", "by hand"), a_round(slow))
    assert not proof.passed
    assert "stopped by F55-slow, F55-stop" in proof.why


def test_a_warning_changes_no_mode_and_has_no_measure():
    warned = PUSHING._replace(faults=("F60-late",))
    proof = judged(Scenario("F60-late", "by hand"), a_round(warned, PUSHING))
    assert (proof.measured_ticks, proof.passed) == (None, True)
    assert not judged(Scenario("F60-late", "by hand"), a_round(warned._replace(mode=Mode.SLOW))).passed


def test_a_refusal_of_the_start_never_moves():
    refused = Seen(1, 0.0, Mode.STOP, ("R04",), 0.0, True)
    scenario = Scenario("R04", "by hand", standing=True)
    assert judged(scenario, LockstepRound([refused], 0, 4)).passed
    assert not judged(scenario, LockstepRound([refused, refused._replace(speed=0.01)], 0, 4)).passed


# --- on the wire: a host that stalled -----------------------------------------------------------------------------

MS = 1_000_000


def a_wire_round(*waited: Waited, first_bad: int | None = 3) -> WireRound:
    found = a_round(PUSHING, first_bad=first_bad)
    return WireRound(found, None if first_bad is None else 5_000 * MS, list(waited), "push: it ended")


def test_the_waiting_of_one_process_about_the_fault_counts():
    long_ago = [Waited(1_000 * MS, "gate", 0.0), Waited(1_100 * MS, "gate", 90.0)]
    about_it = [Waited(4_900 * MS, "gate", 91.0), Waited(5_100 * MS, "gate", 98.0), Waited(5_100 * MS, "arm", 500.0)]
    later = [Waited(6_000 * MS, "gate", 200.0)]
    found = a_wire_round(*long_ago, *about_it, *later)
    assert found.stall_ms(20 * MS) == 7.0
    assert found._replace(bad_ns=None).stall_ms(20 * MS) == 90.0


@pytest.mark.parametrize(("waited_ms", "rounds"), [(10.0, 1), (10.1, 4)])
def test_a_round_that_failed_is_repeated_three_times_at_most_and_only_if_the_host_stalled(
    monkeypatch, waited_ms, rounds
):
    ran = []

    def run_on_wire(scenario):
        ran.append(scenario)
        return a_wire_round(Waited(4_900 * MS, "gate", 1.0), Waited(5_010 * MS, "gate", 1.0 + waited_ms))

    monkeypatch.setattr(wire_proof, "run_on_wire", run_on_wire)
    proof = wire_proof.prove_on_wire(F22, lambda _, seen: judged(F22, seen, wire=True))
    assert not proof.passed
    assert (proof.level, proof.bound_ticks, proof.repeats) == ("emulated", 4, rounds - 1)
    assert len(ran) == rounds
    assert ("not measured" in proof.why) == (rounds > 1)


def test_a_round_that_passed_is_not_repeated_however_the_host_stalled(monkeypatch):
    stalled = a_wire_round(Waited(4_900 * MS, "gate", 0.0), Waited(5_010 * MS, "gate", 80.0))
    monkeypatch.setattr(wire_proof, "run_on_wire", lambda _: stalled)
    passed = Proof("F22", "by hand", "emulated", 1, 4, passed=True)
    assert wire_proof.prove_on_wire(F22, lambda *_: passed) == passed


def test_every_device_has_rows_on_the_wire():
    words = [word for row in FAULTS for scenario in wire_proof.on_the_wire(row) for word in scenario.words]
    devices = {word.partition("=")[0].rpartition(".")[0] for word in words}
    assert devices == {"ft", "arm", "base.pose", "base.odometry", "base.command", "base.status"}
