"""`push view`: writes the layouts, and opens a viewer where there is one and a display."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from robot_io.rig.config import load_rig, rig_to_toml
from tools.cli import main
from tools.log.run_log import RunLog

ENVIRONMENT_FAULT = 3


@pytest.fixture
def log(tmp_path) -> Path:
    folder = tmp_path / "run"
    folder.mkdir()
    RunLog(folder / "run.mcap", config_text=rig_to_toml(load_rig("sim")), metadata={}, wall_offset_ns=0).finish({})
    return folder / "run.mcap"


@pytest.fixture
def install(tmp_path, monkeypatch):
    """Return a function that puts a viewer on the PATH, which writes down its arguments; and there is a display."""
    programs = tmp_path / "programs"
    programs.mkdir()
    monkeypatch.setenv("PATH", str(programs))
    monkeypatch.setenv("DISPLAY", ":9")

    def put(name: str, code: int = 0) -> Path:
        calls = tmp_path / f"{name}.calls"
        program = programs / name
        program.write_text(f'#!/bin/sh\necho "$@" >> {calls}\necho "so said {name}" >&2\nexit {code}\n')
        program.chmod(0o755)
        return calls

    return put


def test_it_writes_both_layouts_beside_the_log(log, install, capsys):
    assert main(["view", str(log.parent)]) == 0
    told = capsys.readouterr().err
    assert json.loads((log.parent / "view" / "lichtblick.json").read_text())["configById"]
    assert (log.parent / "view" / "push.rbl").read_bytes().startswith(b"RRF2")
    assert "no viewer was found (looked for: rerun, lichtblick, foxglove-studio)" in told
    assert f"rerun mcap convert {log} --application-id push" in told
    assert "import the layout" in told


def test_again_it_writes_over_its_own_files(log, install):
    assert main(["view", str(log)]) == 0
    assert main(["view", str(log)]) == 0
    assert sorted(path.name for path in (log.parent / "view").iterdir()) == ["lichtblick.json", "push.rbl"]


def test_rerun_is_given_a_recording_of_the_layout_s_application(log, install, capfd):
    calls = install("rerun")
    install("lichtblick")
    assert main(["view", str(log)]) == 0
    view = log.parent / "view"
    assert calls.read_text().splitlines() == [
        f"mcap convert {log} --application-id push -o {view / 'push.rrd'}",
        f"{view / 'push.rrd'} {view / 'push.rbl'}",
    ]
    assert capfd.readouterr().err.count("so said rerun") == 1  # of the window; what converts is silent


@pytest.mark.parametrize("name", ["lichtblick", "foxglove-studio"])
def test_other_viewers_are_given_the_log(name, log, install, capsys):
    calls = install(name)
    assert main(["view", str(log)]) == 0
    assert calls.read_text() == f"{log}\n"
    assert str(log.parent / "view" / "lichtblick.json") in capsys.readouterr().err


def test_without_a_display_nothing_is_opened(log, install, monkeypatch, capsys):
    calls = install("rerun")
    monkeypatch.delenv("DISPLAY")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    assert main(["view", str(log)]) == 0
    assert not calls.exists()
    assert "there is no display" in capsys.readouterr().err


def test_with_json_nothing_is_opened(log, install, tmp_path, capsys):
    calls = install("rerun")
    assert main(["view", str(log), "--out", str(tmp_path / "x" / "y"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert not calls.exists()
    assert told["layouts"] == {
        "lichtblick": str(tmp_path / "x" / "y" / "lichtblick.json"),
        "rerun": str(tmp_path / "x" / "y" / "push.rbl"),
    }
    assert all(Path(path).is_file() for path in told["layouts"].values())


def test_a_viewer_that_fails_is_named(log, install, capsys):
    install("rerun", code=7)
    assert main(["view", str(log)]) == ENVIRONMENT_FAULT
    told = capsys.readouterr().err
    assert "rerun" in told
    assert "exit code 7: so said rerun" in told


def test_what_is_no_log_is_refused_before_anything_is_written(tmp_path, install, capsys):
    other = tmp_path / "run.mcap"
    other.write_text("nothing")
    assert main(["view", str(other)]) != 0
    assert not (tmp_path / "view").exists()


def test_a_folder_that_cannot_be_made_is_an_error_in_words(log, install, capsys):
    assert main(["view", str(log), "--out", str(log / "below")]) == ENVIRONMENT_FAULT
    assert "the layouts cannot be written" in capsys.readouterr().err
