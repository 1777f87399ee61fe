"""A battery of trials: seeds, what ends it, what is written after each trial, its exit code and its table."""

from __future__ import annotations

import csv
import os
import pty
import sys

import msgspec
import pytest

from robot_io.errors import DeviceError
from tools.places.trials_folder import Trials, folder_name
from tools.trials import battery, question
from tools.trials.battery import run_trials, table, worst

DONE = {"verdict": "done", "exit_code": 0, "first_fault": None, "trust": [], "faults": [], "contact_seen": True}
NUMBERS = {"distance_m": 2.0, "lateral_error_m": 0.0123, "object_lateral_error_m": None, "worst_force_N": 23.44}
FIRST = {"id": "F50-stop", "value": 163.0, "limit": 150.0, "unit": "N", "at_s": 3.0}
STOPPED = {**DONE, **NUMBERS, "verdict": "safety stop", "exit_code": 5, "first_fault": FIRST}
AGAINST = [{"id": "end", "says": "against", "text": "it ended 0.4 m off"}]
OFF = {**DONE, **NUMBERS, "verdict": "off the line", "exit_code": 9, "trust": AGAINST}
BY_KEY = {**DONE, **NUMBERS, "verdict": "operator stop", "exit_code": 130}


class Pushes:
    """Pushes that come to what a test says, one after the other; a PushError is raised."""

    def __init__(self, folder, *outcomes, wanted=None, may_go_on=None, first_seed=7):
        self.asked, self.seeds = [], []
        self._outcomes = outcomes
        self._folder = folder
        begun = Trials("sim", "sim", "box", wanted or len(outcomes), 0)
        ask = (lambda before: self.asked.append(before) or may_go_on(len(self.asked))) if may_go_on else None
        self.trials = run_trials(folder, begun, first_seed, self.push, ask)

    def push(self, folder, seed, number):
        self.seeds.append(seed)
        outcome = self._outcomes[number - 1]
        if isinstance(outcome, Exception):
            raise outcome
        folder.mkdir()
        (folder / "run.mcap").touch()
        return {**NUMBERS, **outcome}

    @property
    def verdicts(self):
        return [trial.verdict for trial in self.trials.trials]


def test_seeds_follow_each_other_and_all_is_written_after_each_trial(tmp_path):
    pushes = Pushes(tmp_path, DONE, OFF, DONE)
    assert pushes.seeds == [7, 8, 9]
    found = msgspec.json.decode((tmp_path / "trials.json").read_bytes(), type=Trials)
    assert found == pushes.trials
    assert (found.schema, found.wanted, found.note, found.exit_code) == (1, 3, "box", 9)
    assert [trial.folder for trial in found.trials] == ["trial-01", "trial-02", "trial-03"]
    assert found.trials[1].why == "it ended 0.4 m off"
    rows = list(csv.DictReader((tmp_path / "trials.csv").read_text().splitlines()))
    assert [row["verdict"] for row in rows] == ["done", "off the line", "done"]
    assert float(rows[0]["worst_force_N"]) == 23.44
    assert rows[0]["object_lateral_error_m"] == ""


def test_folders_of_many_trials_sort_as_they_were_run():
    assert [folder_name(n, 10) for n in (1, 10)] == ["trial-01", "trial-10"]
    assert [folder_name(n, 120) for n in (1, 99, 120)] == ["trial-001", "trial-099", "trial-120"]


def test_the_last_seed_is_followed_by_the_first(tmp_path):
    assert Pushes(tmp_path, DONE, DONE, first_seed=2**63 - 1).seeds == [2**63 - 1, 0]


def test_a_failed_trial_does_not_end_the_battery_where_nobody_can_be_asked(tmp_path):
    pushes = Pushes(tmp_path, STOPPED, DeviceError("no answer", where="ur10"), DONE)
    assert pushes.verdicts == ["safety stop", "not started", "done"]
    assert pushes.trials.trials[0].first_fault == "F50-stop"
    assert "163 N" in pushes.trials.trials[0].why
    assert pushes.trials.trials[1].why == "ur10: no answer"
    assert pushes.trials.exit_code == 4


def test_an_operators_stop_ends_it_where_nobody_can_be_asked(tmp_path):
    assert Pushes(tmp_path, DONE, BY_KEY, DONE).verdicts == ["done", "operator stop"]


def test_on_a_terminal_the_operator_decides_after_each_trial_and_hears_how_it_failed(tmp_path):
    pushes = Pushes(tmp_path, STOPPED, BY_KEY, DONE, DONE, may_go_on=lambda times: times < 3)
    assert pushes.verdicts == ["safety stop", "operator stop", "done"]
    assert len(pushes.asked) == 3
    assert "trial-01 ended in: safety stop" in pushes.asked[0]
    assert "F50-stop the force is above the limit: 163 N" in pushes.asked[0]
    assert pushes.asked[2] == "Trial 4 of 4 is next. "


def test_a_first_trial_that_does_not_start_is_the_commands_own_error(tmp_path):
    with pytest.raises(DeviceError, match="no answer"):
        Pushes(tmp_path, DeviceError("no answer"), DONE)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("codes", "found"),
    [((0, 0), 0), ((0, 9), 9), ((9, 6), 6), ((6, 130, 0), 130), ((130, 5), 5), ((5, 4), 4), ((4, 3), 3), ((1, 5), 1)],
)
def test_the_exit_code_is_the_worst(codes, found):
    assert worst(codes) == worst(reversed(codes)) == found


def test_the_table_is_for_people(tmp_path):
    pushes = Pushes(tmp_path, DONE, STOPPED, DeviceError("no answer"), wanted=3)
    assert table(pushes.trials) == [
        "trial  verdict      pushed  end offset  object  worst force",
        "01     done         2.00 m    +0.012 m       -       23.4 N",
        "02     safety stop  2.00 m    +0.012 m       -       23.4 N",
        "03     not started       -           -       -            -",
        "1 of 3 trials done",
    ]


def test_a_battery_that_was_ended_says_how_many_were_wanted(tmp_path):
    pushes = Pushes(tmp_path, DONE, DONE, may_go_on=lambda _: False)
    assert table(pushes.trials)[-1] == "1 of 1 trials done (2 were wanted)"


def test_a_full_disk_does_not_end_it(tmp_path, monkeypatch, capsys):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(battery, "write_trials", full)
    assert Pushes(tmp_path, DONE, DONE).verdicts == ["done", "done"]
    assert "cannot be written: No space left on device" in capsys.readouterr().err


# --- the question ------------------------------------------------------------------------------------------------


@pytest.fixture
def keyboard(monkeypatch):
    ours, theirs = pty.openpty()
    stdin = os.fdopen(theirs, "r")
    monkeypatch.setattr(sys, "stdin", stdin)
    yield ours
    stdin.close()
    os.close(ours)


def answered(keyboard, monkeypatch, typed):
    """Type as soon as the question is shown; return the answer."""
    shown = []

    def write(text, **_):
        shown.append(text)
        os.write(keyboard, typed)

    monkeypatch.setattr("builtins.print", write)
    try:
        return question.goes_on("Go? ")
    finally:
        monkeypatch.undo()


@pytest.mark.parametrize(
    ("typed", "answer"),
    [(b"\n", True), (b"q\n", False), (b"Q\n", False), (b"quit\n", False), (b"y\n\n", True), (b"\x04", False)],
)
def test_enter_goes_on_and_q_or_the_end_of_input_ends(keyboard, monkeypatch, typed, answer):
    assert question.has_terminal()
    assert answered(keyboard, monkeypatch, typed) is answer


def test_an_enter_from_before_the_question_moves_no_robot(keyboard, monkeypatch):
    os.write(keyboard, b"\n\n\n")
    assert answered(keyboard, monkeypatch, b"q\n") is False
