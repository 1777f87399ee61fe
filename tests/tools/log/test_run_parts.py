"""A log in parts: each part is whole and replays by itself, and what names all of them reads all of them."""

from __future__ import annotations

import csv
import json
import shutil
import zipfile
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from robot_io.mcap.files import files_of
from robot_io.mcap.read import read_log
from robot_io.tick import SHORTENED, TICK_CDR, ControlTick
from tests.replay.runs import push, replayed
from tools.cli import main

PUSH = ("run", "sim", "--fast", "--no-report", "--distance-m", "0.2", "--set", "ft.tare_s=0.5")
EACH_2_S = ("--set", "log.split_minutes=0.035")


def run_of(folder: Path, *words: str) -> Path:
    done = push(*PUSH, *words, "--out", folder / "run", state=folder / "state")
    assert done.returncode == 0, done.stderr
    return folder / "run"


@pytest.fixture(scope="module")
def parts(tmp_path_factory) -> Path:
    return run_of(tmp_path_factory.mktemp("parts"), *EACH_2_S)


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> Path:
    return run_of(tmp_path_factory.mktemp("whole"))


def told(capsys: Any, *words: object) -> dict[str, Any]:
    capsys.readouterr()
    assert main([*map(str, words), "--json"]) == 0
    return dict(json.loads(capsys.readouterr().out.splitlines()[-1]))


def ticks_of(log: Path) -> list[ControlTick]:
    return [TICK_CDR.decode(m.payload) for m in read_log(log) if m.topic == "/control/tick"]


def test_a_new_part_begins_after_the_time_that_was_asked_for(parts):
    lengths = [len(ticks_of(file)) for file in files_of(parts / "run.mcap")]
    assert len(lengths) > 2
    assert set(lengths[1:-1]) == {210}, "100 ticks a second for 0.035 minutes"
    assert not (parts / "run.mcap").exists()


def test_all_parts_together_hold_the_same_push_as_one_file(parts, whole):
    one, other = (
        [TICK_CDR.encode(replace(tick, crc32_before=0, before=())) for tick in ticks_of(run / "run.mcap")]
        for run in (parts, whole)
    )
    assert one == other


def test_each_part_begins_with_the_whole_state_and_replays_by_itself(parts, capsys):
    for number, file in enumerate(files_of(parts / "run.mcap"), 1):
        first = ticks_of(file)[0]
        assert first.before[0].safety.first_ns == (0 if number == 1 else ticks_of(file)[-1].after.safety.first_ns)
        code, found = replayed(capsys, file)
        assert (code, found["identical"], found["gaps"]) == (0, found["ticks"], 0), file
        assert found["derived"]["identical"] == found["derived"]["messages"] > 1000
        assert found["arrived"]["identical"] == found["arrived"]["messages"] > 100
        assert (found["world"] is None) == (number > 1)


def test_replay_of_the_folder_goes_on_from_part_to_part_and_the_world_with_it(parts, whole, capsys):
    code, found = replayed(capsys, parts)
    _, one = replayed(capsys, whole)
    assert (code, found["ticks"], found["identical"]) == (0, one["ticks"], one["ticks"])
    assert found["world"] == one["world"]
    assert found["arrived"] == one["arrived"]


def test_replay_of_the_ticks_alone(parts, capsys):
    code, found = replayed(capsys, parts, "--ticks")
    assert (code, found["identical"]) == (0, found["ticks"])
    assert (found["world"], found["derived"], found["arrived"]) == (None, None, None)
    assert "only the ticks were compared" in found["notes"]


@pytest.mark.parametrize("change", ["missing", "swapped"])
def test_a_part_that_is_missing_or_out_of_place_is_found(parts, tmp_path, capsys, change):
    run = tmp_path / "run"
    shutil.copytree(parts, run)
    second, third = run / "run_002.mcap", run / "run_003.mcap"
    if change == "missing":
        second.unlink()
    else:
        kept = second.read_bytes()
        second.write_bytes(third.read_bytes())
        third.write_bytes(kept)
    assert main(["replay", str(run)]) == 8
    assert "002" in capsys.readouterr().err


def test_info_cat_and_export_of_the_folder_are_of_all_parts(parts, tmp_path, capsys):
    files = files_of(parts / "run.mcap")
    info = told(capsys, "log", "info", parts)
    assert info["parts"] == [file.name for file in files]
    assert info["messages"] == sum(told(capsys, "log", "info", file)["messages"] for file in files)
    assert info["size_bytes"] == sum(file.stat().st_size for file in files)
    ticks = len(ticks_of(parts / "run.mcap"))
    assert told(capsys, "log", "cat", parts, "--topics", "/control/tick")["messages"] == ticks
    assert told(capsys, "log", "export", parts, "--out", tmp_path / "tables")["files"]["control_tick.csv"] == ticks
    assert told(capsys, "log", "export", parts, "--signals", "--out", tmp_path / "signals.csv")["rows"] == ticks
    with (tmp_path / "signals.csv").open(newline="") as file:
        times = [float(row["time_s"]) for row in csv.DictReader(file)]
    assert times == pytest.approx([n * 0.01 for n in range(ticks)], abs=1e-6)


def test_report_view_and_zip_take_the_folder(parts, tmp_path, capsys):
    run = tmp_path / "run"
    shutil.copytree(parts, run)
    assert Path(told(capsys, "report", run)["report"]).stat().st_size > 10_000
    assert told(capsys, "view", run)["signals"]
    packed = told(capsys, "log", "zip", run, "--out", tmp_path / "runs.zip")
    assert len(packed["runs"]) == 1
    with zipfile.ZipFile(tmp_path / "runs.zip") as file:
        file.extractall(tmp_path / "unpacked")
    assert replayed(capsys, tmp_path / "unpacked" / "run")[0] == 0


def test_a_log_in_parts_whose_last_one_was_cut_off_is_recovered(parts, tmp_path, capsys):
    run = tmp_path / "run"
    shutil.copytree(parts, run)
    last = files_of(run / "run.mcap")[-2]
    files_of(run / "run.mcap")[-1].unlink()
    last.write_bytes(last.read_bytes()[:-40_000])
    assert main(["replay", str(run)]) == 8
    saved = told(capsys, "log", "recover", run)
    assert saved["parts"] == [file.name.replace("run_", "run_recovered_") for file in files_of(run / "run.mcap")]
    code, found = replayed(capsys, run / "run_recovered.mcap")
    assert (code, found["complete"]) == (0, False)
    assert found["identical"] == found["ticks"] > 200


def test_a_folder_that_holds_parts_holds_a_run(parts, capsys):
    assert main([*PUSH, "--out", str(parts)]) == 2
    assert "already holds a run" in capsys.readouterr().err


def test_a_new_part_begins_at_the_size_that_was_asked_for(tmp_path):
    run = run_of(tmp_path, "--set", "log.split_MB=0.2")
    sizes = [file.stat().st_size for file in files_of(run / "run.mcap")]
    assert len(sizes) > 2
    assert all(200_000 <= size < 600_000 for size in sizes[:-1]), "looked at when a chunk of 1 MiB is full"


def test_lean_topics_keep_ticks_devices_and_signals_and_thin_out_the_rest(whole, tmp_path, capsys):
    run = run_of(tmp_path, "--set", 'log.topics="lean"')
    rates = {}
    for name, folder in (("all", whole), ("lean", run)):
        info = told(capsys, "log", "info", folder)
        rates[name] = {c["topic"]: c["messages"] / info["duration_s"] for c in info["channels"]}
    for topic in (
        "/control/tick",
        "/control/signals",
        "/ft/wrench_raw",
        "/arm/joint_states",
        "/base/pose",
        "/gate/sent",
    ):
        assert rates["lean"][topic] == rates["all"][topic]
    for topic in ("/ft/wrench", "/base/cmd_vel", "/base/cmd_vel_raw", "/world/state"):
        assert rates["all"][topic] == pytest.approx(100, abs=2)
        assert rates["lean"][topic] == pytest.approx(25, abs=1), topic
    assert rates["lean"]["/tf"] == pytest.approx(50, abs=2), "base and object"
    assert replayed(capsys, run)[0] == 0
    assert Path(told(capsys, "report", run)["report"]).stat().st_size > 10_000


@pytest.mark.long
def test_a_tick_holds_the_state_before_it_every_10_s_and_is_short_otherwise(tmp_path):
    folder = tmp_path / "run"
    done = push(*PUSH[:5], "2.4", *PUSH[6:], "--out", folder, state=tmp_path / "state")
    assert done.returncode == 0, done.stderr
    ticks = ticks_of(folder / "run.mcap")
    kept = [tick.input.tick for tick in ticks if tick.before]
    assert kept == list(range(0, len(ticks), 1000))
    assert len(kept) > 2
    assert {tick.reserved for tick in ticks[:-1]} == {SHORTENED}
    assert ticks[-1].reserved == 0, "how a run ended is told whole"
