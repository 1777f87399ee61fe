"""`push replay --ticks --jobs N`: the same answer for any N, on logs that are as they were and on ones that are not."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from msgspec.structs import replace

from robot_io.mcap.files import files_of
from robot_io.tick import TICK_CDR
from tests.replay.runs import changed, push, replayed, rewritten

JOBS = (1, 3)
LONG = ("run", "sim", "--fast", "--no-report", "--distance-m", "2.4", "--json")
"""25 s of ticks: three whole states in it."""


@pytest.fixture(scope="module")
def long_run(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("long")
    done = push(*LONG, "--out", folder / "run", state=folder / "state")
    assert done.returncode == 0, done.stderr
    return folder / "run"


def answers(capsys, log: Path) -> list[tuple[int, dict]]:
    return [replayed(capsys, log, "--ticks", "--jobs", jobs) for jobs in JOBS]


@pytest.mark.long
def test_any_number_of_processes_finds_the_same(long_run, capsys):
    one, *others = answers(capsys, long_run)
    assert one[0] == 0
    assert one[1]["identical"] == one[1]["ticks"] > 2000
    assert others == [one]


@pytest.mark.long
def test_of_a_log_in_parts_too(tmp_path, capsys):
    done = push(*LONG, "--set", "log.split_minutes=0.1", "--out", tmp_path / "run", state=tmp_path / "state")
    assert done.returncode == 0, done.stderr
    assert len(files_of(tmp_path / "run" / "run.mcap")) > 3
    one, *others = answers(capsys, tmp_path / "run")
    assert (one[0], one[1]["gaps"]) == (0, 0)
    assert others == [one]


def other_input(data: bytes) -> bytes:
    tick = TICK_CDR.decode(data)
    return TICK_CDR.encode(replace(tick, input=replace(tick.input, paused=True)))


def damaged(log: Path, out: Path) -> Path:
    return rewritten(log, out, changed("/control/tick", 1500, other_input))


def other_gain(log: Path, out: Path) -> Path:
    return rewritten(log, out, config=lambda text: text.replace("k_f = 0.3", "k_f = 0.300001"))


def as_it_is(log: Path, out: Path) -> Path:
    shutil.copy(log, out)
    return out


@pytest.mark.long
@pytest.mark.parametrize(("spoil", "code"), [(damaged, 8), (other_gain, 7), (as_it_is, 0)])
def test_what_is_wrong_is_said_in_the_same_words(
    spoil: Callable[[Path, Path], Path], code: int, long_run, tmp_path, capsys
):
    one, *others = answers(capsys, spoil(long_run / "run.mcap", tmp_path / "run.mcap"))
    assert one[0] == code
    assert others == [one]
