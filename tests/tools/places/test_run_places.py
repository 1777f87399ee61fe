"""Where runs are kept: folders, and what happens when they cannot be used."""

from __future__ import annotations

from pathlib import Path

import pytest

from robot_io.errors import EnvironmentFault, UsageError
from robot_io.rig.config import load_rig
from tools.commands import run_outputs
from tools.places import run_dir, saved_tare
from tools.places.atomic_file import write_json
from tools.places.state_dir import state_dir


@pytest.fixture
def state(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return state_dir()


def test_runs_of_the_same_second_get_folders_of_their_own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("time.strftime", lambda _format: "20240229-120000")
    folders = [run_dir.create(None, "sim") for _ in range(3)]
    names = ["sim-20240229-120000", "sim-20240229-120000-2", "sim-20240229-120000-3"]
    assert folders == [Path("runs") / name for name in names]
    assert all(list(folder.iterdir()) == [] for folder in folders)


@pytest.mark.parametrize("name", run_dir.RUN_FILES)
def test_a_folder_that_holds_anything_of_a_run_is_refused(tmp_path, name):
    (tmp_path / name).touch()
    with pytest.raises(UsageError, match="already holds a run"):
        run_dir.create(tmp_path, "sim")


def test_an_empty_folder_and_one_with_other_things_is_taken(tmp_path):
    (tmp_path / "notes.txt").touch()
    assert run_dir.create(tmp_path, "sim") == tmp_path
    assert {path.name for path in tmp_path.iterdir()} == {"notes.txt"}
    assert run_dir.create(tmp_path / "a" / "b", "sim").is_dir()


def test_a_folder_that_cannot_be_made_is_said(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(UsageError, match="cannot be written"):
        run_dir.create(tmp_path / "file" / "below", "sim")


def test_discard_takes_only_what_is_of_the_run(tmp_path):
    for name in (*run_dir.RUN_FILES, "notes.txt"):
        (tmp_path / name).touch()
    run_dir.discard(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]
    (tmp_path / "notes.txt").unlink()
    run_dir.discard(tmp_path)
    assert not tmp_path.exists()


def test_a_state_folder_that_cannot_be_made_is_said(tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "file"))
    with pytest.raises(EnvironmentFault, match="XDG_STATE_HOME"):
        state_dir()


def test_a_tare_that_cannot_be_kept_does_not_take_the_verdict_with_it(state, capsys):
    rig = load_rig("emulated")
    (state / "emulated.tare.json").mkdir()
    figures = {
        "tared": True,
        "bias_force_N": [1.0, 2.0, 3.0],
        "bias_torque_Nm": [0.1, 0.2, 0.3],
        "held_joints_rad": [0.0] * 6,
    }
    run_outputs.save_tare(rig, figures)
    assert "the tare was not saved" in capsys.readouterr().err


def test_what_is_kept_for_later_runs_is_the_users_own(state):
    saved_tare.save(load_rig("emulated"), (0.0,) * 6, (0.0,) * 6)
    assert state.stat().st_mode & 0o777 == 0o700
    assert (state / "emulated.tare.json").stat().st_mode & 0o777 == 0o600


def test_a_json_file_that_cannot_be_written_leaves_no_part_of_it(tmp_path):
    (tmp_path / "summary.json").mkdir()
    with pytest.raises(OSError, match="directory"):
        write_json(tmp_path / "summary.json", {})
    assert [path.name for path in tmp_path.iterdir()] == ["summary.json"]


def test_nor_does_a_state_folder_that_cannot_be_made(tmp_path, monkeypatch, capsys):
    """A simulated run needs no lock, so that it meets the folder only when all is done."""
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "file"))
    figures = {"tared": True, "bias_force_N": [0.0] * 3, "bias_torque_Nm": [0.0] * 3, "held_joints_rad": [0.0] * 6}
    run_outputs.save_tare(load_rig("sim"), figures)
    said = capsys.readouterr().err
    assert "the tare was not saved" in said
    assert "XDG_STATE_HOME" in said
