"""`push log zip`: what others get names no machine and nobody, and every log in it still replays."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path

import pytest

from robot_io.log.channels import CHANNELS, Kind
from robot_io.log.gate_log import GateLog
from robot_io.mcap.read import read_log, read_summary
from tests.push_runs import finished
from tests.replay.runs import changed, replayed, resealed, rewritten
from tools.cli import main
from tools.commands import log_zip
from tools.log.run_log import RunLog
from tools.log.scrub import Scrub

URL, HOST = "ws://cpr-r100-0042.lab.example.org:9090", "192.168.131.40"
PORT = "/dev/serial/by-id/usb-FTDI_DA76PHUW-if00-port0"
SECRETS = (
    b"cpr-r100-0042",
    b"lab.example.org",
    b"192.168.131",
    b"10.20.30.40",
    b"DA76PHUW",
    b"annabel",
    b"workstation7",
)
WORDS = "annabel@lab.example.org lost 10.20.30.40, log in /home/annabel/runs of workstation7"
QUICK = ("--no-report", "--set", "ft.tare_s=0.5", "--set", "control.retreat_m=0.02", "--distance-m", "0.05")


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    """A run whose rig names a robot, and whose gate and facts name people and machines."""
    folder = tmp_path_factory.mktemp("zip")
    addresses = ("--set", f"arm.host={HOST}", "--set", f"base.url={URL}", "--set", f"ft.port={PORT}")
    made = folder / "made"
    done = finished(folder / "state", "run", "sim", "--fast", *QUICK, *addresses, "--out", str(made))
    assert done.code == 0, done.err
    out = folder / "all" / "annabel"
    out.mkdir(parents=True)
    summary = read_summary(made / "run.mcap")
    facts = {**summary.metadata["run"], "machine_name": "workstation7"}
    offset_ns = int(facts["wall_offset_ns"])
    kinds = {channel.topic: kind for kind, channel in CHANNELS.items() if kind not in (Kind.SAFETY_EVENT, Kind.ROSOUT)}
    log = RunLog(
        out / "run.mcap", config_text=(made / "config.toml").read_text(), metadata=facts, wall_offset_ns=offset_ns
    )
    for message in read_log(made / "run.mcap"):
        if message.topic in kinds:
            log.record(kinds[message.topic], message.log_time_ns - offset_ns, message.payload)
    GateLog(log.record, offset_ns).latched(9_000_000_000, 1, 2, 11, WORDS, "F30")
    log.finish({"remark": WORDS})
    (out / "config.toml").write_bytes((made / "config.toml").read_bytes())
    (out / "summary.json").write_text(json.dumps({"log": str(out / "run.mcap"), "note": WORDS}))
    (out / "processes.json").write_text("{}")
    (out / "film.gif").write_bytes(b"GIF89a")
    return out


@pytest.fixture
def named(monkeypatch):
    monkeypatch.setattr(log_zip.getpass, "getuser", lambda: "annabel")
    monkeypatch.setattr(log_zip.platform, "node", lambda: "workstation7.lab.example.org")


def test_no_address_and_no_name_is_left_and_the_log_replays(run, named, tmp_path, capsys):
    out = tmp_path / "artifact.zip"
    assert main(["log", "zip", str(run.parent), "--out", str(out), "--json"]) == 0
    told = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert told["left_out"] == ["all/somebody/film.gif", "all/somebody/processes.json"]
    assert {"hosts", "ports", "names", "home folders", "mail addresses"} <= set(told["removed"])
    with zipfile.ZipFile(out) as packed:
        packed.extractall(tmp_path / "got")
        names = packed.namelist()
    assert set(names) == {f"all/somebody/{name}" for name in ("run.mcap", "config.toml", "summary.json")} | {
        "all/README.txt"
    }
    log = tmp_path / "got" / "all" / "somebody" / "run.mcap"
    texts = [path.read_bytes() for path in (tmp_path / "got").rglob("*") if path.is_file() and path != log]
    summary = read_summary(log)
    payloads = b"".join(message.payload for message in read_log(log))
    inside = repr((summary.metadata, summary.attachments)).encode()
    for secret in SECRETS:
        assert not any(secret in text for text in (*texts, payloads, inside)), secret
    code, found = replayed(capsys, log)
    assert (code, found["identical"], found["notes"]) == (0, found["ticks"], [])
    assert found["derived"]["identical"] == found["derived"]["messages"] > 1000
    readme = (tmp_path / "got" / "all" / "README.txt").read_text()
    assert "hosts:" in readme
    assert "film.gif" in readme


def test_the_same_runs_give_the_same_bytes(run, named, tmp_path, capsys):
    for name in ("a", "b"):
        assert main(["log", "zip", str(run), "--out", str(tmp_path / name)]) == 0
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_a_log_that_was_altered_is_not_sealed_again(run, tmp_path, capsys):
    def flip(data: bytes) -> bytes:
        return data[:-9] + bytes((data[-9] ^ 1,)) + data[-8:]

    folder = tmp_path / "altered"
    folder.mkdir()
    rewritten(run / "run.mcap", folder / "run.mcap", changed("/base/pose", 3, flip))
    assert main(["log", "zip", str(folder), "--json"]) == 8
    assert not folder.with_suffix(".zip").exists()
    (folder / "run.mcap").unlink()
    resealed(run / "run.mcap", folder / "run.mcap", lambda messages: messages, config=lambda text: f"{text}\n# more\n")
    assert main(["log", "zip", str(folder), "--json"]) == 8


def test_mistakes_are_one_sentence(run, tmp_path, capsys):
    (tmp_path / "empty").mkdir()
    (tmp_path / "there.zip").touch()
    for argv in ([tmp_path / "empty"], [run / "run.mcap"], [run, "--out", tmp_path / "there.zip"]):
        assert main(["log", "zip", *map(str, argv)]) == 2
    assert not (tmp_path / "empty.zip").exists()


@pytest.mark.parametrize(("text", "expected"), [
    ("ws://127.0.0.1:9090 and localhost, [::1], 0.0.0.0", "ws://127.0.0.1:9090 and localhost, [::1], 0.0.0.0"),
    ("mcap = 1.6.0, version 3.15.8.106339", "mcap = 1.6.0, version 3.15.8.106339"),
    ("k = 10.0.0.12 at [fe80::12]", "k = 0.0.0.0 at [::]"),
    ("/home/annabel/x /Users/bob:1 /root/y", "/home/user/x /home/user:1 /home/user/y"),
    ("annabel annabella Annabel's", "somebody annabella Annabel's"),
    ("a robot and its base, in the lab", "a robot and its base, in the lab"),
    ("data:image/png;base64,annabel/annabel= annabel", "data:image/png;base64,annabel/annabel= somebody"),
])  # fmt: skip
def test_what_is_an_address_and_what_is_none(text, expected):
    assert Scrub(("annabel", "robot", "lab", "", "ab"), "").text(text) == expected
