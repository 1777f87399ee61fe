"""README: every error is one sentence: what happened, where, and what to do. Mistakes whose last part was missing."""

from pathlib import Path

import pytest

from tools import cli

LOG = str(Path(__file__).resolve().parents[1] / "golden/logs/sim.mcap")

NOWHERE = [
    ["report", LOG, "--out", "file"],
    ["report", LOG, "--out", "file/below"],
    ["report", LOG, LOG.replace("sim.mcap", "emulated.mcap"), "--out", "file/below"],
    ["view", LOG, "--out", "file/below"],
    ["log", "export", LOG, "--out", "file/below"],
    ["log", "export", LOG, "--signals", "--out", "file/below.csv"],
]


@pytest.mark.parametrize("argv", NOWHERE, ids=lambda argv: " ".join(argv).replace(LOG, "LOG"))
def test_where_nothing_can_be_written_another_place_is_asked_for(argv, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("precious")
    assert cli.main(argv) in (2, 3)
    said = capsys.readouterr().err
    assert said.splitlines()[-1].startswith("push: file")
    assert "Give another --out" in said
    assert [path.read_text() for path in tmp_path.iterdir()] == ["precious"]


@pytest.mark.parametrize(
    ("argv", "do"),
    [
        (["config", "check", "absent.toml"], "Check the name"),
        (["study", "absent.toml"], "Check the name"),
        (["run", "emulated", "--fast"], "Leave --fast out, or give a rig of level sim"),
        (["run", "sim", "--fast", "--live"], "Leave --fast out"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else None,
)
def test_the_sentence_ends_with_what_to_do(argv, do, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(argv) == 2
    assert capsys.readouterr().err.splitlines()[-1].endswith(f". {do}")
    assert not list(tmp_path.iterdir())


def test_two_numbers_in_the_wrong_order_are_told_the_order(capsys):
    assert cli.main(["tune", "--size-m=0.6,0.3"]) == 2
    assert "`0.6,0.3` is not LOW,HIGH with both from 0.01 to 10, the lower first" in capsys.readouterr().err


def test_a_grid_that_is_absent_is_named_once(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["sweep", "absent.toml"]) == 2
    said = capsys.readouterr().err
    assert said == (
        "push: absent.toml: this grid cannot be read: No such file or directory. Give `paper` or a TOML file\n"
    )
