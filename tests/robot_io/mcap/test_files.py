"""The files of a log: which parts a name stands for."""

from __future__ import annotations

import pytest

from robot_io.errors import LogDamaged
from robot_io.mcap.files import files_of, has_parts, part_path, whole_of


def test_a_name_stands_for_itself_or_for_its_parts_in_the_order_of_their_numbers(tmp_path):
    log = tmp_path / "run.mcap"
    assert files_of(log) == (log,)
    for number in (2, 10, 1, 3, 4, 5, 6, 7, 8, 9):
        part_path(log, number).touch()
    (tmp_path / "run_recovered_001.mcap").touch()
    (tmp_path / "other_001.mcap").touch()
    assert [file.name for file in files_of(log)] == [f"run_{n:03d}.mcap" for n in range(1, 11)]
    assert has_parts(log)
    assert whole_of(part_path(log, 3)) == log
    log.touch()
    assert files_of(log) == (log,), "a file of that name is the log"


def test_a_part_that_is_missing_is_named(tmp_path):
    for number in (1, 3):
        part_path(tmp_path / "run.mcap", number).touch()
    with pytest.raises(LogDamaged, match="part 2"):
        files_of(tmp_path / "run.mcap")


def test_the_thousandth_part_follows_the_one_before_it(tmp_path):
    log = tmp_path / "run.mcap"
    for number in range(1, 1002):
        part_path(log, number).touch()
    assert [file.stem for file in files_of(log)[-2:]] == ["run_1000", "run_1001"]
