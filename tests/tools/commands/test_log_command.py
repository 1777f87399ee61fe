"""`push log` as a user runs it, on whole, truncated, damaged and odd logs."""

from __future__ import annotations

import csv
import json
import math
import subprocess
import sys
from pathlib import Path

import pytest
from mcap.writer import Writer

from robot_io.cdr.cdr_type import CdrType
from robot_io.log import ros_messages as ros
from robot_io.mcap.log_file import McapLog
from robot_io.messages import Pose2D
from tests.push_runs import QUICK, finished
from tools.cli import main

START_NS = 1_600_000_000_000_000_000


@pytest.fixture
def log(tmp_path) -> Path:
    path = tmp_path / "run.mcap"
    log = McapLog(path, config_text="x = 1\n", metadata={"seed": "3"})
    log.channel("/ft/wrench", ros.WRENCH_STAMPED)
    log.channel("/arm/joint_states", ros.JOINT_STATE)
    pose = CdrType(Pose2D, "push_msgs/msg/Pose2D")
    log.channel("/pose", pose)
    for n in range(50):
        now_ns = START_NS + n * 10_000_000
        header = ros.Header(ros.ros_time(now_ns), "world")
        force = ros.Wrench(ros.Vector3(n * 0.5, math.nan, 0.0), ros.Vector3(0.0, math.inf, 0.125))
        log.write("/ft/wrench", now_ns, ros.WRENCH_STAMPED.encode(ros.WrenchStamped(header, force)))
        joints = ros.JointState(header, ("a", "b"), (1.0, 2.0), (), ())
        log.write("/arm/joint_states", now_ns, ros.JOINT_STATE.encode(joints))
        log.write("/pose", now_ns, pose.encode(Pose2D(0.1, 0.2, 0.3)))
        log.flush()
    log.finish({"ticks": "0"})
    return path


@pytest.mark.parametrize("action", ["info", "cat", "export"])
def test_a_run_s_folder_names_its_log(log, capsys, action):
    assert main(["log", action, str(log.parent), "--json"]) == 0
    assert last_json(capsys)["log"] == str(log)


@pytest.mark.parametrize("action", ["info", "cat", "export", "recover"])
def test_a_folder_without_a_run_is_one_sentence(tmp_path, capsys, action):
    assert main(["log", action, str(tmp_path)]) == 2
    told = capsys.readouterr().err
    assert "no run.mcap in this folder" in told
    assert told.count("\n") <= 2
    assert list(tmp_path.iterdir()) == []


def last_json(capsys) -> dict:
    return json.loads(capsys.readouterr().out.splitlines()[-1])


def test_info_for_people_and_for_scripts(log, capsys):
    assert main(["log", "info", str(log)]) == 0
    text = capsys.readouterr().out
    assert "150 messages, intact" in text
    assert "geometry_msgs/msg/WrenchStamped" in text
    assert "seed = 3" in text
    assert main(["log", "info", str(log), "--json"]) == 0
    out = capsys.readouterr().out
    assert out.count("\n") == 1
    info = json.loads(out)
    assert (info["schema"], info["messages"], info["duration_s"]) == (1, 150, 0.49)
    assert {"topic": "/pose", "type": "push_msgs/msg/Pose2D", "messages": 50, "latched": False} in info["channels"]
    assert info["metadata"] == {"run": {"seed": "3"}, "run_end": {"ticks": "0"}}
    assert info["attachments"] == {"config.toml": 6}


def test_cat_prints_each_message_as_strict_json(log, capsys):
    assert main(["log", "cat", str(log), "--topics", "/ft/wrench", "/pose"]) == 0

    def refuse(word: str) -> None:
        raise AssertionError(word)

    lines = [json.loads(line, parse_constant=refuse) for line in capsys.readouterr().out.splitlines()]
    assert len(lines) == 100
    assert lines[2]["topic"] == "/ft/wrench"
    assert lines[2]["log_time_ns"] == START_NS + 10_000_000
    assert lines[2]["message"]["wrench"]["force"] == {"x": 0.5, "y": None, "z": 0.0}
    assert lines[3]["message"] == {"x": 0.1, "y": 0.2, "yaw": 0.3}


def test_cat_of_an_unknown_topic_names_the_known_ones(log, capsys):
    assert main(["log", "cat", str(log), "--topics", "/nope", "--json"]) == 2
    error = last_json(capsys)["error"]
    assert "/nope" in error["what"]
    assert "/ft/wrench" in error["do"]


def test_export_writes_a_table_per_topic_with_units(log, tmp_path, capsys):
    assert main(["log", "export", str(log), "--json"]) == 0
    done = last_json(capsys)
    assert done["files"] == {"ft_wrench.csv": 50, "arm_joint_states.csv": 50, "pose.csv": 50}
    with (tmp_path / "run_csv" / "ft_wrench.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert float(rows[4]["wrench.force.x [N]"]) == 2.0
    assert math.isnan(float(rows[4]["wrench.force.y [N]"]))
    assert math.isinf(float(rows[4]["wrench.torque.y [N*m]"]))
    assert (rows[4]["log_time [ns]"], float(rows[4]["time [s]"])) == (str(START_NS + 40_000_000), 0.04)
    with (tmp_path / "run_csv" / "arm_joint_states.csv").open(newline="") as file:
        assert json.loads(next(csv.DictReader(file))["position [rad]"]) == [1.0, 2.0]
    assert (tmp_path / "run_csv" / "pose.csv").read_text().startswith("log_time [ns],time [s],x [m],y [m],yaw [rad]")
    before = sorted((tmp_path / "run_csv").iterdir())
    assert main(["log", "export", str(log)]) == 2
    assert "not empty" in capsys.readouterr().err
    assert sorted((tmp_path / "run_csv").iterdir()) == before


def test_a_format_is_not_read_as_a_topic(log, tmp_path, capsys):
    assert main(["log", "export", str(log), "--to", "parquet"]) == 2
    assert "--signals" in capsys.readouterr().err
    assert not (tmp_path / "run_csv").exists()


def test_an_export_that_failed_does_not_block_the_next(tmp_path, capsys):
    payload = b"\x00\x01\x00\x00\x01"
    path = odd(tmp_path / "odd.mcap", {"/a/b": ("bool x", payload), "/a_b": ("bool x", payload)})
    kept = tmp_path / "kept"
    kept.mkdir()
    for out in (tmp_path / "new", kept):
        assert main(["log", "export", str(path), "--out", str(out)]) == 2
        assert "two topics would share a_b.csv" in capsys.readouterr().err
        assert out.exists() == (out == kept)
        assert main(["log", "export", str(path), "--out", str(out), "--topics", "/a_b"]) == 0
        assert [file.name for file in out.iterdir()] == ["a_b.csv"]


def test_export_into_a_place_that_cannot_be_written_is_one_sentence(log, tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert main(["log", "export", str(log), "--out", str(tmp_path / "file" / "x")]) == 3
    assert "cannot be written" in capsys.readouterr().err


def test_a_truncated_log_is_exit_8_with_the_command_that_helps_and_the_command_helps(log, tmp_path, capsys):
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(log.read_bytes()[: log.stat().st_size // 3])
    for action in ("info", "cat", "export"):
        assert main(["log", action, str(cut), "--json"]) == 8
        assert f"push log recover {cut}" in last_json(capsys)["error"]["do"]
    assert main(["log", "recover", str(cut), "--json"]) == 0
    saved = last_json(capsys)
    assert 0 < saved["messages"] < 150
    assert saved["out"] == str(tmp_path / "cut_recovered.mcap")
    assert main(["log", "info", saved["out"], "--json"]) == 0
    assert last_json(capsys)["messages"] == saved["messages"]
    assert main(["log", "recover", str(cut)]) == 2
    assert main(["log", "recover", str(log), "--out", str(tmp_path / "new.mcap")]) == 2


@pytest.mark.parametrize("bytes_left", [8, 20, 60])
def test_recover_does_not_advise_itself_where_nothing_is_left(log, tmp_path, capsys, bytes_left):
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(log.read_bytes()[:bytes_left])
    assert main(["log", "recover", str(cut), "--json"]) == 8
    error = last_json(capsys)["error"]
    assert "no message can be saved" in error["what"]
    assert "the log is truncated" in error["what"]
    assert "log recover" not in error["do"]
    assert "copy" in error["do"]
    assert [path.name for path in tmp_path.glob("cut*")] == ["cut.mcap"]


def test_a_flipped_bit_is_exit_8(log, tmp_path, capsys):
    raw = bytearray(log.read_bytes())
    raw[len(raw) // 3] ^= 1
    bad = tmp_path / "bad.mcap"
    bad.write_bytes(raw)
    assert main(["log", "info", str(bad), "--json"]) == 8
    assert "damaged" in last_json(capsys)["error"]["what"]


@pytest.mark.parametrize("command", [["replay"], ["log", "info"]])
def test_what_a_log_says_never_reaches_the_terminal_as_a_command(command, tmp_path, capsys):
    path = tmp_path / "run.mcap"
    with path.open("wb") as file:
        writer = Writer(file, enable_data_crcs=True)
        writer.start("ros2", "other")
        writer.add_attachment(0, 0, "config.toml", "application/toml", b'["\\u001b[2J"]\nx = 1\n')
        writer.register_channel("/a\x1b[2J", "json", 0)
        writer.add_metadata("run\x1b[2J", {"\x1b[2J": "\x1b[2J"})
        writer.finish()
    main([*command, str(path)])
    out, err = capsys.readouterr()
    assert out + err
    assert "\x1b" not in out + err


def test_missing_file_and_missing_action_are_exit_2(tmp_path, capsys):
    assert main(["log", "info", str(tmp_path / "none.mcap"), "--json"]) == 2
    assert last_json(capsys)["error"]["where"].endswith("none.mcap")
    assert main(["log", "--json"]) == 2


def odd(path: Path, topics: dict[str, tuple[str, bytes]]) -> Path:
    with path.open("wb") as file:
        writer = Writer(file, enable_data_crcs=True)
        writer.start("ros2", "other")
        for n, (topic, (text, payload)) in enumerate(topics.items()):
            schema = writer.register_schema(f"p/msg/T{n}", "ros2msg", text.encode())
            writer.add_message(writer.register_channel(topic, "cdr", schema), 1, payload, 1)
        writer.finish()
    return path


def test_topics_that_cannot_be_read_are_named_and_the_rest_is_read(tmp_path, capsys):
    payload = b"\x00\x01\x00\x00\x01"
    topics = {
        "/good": ("bool x", payload),
        "/odd\x1b[2J": ("wstring x", payload),
        "/short": ("float64 x", payload),
        "/../../up": ("bool x", payload),
    }
    path = odd(tmp_path / "odd.mcap", topics)
    assert main(["log", "cat", str(path), "--json"]) == 0
    out, err = capsys.readouterr()
    assert [json.loads(line)["topic"] for line in out.splitlines()[:-1]] == ["/good", "/../../up"]
    assert set(json.loads(out.splitlines()[-1])["unreadable"]) == {"/odd\x1b[2J", "/short"}
    assert "\x1b" not in err
    assert main(["log", "info", str(path)]) == 0
    assert "\x1b" not in capsys.readouterr().out
    assert main(["log", "export", str(path), "--out", str(tmp_path / "out")]) == 0
    assert sorted(file.name for file in (tmp_path / "out").iterdir()) == [".._.._up.csv", "good.csv"]


def test_a_reader_that_goes_away_is_no_traceback(log):
    command = [sys.executable, "-m", "tools.cli"]
    text = "import sys; from tools.cli import main; sys.exit(main(sys.argv[1:]))"
    command = [sys.executable, "-c", text, "log", "cat", *[str(log)]]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    process.stdout.close()
    assert b"Traceback" not in process.stderr.read()
    process.stderr.close()
    process.wait(20)


def push_log(folder: Path) -> Path:
    done = finished(
        folder / "state", "run", "sim", "--fast", *QUICK, "--distance-m", "0.1", "--out", str(folder / "run")
    )
    assert done.code == 0, done.err
    return folder / "run"


def read_table(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_the_signals_are_one_tidy_table_with_names(tmp_path, capsys):
    run = push_log(tmp_path)
    assert main(["log", "export", str(run), "--signals", "--json"]) == 0
    told = last_json(capsys)
    assert told["out"] == str(run / "run_signals.csv")
    rows = read_table(run / "run_signals.csv")
    assert told["rows"] == len(rows) > 250
    assert list(rows[0])[:3] == ["time_s", "log_time_ns", "progress_m"]
    assert list(rows[0])[-4:] == ["phase", "mode", "contact", "fault"]
    assert [float(row["time_s"]) for row in rows[:3]] == [0.0, 0.01, 0.02]
    phases = list(dict.fromkeys(row["phase"] for row in rows))
    assert phases[:4] == ["settle", "tare", "approach", "push"]
    assert {row["contact"] for row in rows if row["phase"] == "push"} == {"touching"}
    assert {row["mode"] for row in rows if row["phase"] == "push"} == {"pushing"}
    assert rows[0]["theta_f_rad"] == "", "not known yet"
    assert "nan" not in (run / "run_signals.csv").read_text()
    assert main(["log", "export", str(run), "--signals"]) == 2
    assert "exists already" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["sim", "sim-format-2", "sim-format-3"])
def test_the_signals_of_an_earlier_format_are_derived_from_its_ticks(name, tmp_path, capsys):
    log = Path(__file__).resolve().parents[2] / "golden" / "logs" / f"{name}.mcap"
    assert main(["log", "export", str(log), "--signals", "--out", str(tmp_path / "s.csv"), "--json"]) == 0
    rows = read_table(tmp_path / "s.csv")
    assert 0.09 < max(float(row["speed_sent"]) for row in rows) <= 0.1 + 1e-6, "all push at 0.1 m/s"
    assert rows[-1]["phase"] == "done"


def test_the_signals_as_parquet(tmp_path, capsys):
    parquet = pytest.importorskip("pyarrow.parquet", reason="the extra `parquet` is not installed")
    run = push_log(tmp_path)
    for form in ("csv", "parquet"):
        assert main(["log", "export", str(run), "--signals", "--to", form]) == 0
    table = parquet.read_table(run / "run_signals.parquet").to_pylist()
    rows = read_table(run / "run_signals.csv")
    assert [row["phase"] for row in table] == [row["phase"] for row in rows]
    for got, row in zip(table, rows, strict=True):
        assert got["lateral_m"] == pytest.approx(float(row["lateral_m"]), rel=1e-6)


def test_parquet_without_its_package_says_how_to_get_it_and_leaves_nothing(tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    log = Path(__file__).resolve().parents[2] / "golden" / "logs" / "sim-format-3.mcap"
    assert main(["log", "export", str(log), "--signals", "--to", "parquet", "--out", str(tmp_path / "s")]) == 3
    assert "[parquet]" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("more", "word"), [
    (["--to", "parquet"], "--signals"), (["--to", "xlsx"], "xlsx"), (["--signals", "--topics", "/pose"], "--topics"),
    (["--signals"], "not the log of a push"),
])  # fmt: skip
def test_an_export_that_cannot_be_is_one_sentence(log, capsys, more, word):
    assert main(["log", "export", str(log), *more]) == 2
    told = capsys.readouterr().err
    assert word in told
    assert {path.name for path in log.parent.iterdir()} == {"run.mcap"}
