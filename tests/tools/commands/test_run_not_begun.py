"""Ctrl-C at any moment before a run has begun leaves no folder behind: there is nothing in it that anyone wants."""

from __future__ import annotations

import json
import signal

import pytest

from tests.push_runs import QUICK
from tools.cli import main

BEFORE_IT_BEGINS = {
    "sim": (
        "tools.places.run_dir.check_writable",
        "tools.commands.run.ReportProcess",
        "tools.commands.run.own_law",
        "tools.places.run_dir.write_config",
        "tools.run.lockstep.open_log",
        "tools.run.lockstep.World",
        "tools.commands.run.LiveLine",
        "tools.run.paced.OperatorKeys",
    ),
    "emulated": (
        "tools.places.run_dir.check_writable",
        "tools.commands.run.allow_descriptors",
        "tools.commands.run.LiveLine",
        "tools.run.launcher.Processes",
        "tools.run.launcher.OperatorKeys",
    ),
}


def interrupted(*_args, **_kwargs):
    signal.raise_signal(signal.SIGINT)


@pytest.mark.parametrize(
    ("level", "place"), [(level, place) for level in BEFORE_IT_BEGINS for place in BEFORE_IT_BEGINS[level]]
)
def test_ctrl_c_before_the_first_tick_leaves_no_folder(level, place, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setattr(place, interrupted)
    out = tmp_path / "run"
    words = [word for word in QUICK if word != "--no-report"] if level == "sim" else QUICK
    assert main(["run", level, *words, "--out", str(out), "--json"]) == 130
    assert json.loads(capsys.readouterr().out)["error"]["what"] == "stopped by the operator"
    assert not out.exists()


def test_what_was_in_the_folder_stays(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setattr("tools.commands.run.own_law", interrupted)
    (tmp_path / "notes.txt").write_text("mine")
    assert main(["run", "sim", "--out", str(tmp_path)]) == 130
    assert {path.name for path in tmp_path.iterdir()} <= {"notes.txt", "state"}
    assert (tmp_path / "notes.txt").read_text() == "mine"
