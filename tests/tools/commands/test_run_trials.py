"""`push run --trials`, `--note`, and the order in which a run tells how it ended."""

from __future__ import annotations

import csv
import json
import os
import pty
import time

import pytest

from robot_io.mcap.read import read_summary
from tests.forked_push import forked
from tests.host_watch import repeated_when_the_host_stalls
from tests.push_runs import QUICK, finished, one_error, started
from tests.tools.commands.test_run_asks_first import robot

SIM = ("run", "sim", "--fast", *QUICK, "--distance-m", "0.1")


@pytest.mark.long
def test_without_a_terminal_trials_follow_each_other_with_the_object_reset(state, tmp_path):
    out = tmp_path / "box"
    ended = finished(state, *SIM, "--trials", "3", "--seed", "5", "--note", "box, 2 kg", "--out", str(out), "--json")
    assert ended.code == 0, ended.err
    told = ended.last_object
    assert [trial["seed"] for trial in told["trials"]] == [5, 6, 7]
    assert (told["schema"], told["wanted"], told["exit_code"], told["out"]) == (1, 3, 0, str(out))
    found = json.loads((out / "trials.json").read_text())
    assert (found["rig"], found["level"], found["note"], len(found["trials"])) == ("sim", "sim", "box, 2 kg", 3)
    rows = list(csv.DictReader((out / "trials.csv").read_text().splitlines()))
    for folder, seed, row in zip(("trial-01", "trial-02", "trial-03"), (5, 6, 7), rows, strict=True):
        facts = read_summary(out / folder / "run.mcap").metadata["run"]
        summary = json.loads((out / folder / "summary.json").read_text())
        assert (facts["seed"], facts["note"]) == (str(seed), "box, 2 kg")
        assert (summary["seed"], summary["note"], summary["verdict"]) == (seed, "box, 2 kg", "done")
        assert float(row["distance_m"]) == summary["distance_m"] == pytest.approx(0.1, abs=0.02)
        assert float(row["worst_force_N"]) == summary["worst_force_N"] > 5.0
    assert "3 of 3 trials done" in ended.err
    assert "worst force" in ended.err
    assert forked(state, "report", str(out), "--out", str(tmp_path / "beside"), "--json").code == 0
    assert "box, 2 kg" in (tmp_path / "beside" / "compare.html").read_text()


def test_a_trial_is_the_run_of_its_seed_from_the_same_start(state, tmp_path):
    forked(state, *SIM, "--trials", "2", "--out", str(tmp_path / "both"))
    forked(state, *SIM, "--seed", "1", "--out", str(tmp_path / "one"))
    second = (tmp_path / "both" / "trial-02" / "run.mcap").read_bytes()
    assert second == (tmp_path / "one" / "run.mcap").read_bytes()


def test_a_folder_that_exists_is_refused(state, tmp_path):
    (tmp_path / "here").mkdir()
    error = one_error(forked(state, *SIM, "--trials", "2", "--out", str(tmp_path / "here"), "--json"), 2)
    assert "exists already" in error["what"]
    assert list((tmp_path / "here").iterdir()) == []


def test_a_real_robot_without_a_terminal_is_refused_in_words(state, tmp_path):
    rig = tmp_path / "real.toml"
    rig.write_text('extends = "emulated"\n[arm]\nlevel = "hardware"\nhost = "127.0.0.3"\n')
    out = tmp_path / "out"
    error = one_error(forked(state, "run", str(rig), "--move-robot", "--trials", "5", "--out", str(out), "--json"), 2)
    assert "asks on a terminal before each trial" in error["what"]
    assert "put the object back" in error["do"]
    assert not out.exists()


@pytest.mark.parametrize("words", [("--trials", "0"), ("--trials", "1001"), ("--note", "a\nb"), ("--note", "x" * 501)])
def test_what_cannot_be_meant_is_a_usage_error(state, tmp_path, words):
    one_error(forked(state, *SIM, *words, "--out", str(tmp_path / "x"), "--json"), 2)
    assert not (tmp_path / "x").exists()


def test_on_a_terminal_enter_goes_on_and_q_ends(state, tmp_path):
    out = tmp_path / "out"
    ours, theirs = pty.openpty()
    try:
        with started(state, *SIM, "--trials", "4", "--out", str(out), stdin=theirs) as run:
            run.wait_for(r"Trial 2 of 4 is next.*Enter goes on, q ends")
            os.write(ours, b"\n")
            run.wait_for(r"Trial 3 of 4 is next.*Enter goes on, q ends")
            os.write(ours, b"q\n")
            ended = run.wait()
    finally:
        os.close(ours)
        os.close(theirs)
    assert ended.code == 0
    assert "2 of 2 trials done (4 were wanted)" in ended.out
    assert sorted(path.name for path in out.iterdir()) == ["trial-01", "trial-02", "trials.csv", "trials.json"]


def test_a_fault_that_stops_every_trial_leaves_a_table_and_its_code(state, tmp_path):
    out = tmp_path / "out"
    ended = forked(state, *SIM, "--trials", "2", "--set", "limits.max_force_N=8", "--set", "limits.slow_force_N=7",
                     "--out", str(out), "--json")  # fmt: skip
    assert ended.code == 5, ended.err
    assert [trial["first_fault"] for trial in ended.last_object["trials"]] == ["F50-stop"] * 2
    assert "limit 8 N" in ended.last_object["trials"][0]["why"]


def test_the_verdict_comes_first_and_the_report_is_announced_with_its_note_on_the_page(state, tmp_path):
    """The two streams of a terminal are one: what is told first is read first."""
    read_fd, write_fd = os.pipe()
    out = tmp_path / "out"
    words = [word for word in SIM if word != "--no-report"]
    note = ("--note", "barrel <half> full")
    with started(state, *words, *note, "--out", str(out), stdout=write_fd, stderr=write_fd) as run:
        os.close(write_fd)
        told, moments = "", {}
        while text := os.read(read_fd, 4096).decode():
            told += text
            for word in ("pushed ", "writing the report ...", "report: "):
                if word in told:
                    moments.setdefault(word, (time.monotonic(), (out / "report.html").exists()))
        assert run.wait().code == 0
    os.close(read_fd)
    lines = told.splitlines()
    order = [next(i for i, line in enumerate(lines) if line.startswith(word)) for word in moments]
    assert order == sorted(order)
    assert list(moments) == ["pushed ", "writing the report ...", "report: "]
    assert [there for _, there in moments.values()] == [False, False, True]
    assert "barrel &lt;half&gt; full" in (out / "report.html").read_text()


@pytest.mark.long
def test_a_note_is_on_the_page_of_its_run(state, tmp_path):
    words = [word for word in SIM if word != "--no-report"]
    forked(state, *words, "--note", "barrel <half> full", "--out", str(tmp_path / "run"))
    assert "barrel &lt;half&gt; full" in (tmp_path / "run" / "report.html").read_text()


@pytest.mark.long
@repeated_when_the_host_stalls
def test_a_real_robot_is_looked_at_again_and_moves_on_enter_only(state, tmp_path, host):
    """The robot is emulated behind loopback. What was typed before the question counts for nothing."""
    out = tmp_path / "out"
    ours, theirs = pty.openpty()
    try:
        with robot(tmp_path) as rig:
            argv = ("run", rig, "--move-robot", "--yes", *QUICK, "--distance-m", "0.1", "--trials", "3")
            with started(state, *argv, "--out", str(out), "--json", stdin=theirs, host=host) as run:
                run.wait_for(r"trial-01/run\.mcap")
                run.wait_for(r"Trial 2 of 3 is next\. Put the object back and clear the floor: the robot moves as soon")
                assert not (out / "trial-02").exists()
                os.write(ours, b"\n")
                run.wait_for(r"Trial 3 of 3 is next")
                os.write(ours, b"q\n")
                ended = run.wait()
    finally:
        os.close(ours)
        os.close(theirs)
    trials = ended.last_object["trials"]
    assert [trial["folder"] for trial in trials] == ["trial-01", "trial-02"]
    assert trials[0]["verdict"] in ("done", "off the line"), ended.err
    assert trials[1]["verdict"] != "not started", "where nobody has put the object back, it may be missed"
    assert ended.err.count("looking at the devices; nothing moves yet") == 2
    assert ended.last_object["level"] == "hardware"
