"""The recorder as a process that splits its log: nothing is lost between parts, whole parts survive what ends it."""

from __future__ import annotations

import contextlib
import resource
import select
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from robot_io.errors import LogDamaged
from robot_io.log.channels import Kind
from robot_io.log.recovery import recover
from robot_io.mcap.files import files_of
from robot_io.mcap.read import read_summary
from robot_io.rig.config import load_rig, rig_to_toml
from tests.tools.run.test_recorder import Run, tick_payload, ticks_of, wait_for
from tools.cli import main


@contextlib.contextmanager
def recording(folder: Path) -> Iterator[Run]:
    """Give a recorder that begins a new part as often as it can: after each chunk of its file."""
    run = Run(folder / "run.mcap", config=rig_to_toml(load_rig("emulated", ["log.split_MB=0.001"])))
    assert run.event()["event"] == "ready"
    try:
        yield run
    finally:
        run.close()


def feed(run: Run, parts: int) -> int:
    """Push ticks until that many parts are begun; return how many."""
    count, until = 0, time.monotonic() + 30.0
    while not (run.out.parent / f"run_{parts:03d}.mcap").exists():
        assert time.monotonic() < until, "no new part"
        run.rings["control"].push(Kind.CONTROL_TICK, count * 10_000_000, tick_payload(count))
        count += 1
        time.sleep(0.002)
    return count


def test_no_tick_is_lost_between_parts(tmp_path):
    with recording(tmp_path) as run:
        count = feed(run, 4)
        done = run.finished()
    assert (done["complete"], done["ticks"]) == (True, count)
    files = files_of(run.out)
    assert [tick for file in files for tick in ticks_of(file)] == list(range(count))
    assert done["messages"] == read_summary(run.out).messages


def test_kill_9_leaves_whole_parts_and_one_that_recovers(tmp_path):
    with recording(tmp_path) as run:
        feed(run, 3)
        run.process.kill()
        run.process.wait()
    whole = files_of(run.out)[:2]
    ticks = [tick for file in whole for tick in ticks_of(file)]
    assert ticks == list(range(len(ticks)))
    assert len(ticks) > 10
    with pytest.raises(LogDamaged):
        read_summary(run.out)
    assert main(["log", "recover", str(tmp_path)]) == 0
    assert [t for file in files_of(tmp_path / "run_recovered.mcap") for t in ticks_of(file)][: len(ticks)] == ticks


@pytest.mark.parametrize("cause", ["no name is free", "the disk is full"])
def test_a_part_that_cannot_be_written_is_told_like_any_other_byte(tmp_path, cause):
    if cause == "no name is free":
        (tmp_path / "run_002.mcap").mkdir()
    with recording(tmp_path) as run:
        if cause == "the disk is full":
            resource.prlimit(run.process.pid, resource.RLIMIT_FSIZE, (15_000, 15_000))
        count = 0

        def told() -> bool:
            nonlocal count
            run.rings["control"].push(Kind.CONTROL_TICK, count * 10_000_000, tick_payload(count))
            count += 1
            return bool(select.select([run.status], [], [], 0)[0])

        wait_for(told)
        error = run.event()
        assert error["event"] == "error"
        assert "cannot be written" in error["error"]["what"]
        for name in tuple(run.alive):
            run.gone(name)
        done = run.event()
        assert (done["event"], done["complete"]) == ("finished", False)
        assert run.process.wait(10) == 1
    first = tmp_path / "run_001.mcap"
    try:
        numbers = ticks_of(first)
    except LogDamaged:
        assert recover(first, tmp_path / "saved.mcap").messages > 0
        numbers = ticks_of(tmp_path / "saved.mcap")
    assert numbers == list(range(len(numbers)))
    assert numbers
