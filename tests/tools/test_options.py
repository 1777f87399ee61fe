"""What holds for the options of every command: no abbreviations, `~`, and numbers with a range."""

import argparse
import importlib

import pytest

from tools import cli


def parsers():
    """Yield (words, parser) of every command and of each of its actions."""
    for name, command in cli.COMMANDS.items():
        parser = cli.parser_of(name, importlib.import_module(command.module))
        yield name, parser
        for action in parser._actions:
            if isinstance(action, argparse._SubParsersAction):
                yield from ((f"{name} {word}", below) for word, below in action.choices.items())


PARSERS = dict(parsers())
OPTIONS = {
    f"{words} {action.option_strings[-1] if action.option_strings else action.dest}": action
    for words, parser in PARSERS.items()
    for action in parser._actions
}
PATHS = [name for name in OPTIONS if name.split()[-1] in ("--out", "--compare", "log", "rig", "grid")]


@pytest.mark.parametrize("words", PARSERS)
def test_no_option_can_be_abbreviated(words):
    assert not PARSERS[words].allow_abbrev


@pytest.mark.parametrize(
    "argv",
    [["log", "export", "a.mcap", "--ou", "b"], ["log", "cat", "a.mcap", "--topic", "/a"], ["run", "--see", "1"]],
)
def test_a_beginning_of_an_option_is_refused(argv, capsys):
    assert cli.main(argv) == 2
    assert f"unrecognized arguments: {argv[-2]}" in capsys.readouterr().err


@pytest.mark.parametrize("name", PATHS)
def test_the_home_folder_is_meant_by_its_sign(name, monkeypatch):
    monkeypatch.setenv("HOME", "/somewhere")
    assert str(OPTIONS[name].type("~/x")) == "/somewhere/x"
    assert str(OPTIONS[name].type("x/~y")) == "x/~y"


def test_no_folder_of_that_name_is_made(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.chdir(tmp_path)
    assert cli.main(["run", "sim", "--fast", "--no-report", "--distance-m=0.1", "--out=~/x"]) == 0
    assert (tmp_path / "home/x/run.mcap").exists()
    assert not (tmp_path / "~").exists()


def test_a_user_who_is_not_there(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["report", "a.mcap", "--out=~nobody-of-this-name/x"]) == 2
    assert "there is no user `nobody-of-this-name`" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
