"""What holds for the options of every command: no abbreviations, `~`, and numbers with a range."""

import argparse
import importlib

import pytest

from robot_io import errors
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
PATHS = [name for name in OPTIONS if name.split()[-1] in ("--out", "--apply", "--compare", "log", "rig", "grid")]

FOR_NUMBERS = ("M", "N", "S", "MU", "RATIO", "K_F", "X", "LOW,HIGH", "SEED", "K_F,K_Y", "DEG", "MM")
NUMBERS = [
    name
    for name, action in OPTIONS.items()
    if not action.choices and (action.type in (int, float) or action.metavar in FOR_NUMBERS)
]


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


@pytest.mark.parametrize("name", PATHS)
def test_an_empty_path_is_refused_and_does_not_mean_the_current_folder(name):
    with pytest.raises(argparse.ArgumentTypeError, match="an empty name"):
        OPTIONS[name].type("")


def test_nothing_is_written_where_the_name_is_empty(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for argv in (["run", "sim", "--fast", "--distance-m=0.1", "--out="], ["run", ""], ["replay", ""]):
        assert cli.main(argv) == 2
        assert "an empty name" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_user_who_is_not_there(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["report", "a.mcap", "--out=~nobody-of-this-name/x"]) == 2
    assert "there is no user `nobody-of-this-name`" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", NUMBERS)
@pytest.mark.parametrize("far", ["nan", "inf", "1e30", "-1e30", "none", ""])
def test_every_number_has_a_range(name, far):
    action = OPTIONS[name]
    text = f"{far},{far}" if action.metavar in ("LOW,HIGH", "K_F,K_Y") else far
    with pytest.raises((argparse.ArgumentTypeError, errors.UsageError), match=r" to \S*\d"):
        action.type(text)


@pytest.mark.parametrize(
    "option",
    [
        "run --distance-m", "run --seed", "bench sim --distance-m", "replay --tolerance", "sweep --dt",
        "sweep --workers", "sweep --gains", "emulate ft300 --step-after-s", "emulate all --seed", "tune --size-m",
        "tune --width-m", "tune --ball-radius-m", "tune --push-height-m", "tune --floor-friction", "tune --anisotropy",
        "tune --slide-force-N", "tune --k-f",
    ],
)  # fmt: skip
def test_no_number_is_forgotten(option):
    assert option in NUMBERS


def test_a_length_beyond_its_range_is_one_sentence_with_the_range(capsys):
    assert cli.main(["tune", "--size-m=300"]) == 2
    assert "argument --size-m: `300` is not LOW,HIGH with both from 0.01 to 10" in capsys.readouterr().err
    assert cli.main(["tune", "--size-m=0.3,300"]) == 2
    assert "from 0.01 to 10" in capsys.readouterr().err
    assert cli.main(["run", "sim", "--distance-m=3000"]) == 2
    assert "argument --distance-m: `3000` is not a number from 0.001 to 1000" in capsys.readouterr().err
    assert cli.main(["emulate", "all", "--seed=0.5"]) == 2
    assert "argument --seed: `0.5` is not a whole number from 0 to 9223372036854775807" in capsys.readouterr().err
