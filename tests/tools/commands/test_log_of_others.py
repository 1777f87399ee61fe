"""`push log` as a user runs it on files that other programs wrote, and on pipes."""

from __future__ import annotations

import json
import os
import struct
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from tests.how_many import mostly_long
from tests.robot_io.mcap import mcap_by_hand as by_hand
from tools.cli import main

HELLO = by_hand.HELLO
OPENING = by_hand.header() + by_hand.schema() + by_hand.channel()
WORD = struct.pack("<I", 2) + b"\x68\x00\x00\x00\x69\x00\x00\x00"


def save(tmp_path: Path, *records: bytes, name: str = "x.mcap") -> Path:
    path = tmp_path / name
    path.write_bytes(by_hand.file(*records))
    return path


def messages(out: str) -> list:
    return [json.loads(line)["message"] for line in out.splitlines()]


@pytest.mark.parametrize(
    ("text", "payload", "value"),
    [
        ("string data", HELLO + b"\x00\x00", {"data": "hello"}),
        ("char letter", b"\x00\x01\x00\x00\x41", {"letter": 65}),
        ("wstring word", b"\x00\x01\x00\x00" + WORD, {"word": "hi"}),
        ("float64 x", b"\x00\x00\x00\x00" + struct.pack(">d", 1.5), {"x": 1.5}),
    ],
    ids=["padding", "char", "wstring", "big-endian"],
)
def test_cat_and_export_read_what_middleware_writes(tmp_path, capsys, text, payload, value):
    path = save(tmp_path, by_hand.header(), by_hand.schema(data=text), by_hand.channel(), by_hand.message(1, payload))
    assert main(["log", "cat", str(path)]) == 0
    assert messages(capsys.readouterr().out) == [value]
    assert main(["log", "export", str(path), "--out", str(tmp_path / "out")]) == 0
    head, row = (tmp_path / "out" / "t.csv").read_text().splitlines()
    assert head == f"log_time [ns],time [s],{next(iter(value))}"
    assert row == f"5,0.0,{next(iter(value.values()))}"


UNREADABLE = {
    "/json": (by_hand.channel(2, 0, "/json", "json"), b"{}", "its messages are in json; only cdr"),
    "/ros1": (by_hand.channel(3, 1, "/ros1", "ros1"), b"", "its messages are in ros1; only cdr"),
    "/protobuf": (by_hand.channel(4, 1, "/protobuf", "protobuf"), b"", "its messages are in protobuf; only cdr"),
    "/bare": (by_hand.channel(5, 0, "/bare"), HELLO, "it has no schema"),
    "/xcdr2": (by_hand.channel(6, 1, "/xcdr2"), b"\x00\x07" + HELLO[2:], "CDR of version 2"),
    "/short": (by_hand.channel(7, 1, "/short"), HELLO[:9], "elements cannot fit"),
}


@pytest.fixture
def mixed(tmp_path) -> Path:
    records = [OPENING, by_hand.message()]
    for channel, payload, _ in UNREADABLE.values():
        number = int.from_bytes(channel[9:11], "little")
        records += [channel, by_hand.message(number, payload)]
    return save(tmp_path, *records, by_hand.message())


def test_topics_that_cannot_be_read_are_named_with_the_reason_and_the_rest_is_read(mixed, tmp_path, capsys):
    assert main(["log", "cat", str(mixed), "--json"]) == 0
    out, err = capsys.readouterr()
    assert messages("\n".join(out.splitlines()[:-1])) == [{"data": "hello"}] * 2
    done = json.loads(out.splitlines()[-1])
    assert set(done["unreadable"]) == set(UNREADABLE)
    for topic, (_, _, why) in UNREADABLE.items():
        assert why in done["unreadable"][topic]
        assert f"{topic} left out: {done['unreadable'][topic]}" in err.splitlines()
    assert main(["log", "export", str(mixed), "--out", str(tmp_path / "out")]) == 0
    assert [file.name for file in (tmp_path / "out").iterdir()] == ["t.csv"]
    assert main(["log", "info", str(mixed)]) == 0
    out = capsys.readouterr().out
    assert "8 messages, intact" in out
    assert "/json cannot be read: its messages are in json" in out


@pytest.mark.parametrize("topic", UNREADABLE)
@pytest.mark.parametrize("action", ["cat", "export"])
def test_an_unreadable_topic_asked_for_by_name_is_exit_8_with_the_reason(mixed, tmp_path, capsys, topic, action):
    out = ["--out", str(tmp_path / "out")] if action == "export" else []
    assert main(["log", action, str(mixed), "--topics", "/t", topic, "--json", *out]) == 8
    error = json.loads(capsys.readouterr().out.splitlines()[-1])["error"]
    assert error["what"].startswith(f"{topic} cannot be read: ")
    assert UNREADABLE[topic][2] in error["what"]
    assert error["where"] == str(mixed)


def test_a_file_of_which_nothing_can_be_read_is_exit_8(tmp_path, capsys):
    channel, payload, why = UNREADABLE["/json"]
    path = save(tmp_path, by_hand.header(profile=""), channel, by_hand.message(2, payload))
    assert main(["log", "cat", str(path)]) == 8
    assert why in capsys.readouterr().err
    assert main(["log", "info", str(path)]) == 0


def test_two_types_of_one_topic_are_both_read_each_into_its_own_table(tmp_path, capsys):
    other = by_hand.schema(2, "std_msgs/msg/Bool", "bool data") + by_hand.channel(2, 2)
    path = save(tmp_path, OPENING, other, by_hand.message(2, b"\x00\x01\x00\x00\x01"), by_hand.message())
    assert main(["log", "cat", str(path)]) == 0
    assert messages(capsys.readouterr().out) == [{"data": True}, {"data": "hello"}]
    assert main(["log", "export", str(path), "--out", str(tmp_path / "out")]) == 0
    tables = {file.name: file.read_text().splitlines()[1] for file in (tmp_path / "out").iterdir()}
    assert tables == {"t.csv": "5,0.0,True", "t.std_msgs_msg_String.csv": "5,0.0,hello"}


def push(*words: object, stdin: bytes) -> subprocess.CompletedProcess[bytes]:
    program = "import sys; from tools.cli import main; sys.exit(main(sys.argv[1:]))"
    command = [sys.executable, "-c", program, "log", *[str(word) for word in words]]
    return subprocess.run(command, input=stdin, capture_output=True, timeout=60, check=False)


@pytest.mark.parametrize("name", mostly_long(("-", "/dev/stdin"), "-"))
def test_a_pipe_is_read_like_a_file(tmp_path, name):
    raw = by_hand.file(OPENING, by_hand.message())
    done = push("cat", name, stdin=raw)
    assert (done.returncode, messages(done.stdout.decode())) == (0, [{"data": "hello"}])
    done = push("info", name, "--json", stdin=raw)
    assert (json.loads(done.stdout)["log"], json.loads(done.stdout)["messages"]) == ("/dev/stdin", 1)
    assert push("export", name, stdin=raw).returncode == 2
    assert push("export", name, "--out", tmp_path / "out", stdin=raw).returncode == 0
    assert (tmp_path / "out" / "t.csv").exists()


def test_a_truncated_pipe_is_told_and_recovered_by_the_name_the_user_gave(tmp_path):
    raw = by_hand.MAGIC + OPENING + by_hand.message()
    done = push("info", "-", stdin=raw)
    assert done.returncode == 8
    assert b"/dev/stdin: the log is truncated" in done.stderr
    assert b"push log recover /dev/stdin" in done.stderr
    assert b"push-log-" not in done.stderr, "no name of a temporary file"
    assert push("recover", "-", "--out", tmp_path / "out.mcap", stdin=raw).returncode == 0
    assert b"1 messages" in push("info", tmp_path / "out.mcap", stdin=b"").stdout


def test_what_comes_out_of_a_pipe_and_is_no_log_is_refused_without_waiting_for_its_end():
    done = push("info", "/dev/zero", stdin=b"")
    assert done.returncode == 8
    assert b"/dev/zero: this is not an MCAP file. " in done.stderr
    assert b"it is empty" in push("info", "-", stdin=b"").stderr


def test_a_named_pipe_is_read(tmp_path, capsys):
    fifo = tmp_path / "log.fifo"
    os.mkfifo(fifo)
    writer = threading.Thread(target=fifo.write_bytes, args=(by_hand.file(OPENING, by_hand.message()),))
    writer.start()
    assert main(["log", "cat", str(fifo)]) == 0
    writer.join(10)
    assert messages(capsys.readouterr().out) == [{"data": "hello"}]


@pytest.mark.parametrize("command", ["replay", "report"])
def test_replay_and_report_say_that_it_is_no_log_of_a_push(tmp_path, capsys, command):
    path = save(tmp_path, OPENING, by_hand.message())
    assert main([command, str(path)]) == 8
    told = capsys.readouterr().err
    assert "damaged" not in told
    assert "this is not the log of a push" in told
