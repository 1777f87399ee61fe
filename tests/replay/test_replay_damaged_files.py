"""What is not a whole log of this program: one clear sentence, exit 8 or 2; what is left of a cut one still replays."""

from __future__ import annotations

import json
import random
import resource
import struct
import subprocess
import sys
from pathlib import Path

import pytest
from mcap.writer import CompressionType, Writer

from tests.how_many import mostly_long
from tests.replay.runs import PUSH, ROOT, changed, places, replayed, rewritten
from tools.cli import main

USAGE, DAMAGED = 2, 8


def sentence(capsys, path: Path) -> tuple[int, str]:
    """Return exit code and the one line for people."""
    capsys.readouterr()
    code = main(["replay", str(path)])
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert "Traceback" not in err
    return code, err


def foreign(profile: str, encoding: str, *, config: str | None) -> bytes:
    from io import BytesIO

    stream = BytesIO()
    writer = Writer(stream, compression=CompressionType.ZSTD, enable_crcs=True, enable_data_crcs=True)
    writer.start(profile, "another")
    schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data\n")
    channel = writer.register_channel("/chatter", encoding, schema)
    writer.add_message(channel, 1, b"\x00\x01\x00\x00\x01\x00\x00\x00\x00", 1)
    if config is not None:
        writer.add_attachment(0, 0, "config.toml", "application/toml", config.encode())
    writer.finish()
    return stream.getvalue()


NOT_OURS = {
    "empty": (b"", "not an MCAP"),
    "text": (b"hello, I am a log\n" * 100, "not an MCAP"),
    "random": (random.Random(1).randbytes(100_000), "not an MCAP"),
    "random behind the magic": (b"\x89MCAP0\r\n" + random.Random(2).randbytes(5000), "truncated"),
    "random within the magic": (b"\x89MCAP0\r\n" + random.Random(3).randbytes(5000) + b"\x89MCAP0\r\n", ""),
    "another profile": (foreign("ros1", "cdr", config=None), "contains no config.toml"),
    "another encoding": (foreign("ros2", "json", config=None), "contains no config.toml"),
    "no config": (foreign("ros2", "cdr", config=None), "contains no config.toml"),
    "no rig": (foreign("ros2", "cdr", config="x = 1\n"), "config.toml"),
    "no toml": (foreign("ros2", "cdr", config="]["), "config.toml"),
    "deep toml": (foreign("ros2", "cdr", config="a = " + "[" * 100_000), "config.toml"),
}


@pytest.mark.parametrize("name", NOT_OURS)
def test_what_is_no_log_of_ours_is_one_sentence(name, tmp_path, capsys):
    data, words = NOT_OURS[name]
    path = tmp_path / "run.mcap"
    path.write_bytes(data)
    code, err = sentence(capsys, path)
    assert code == DAMAGED
    assert words in err


def test_paths_without_a_log_are_usage(tmp_path, capsys):
    (tmp_path / "folder").mkdir()
    for path, words in (
        (tmp_path / "nothing.mcap", "No such file"),
        (tmp_path / "folder", "no run.mcap in this folder"),
    ):
        code, err = sentence(capsys, path)
        assert code == USAGE
        assert words in err


def test_any_flipped_byte_of_the_file_is_damage(sim_log, tmp_path, capsys):
    data = sim_log.read_bytes()
    chosen = random.Random(4).sample(range(len(data)), 12)
    for index in [0, 9, 20, *chosen, len(data) - 20, len(data) - 9, len(data) - 1]:
        path = tmp_path / "flipped.mcap"
        path.write_bytes(data[:index] + bytes((data[index] ^ 0x10,)) + data[index + 1 :])
        assert sentence(capsys, path)[0] == DAMAGED, index


@pytest.mark.long
def test_a_huge_length_anywhere_needs_no_memory(sim_log, tmp_path):
    """Lengths beyond the file and beyond the limit, and a chunk that unpacks to 300 MB, in 600 MB of address space."""
    data = sim_log.read_bytes()
    paths = []
    for n, length in enumerate((2**40, 2**62, len(data) * 1000, (64 << 20) + 1)):
        path = tmp_path / f"{n}.mcap"
        path.write_bytes(data[:9] + struct.pack("<Q", length) + data[17:])
        paths.append(path)
    bomb = tmp_path / "bomb.mcap"
    stream = bomb.open("wb")
    writer = Writer(stream, chunk_size=1 << 30, compression=CompressionType.ZSTD)
    writer.start("ros2", "another")
    schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data\n")
    channel = writer.register_channel("/chatter", "cdr", schema)
    writer.add_message(channel, 1, bytes(300 << 20), 1)
    writer.finish()
    stream.close()
    assert bomb.stat().st_size < 1 << 20
    for path in [*paths, bomb]:
        done = subprocess.run(
            [sys.executable, "-c", PUSH, "replay", str(path), "--json"],
            cwd=ROOT,
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (600 << 20, 600 << 20)),
        )
        assert done.returncode == DAMAGED, done.stderr
        assert json.loads(done.stdout)["error"]["code"] == DAMAGED


def test_a_cut_log_names_the_rescue_and_the_rescued_part_replays(sim_log, tmp_path, capsys):
    data = sim_log.read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(data[: len(data) * 2 // 3])
    code, err = sentence(capsys, cut)
    assert code == DAMAGED
    assert f"push log recover {cut}" in err
    saved = tmp_path / "saved.mcap"
    assert main(["log", "recover", str(cut), "--out", str(saved)]) == 0
    code, told = replayed(capsys, saved)
    whole = replayed(capsys, sim_log)[1]
    assert code == 0
    assert 0 < told["identical"] == told["ticks"] < whole["ticks"]
    assert 0 < told["world"]["identical"] == told["world"]["states"] < whole["world"]["states"]
    assert told["complete"] is False
    last = told["ticks"] - 1
    assert told["notes"] == [f"the log was recovered: it ends with tick {last}; everything after that is lost"]
    assert main(["replay", str(saved)]) == 0
    assert "note: the log was recovered" in capsys.readouterr().out


def test_a_log_cut_in_its_summary_only_is_complete_again(sim_log, tmp_path, capsys):
    cut, saved = tmp_path / "cut.mcap", tmp_path / "saved.mcap"
    cut.write_bytes(sim_log.read_bytes()[:-100])
    assert main(["log", "recover", str(cut), "--out", str(saved)]) == 0
    code, told = replayed(capsys, saved)
    assert (code, told["complete"], told["notes"]) == (0, True, [])


@pytest.mark.parametrize(
    "how",
    mostly_long(("changed", "last tick gone", "state gone", "seal gone", "limit changed"), "changed", "limit changed"),
)
def test_a_rescued_log_that_was_altered_later_does_not_pass(how, sim_log, tmp_path, capsys):
    cut, saved, out = (tmp_path / name for name in ("cut.mcap", "saved.mcap", "out.mcap"))
    data = sim_log.read_bytes()
    cut.write_bytes(data[: len(data) // 2])
    assert main(["log", "recover", str(cut), "--out", str(saved)]) == 0
    if how == "seal gone":
        rewritten(saved, out, metadata=lambda name, values: None if name == "recovered" else values)
    elif how == "limit changed":
        rewritten(saved, out, config=lambda text: text.replace("max_force_N = 150.0", "max_force_N = 149.0"))
    elif how == "changed":  # the last tick: no later one would tell
        rewritten(saved, out, changed("/control/tick", -1, lambda d: d[:-1] + bytes((d[-1] ^ 1,))))
    else:
        topic = "/control/tick" if how == "last tick gone" else "/world/state"
        rewritten(saved, out, lambda found: [one for i, one in enumerate(found) if i != places(found, topic)[-1]])
    assert replayed(capsys, out)[0] == DAMAGED
