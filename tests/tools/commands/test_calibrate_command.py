"""`push calibrate`: what it refuses in words before any device is touched, and what it asks of a person."""

import json

import pytest

from robot_io.errors import OperatorStop
from tools.calibrate import people
from tools.calibrate.people import Rest, Terminal, ask
from tools.cli import main

REFUSALS = (
    (("bias", "emulated"), "stdin is not a terminal"),
    (("frame", "emulated", "--cord"), "nobody can press"),
    (("frame", "emulated"), "one of the arguments"),
    (("frame", "--cord", "emulated"), "the rig comes before --cord"),
    (("frame", "emulated", "--cord", "--weight"), "not allowed with"),
    (("bias", "sim", "--rehearse"), "level sim has no devices"),
    (("bias", "thing", "--rehearse"), "all emulated"),
    (("bias", "emulated", "--rehearse", "--apply", "emulated"), "comes with the program"),
    (("frame", "emulated", "--from", "nothing.mcap"), "the log cannot be read"),
)


@pytest.mark.parametrize(("words", "why"), REFUSALS, ids=[" ".join(words) for words, _ in REFUSALS])
def test_what_cannot_be_is_refused_in_words_and_writes_nothing(words, why, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    with open("/dev/null") as nobody:  # noqa: PTH123 - stdin of a cron job
        monkeypatch.setattr("sys.stdin", nobody)
        assert main(["calibrate", *words, "--json"]) == 2
    told = capsys.readouterr()
    assert why in json.loads(told.out)["error"]["what"] + json.loads(told.out)["error"]["do"]
    assert not list(tmp_path.iterdir())


def test_an_existing_file_is_not_overwritten(tmp_path, capsys):
    there = tmp_path / "mine.toml"
    there.write_text("x = 1\n")
    assert main(["calibrate", "bias", "emulated", "--rehearse", "--out", str(there)]) == 2
    assert "already" in capsys.readouterr().err
    assert there.read_text() == "x = 1\n"


def test_a_person_is_asked_again_until_two_numbers_come(monkeypatch, capsys):
    lines = iter(["one\n", "1.0\n", "1,2,3\n", " 1.234, -0.5 \n", ""])
    monkeypatch.setattr("sys.stdin", _Typing(lines))
    person = Terminal()
    assert person.plumb("Measure the point", None) == (1.234, -0.5)
    assert capsys.readouterr().err.count("two numbers with a comma") == 3
    with pytest.raises(OperatorStop, match="stopped at a prompt"):
        person.plumb("Measure the point", None)


def test_enter_ends_a_step_and_devices_are_served_meanwhile(monkeypatch, capsys):
    typing, served = _Typing(iter(["\n"])), []
    monkeypatch.setattr("sys.stdin", typing)
    monkeypatch.setattr(people.select, "select", lambda *_: ([typing] if len(served) >= 3 else [], [], []))
    ask(Terminal(), Rest("Let go"), lambda: served.append(1))
    assert len(served) == 3
    assert "Let go, then press Enter" in capsys.readouterr().err


class _Typing:
    """A terminal on which these lines are typed."""

    def __init__(self, lines):
        self._lines = lines

    def isatty(self):
        return True

    def readline(self):
        return next(self._lines)
