"""Which code made a log decides what a difference is called, never whether it is seen, and damage stays damage."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from robot_io.log.log_format import LOG_FORMAT
from tests.how_many import mostly_long
from tests.replay.runs import changed, replayed, rewritten
from tools.cli import main
from tools.replay import verified_log
from tools.replay.code_origin import compare_code

USAGE, DIFFERS, DAMAGED = 2, 7, 8
THEN, NOW = "1" * 40, "2" * 40
CLEAN = {"format": str(LOG_FORMAT), "program": "single-point-push 0.1.0", "commit": NOW, "dirty": "False"}

Metadata = Callable[[str, dict[str, str]], dict[str, str]]


def facts(**changes: str | None) -> Metadata:
    """Return an editor of the log's facts; None removes one."""

    def edit(name: str, values: dict[str, str]) -> dict[str, str]:
        if name != "run":
            return values
        merged = {**values, **changes}
        return {key: value for key, value in merged.items() if value is not None}

    return edit


@pytest.fixture(autouse=True)
def _at_a_clean_commit(monkeypatch):
    monkeypatch.setattr(verified_log, "code_facts", lambda: CLEAN)


def told(capsys, log: Path) -> tuple[int, list[str]]:
    capsys.readouterr()
    code = main(["replay", str(log)])
    return code, capsys.readouterr().out.splitlines()


def other_gain(text: str) -> str:
    assert "k_f = 0.3" in text
    return text.replace("k_f = 0.3", "k_f = 0.31")


MADE = {
    "this commit": ({"commit": NOW, "dirty": "False"}, ""),
    "another commit": ({"commit": THEN, "dirty": "False"}, "commit 111111111111; today's is commit 222222222222"),
    "uncommitted changes": (
        {"commit": NOW, "dirty": "True"},
        "commit 222222222222, with uncommitted changes; today's is commit 222222222222",
    ),
    "no checkout": (
        {"commit": None, "dirty": None},
        "an unknown commit of single-point-push 0.1.0; today's is commit 222222222222",
    ),
}


@pytest.mark.parametrize("name", mostly_long(MADE, "this commit", "no checkout"))
def test_identical_ticks_verify_with_a_note_of_the_code(name, sim_log, tmp_path, capsys):
    changes, words = MADE[name]
    log = rewritten(sim_log, tmp_path / "run.mcap", metadata=facts(**changes))
    code, lines = told(capsys, log)
    assert code == 0
    assert [line for line in lines if "commit" in line] == ([f"note: made by {words}"] if words else [])
    code, as_json = replayed(capsys, log)
    assert code == 0
    assert as_json["made_by"] == {
        "format": LOG_FORMAT,
        "commit": changes["commit"] or "",
        "dirty": changes["dirty"] == "True",
        "other": bool(words),
    }


@pytest.mark.parametrize("name", mostly_long(MADE, "this commit", "another commit"))
def test_different_ticks_are_said_to_be_of_other_code_where_they_can_be(name, sim_log, tmp_path, capsys):
    changes, words = MADE[name]
    log = rewritten(sim_log, tmp_path / "run.mcap", metadata=facts(**changes), config=other_gain)
    code, lines = told(capsys, log)
    assert code == DIFFERS
    assert any(line.startswith("first difference: tick") for line in lines)
    assert [line for line in lines if "commit" in line] == ([f"made by other code ({words})"] if words else [])


def test_a_dirty_checkout_of_the_log_s_commit_is_other_code(sim_log, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(verified_log, "code_facts", lambda: {**CLEAN, "dirty": "True"})
    log = rewritten(sim_log, tmp_path / "run.mcap", metadata=facts(commit=NOW, dirty="False"), config=other_gain)
    code, lines = told(capsys, log)
    assert code == DIFFERS
    here = "commit 222222222222"
    assert f"made by other code ({here}; today's is {here}, with uncommitted changes)" in lines


def test_damage_keeps_its_words_whatever_code_made_the_log(sim_log, tmp_path, capsys):
    flip = changed("/control/tick", 40, lambda data: data[:-9] + bytes((data[-9] ^ 1,)) + data[-8:])
    lost = changed("/base/pose", 40, lambda data: data[:-9] + bytes((data[-9] ^ 1,)) + data[-8:])
    for n, (edit, words) in enumerate(((flip, "was altered"), (lost, "messages or their types"))):
        log = rewritten(sim_log, tmp_path / f"{n}.mcap", edit, metadata=facts(commit=THEN, dirty="True"))
        code, error = replayed(capsys, log)
        assert code == DAMAGED
        assert words in error["error"]["what"]


def sealed_config(change: Callable[[str], str], changes: Metadata) -> tuple[Callable[[str], str], Metadata]:
    """Return editors that change the config and its seal, as other code would have written both."""
    from robot_io.log.seal import config_seal

    made: list[str] = []

    def config(text: str) -> str:
        made.append(change(text))
        return made[-1]

    def metadata(name: str, values: dict[str, str]) -> dict[str, str]:
        return {**values, **config_seal(made[-1].encode())} if name == "run_end" else changes(name, values)

    return config, metadata


def test_a_config_that_only_other_code_could_use_is_no_damage(sim_log, tmp_path, capsys):
    def unknown_key(text: str) -> str:
        return text.replace("[control]\n", "[control]\nk_new = 1.0\n")

    config, metadata = sealed_config(unknown_key, facts(commit=THEN, dirty="False"))
    log = rewritten(sim_log, tmp_path / "other.mcap", config=config, metadata=metadata)
    code, error = replayed(capsys, log)
    assert code == DIFFERS
    assert error["error"]["what"].startswith("made by other code (commit 111111111111; ")
    assert "`control.k_new`" in error["error"]["what"]
    assert replayed(capsys, log, "--what-if", "control.k_f=0.1")[0] == DIFFERS

    damaged = rewritten(
        sim_log,
        tmp_path / "damaged.mcap",
        changed("/control/tick", 40, lambda data: data[:-9] + bytes((data[-9] ^ 1,)) + data[-8:]),
        config=config,
        metadata=metadata,
    )
    assert replayed(capsys, damaged)[0] == DAMAGED
    unsealed = rewritten(
        sim_log, tmp_path / "unsealed.mcap", config=unknown_key, metadata=facts(commit=THEN, dirty="False")
    )
    assert replayed(capsys, unsealed)[0] == DAMAGED
    config, metadata = sealed_config(unknown_key, facts(commit=NOW, dirty="False"))
    own = rewritten(sim_log, tmp_path / "own.mcap", config=config, metadata=metadata)
    assert replayed(capsys, own)[0] == DAMAGED


def test_a_later_format_is_refused_in_true_words_and_still_looked_into(sim_ticks, write_log, tmp_path, capsys):
    later = LOG_FORMAT + 1
    said = {"format": str(later), "program": "single-point-push 0.9"}
    log = write_log(tmp_path / "run.mcap", sim_ticks[:5], said)
    for command in (["replay", str(log)], ["report", str(log), "--out", str(tmp_path)]):
        assert main(command) == USAGE
        told_words = capsys.readouterr().err
        assert f"format {later}" in told_words
        assert f"up to {LOG_FORMAT}" in told_words
        assert "single-point-push 0.9" in told_words
    assert main(["log", "info", str(log)]) == 0
    assert f"format = {later}" in capsys.readouterr().out
    assert main(["log", "cat", str(log), "--topics", "/loop/timing"]) == 0


@pytest.mark.parametrize("said", ["", "two", "-1", "0", "1e3", "²", "9" * 40])
def test_a_format_that_is_no_number_is_damage(said, sim_log, tmp_path, capsys):
    log = rewritten(sim_log, tmp_path / "run.mcap", metadata=facts(format=said))
    code, error = replayed(capsys, log)
    assert code == DAMAGED
    assert "which is not a number" in error["error"]["what"]


def test_two_installations_without_a_checkout_are_told_apart_by_their_version():
    installed = {"program": "single-point-push 0.1.0", "format": str(LOG_FORMAT)}
    assert not compare_code(installed, installed, LOG_FORMAT).other
    assert compare_code({**installed, "program": "single-point-push 0.2.0"}, installed, LOG_FORMAT).other
    assert compare_code({"program": "single-point-push 0.1.0"}, installed, 1).other
