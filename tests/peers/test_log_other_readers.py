"""Readers nobody here wrote open our logs: npm's @mcap/core, Rerun and pybag, installed into a temporary directory.

A reader that cannot be installed (no npm, no package index) is skipped with what the installer said.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from robot_io.log.channels import Kind
from robot_io.log.recovery import recover
from robot_io.mcap.read import LogSummary, read_summary
from robot_io.messages import ArmRecord, BaseRecord, BodyTwist, Pose2D, WorldTwist
from robot_io.rig.config import load_rig, rig_to_toml
from robot_io.tick import (
    TICK_CDR,
    ControlTick,
    FtInput,
    FtReading,
    HostInput,
    TickInput,
    TickOutput,
    TickState,
)
from tools.log.run_log import RunLog

pytestmark = [pytest.mark.long, pytest.mark.timeout(600)]
TICKS = 1000
ROOT = Path(__file__).resolve().parents[2]

NODE_READER = """
import { readFileSync } from "node:fs";
import { McapIndexedReader } from "@mcap/core";
import { loadDecompressHandlers } from "@mcap/support";
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
const data = readFileSync(process.argv[2]);
const readable = {
  size: async () => BigInt(data.length),
  read: async (at, n) => new Uint8Array(data.buffer, data.byteOffset + Number(at), Number(n)),
};
const decompressHandlers = await loadDecompressHandlers();
const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
const decoders = new Map(), counts = {};
let force = 0, tick = 0;
for await (const message of reader.readMessages({ validateCrcs: true })) {
  const channel = reader.channelsById.get(message.channelId);
  if (!decoders.has(channel.id)) {
    const text = new TextDecoder().decode(reader.schemasById.get(channel.schemaId).data);
    decoders.set(channel.id, new MessageReader(parse(text, { ros2: true })));
  }
  const value = decoders.get(channel.id).readMessage(message.data);
  counts[channel.topic] = (counts[channel.topic] ?? 0) + 1;
  if (channel.topic === "/ft/wrench_raw") force += value.wrench.force.x;
  if (channel.topic === "/control/tick") tick += Number(value.input.tick);
}
console.log(JSON.stringify({ counts, force, tick }));
"""


@pytest.fixture(scope="module")
def log(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("log") / "run.mcap"
    config = rig_to_toml(load_rig("emulated"))
    log = RunLog(path, config_text=config, metadata={"seed": "1"}, wall_offset_ns=1_600_000_000 * 10**9)
    for n in range(TICKS):
        now_ns = n * 10_000_000
        reading = FtReading(now_ns, n, (n * 0.25, 1.0, -2.0), (0.1, 0.2, 0.3))
        inp = TickInput(
            n,
            now_ns,
            0,
            HostInput(90_000, 0, True, True, True, False, 0),
            FtInput((reading,), 2, n, 0, 0),
            ArmRecord(packets=n + 1, changed_ns=now_ns, link=2),
            BaseRecord(pose=Pose2D(n * 0.001, 0.0, 0.0), pose_valid=True, pose_seq=n + 1, pose_received_ns=now_ns),
        )
        faults = ("F60-late",) if n % 100 == 50 else ()
        out = TickOutput(2, faults, WorldTwist(), BodyTwist(), BodyTwist(0.1, 0.0, 0.0), 0.0, 0.0, False, 0)
        log.record(Kind.CONTROL_TICK, now_ns, TICK_CDR.encode(ControlTick(0, 0, inp, (TickState(),), TickState(), out)))
        if n % 25 == 24:
            log.flush()
    log.finish({})
    return path


@pytest.fixture(scope="module")
def cut(log) -> Path:
    path = log.with_name("cut.mcap")
    path.write_bytes(log.read_bytes()[: log.stat().st_size // 2])
    return path


def counts_of(summary: LogSummary) -> dict[str, int]:
    return {channel.topic: channel.messages for channel in summary.channels}


def run(*command: object, cwd: Path) -> str:
    """Run a foreign program; its own settings and caches stay in `cwd`."""
    done = subprocess.run(
        [str(part) for part in command],
        cwd=cwd,
        env={**os.environ, "HOME": str(cwd), "NO_COLOR": "1"},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, f"{command}: {done.stdout}{done.stderr}"
    return done.stdout + done.stderr


def install(*command: object, cwd: Path) -> None:
    done = subprocess.run(
        [str(part) for part in command], cwd=cwd, capture_output=True, text=True, timeout=300, check=False
    )
    if done.returncode:
        pytest.skip(f"cannot be installed here: {(done.stderr or done.stdout).strip().splitlines()[-1]}")


@pytest.fixture(scope="module")
def python_reader(tmp_path_factory):
    """Return a function that installs a package into one environment and returns its program."""
    home = tmp_path_factory.mktemp("readers")
    install(sys.executable, "-m", "venv", home / "venv", cwd=home)

    def get(package: str, program: str) -> Path:
        install(home / "venv" / "bin" / "python", "-m", "pip", "install", "-q", package, cwd=home)
        return home / "venv" / "bin" / program

    return get


def test_mcap_core_reads_every_message_and_the_same_values(log, tmp_path):
    if shutil.which("npm") is None or shutil.which("node") is None:
        pytest.skip("npm and node are not installed")
    packages = ("@mcap/core", "@mcap/support", "@foxglove/rosmsg", "@foxglove/rosmsg2-serialization")
    install("npm", "install", "--no-audit", "--no-fund", "--prefix", tmp_path, *packages, cwd=tmp_path)
    (tmp_path / "read.mjs").write_text(NODE_READER)
    seen = json.loads(run("node", "read.mjs", log, cwd=tmp_path).splitlines()[-1])
    assert seen["counts"] == counts_of(read_summary(log))
    assert seen["force"] == sum(n * 0.25 for n in range(TICKS))
    assert seen["tick"] == sum(range(TICKS))


def test_rerun_checks_converts_and_recovers(log, cut, python_reader, tmp_path):
    rerun = python_reader("rerun-sdk", "rerun")
    run(rerun, "analytics", "disable", cwd=tmp_path)
    summary = read_summary(log)
    checked = run(rerun, "mcap", "check", "--full", log, cwd=tmp_path)
    for topic in counts_of(summary):
        assert re.search(rf"^ok\s+\d+\s+\d+\s+{topic}\s", checked, re.MULTILINE), checked
    told = run(rerun, "mcap", "info", log, cwd=tmp_path)
    assert int(re.search(r"Messages\s+(\d+)", told)[1]) == summary.messages
    for topic, count in counts_of(summary).items():
        assert re.search(rf"{topic}\s+{count}\s", told), told
    run(rerun, "mcap", "convert", log, "-o", tmp_path / "run.rrd", cwd=tmp_path)
    assert "verified without error" in run(rerun, "rrd", "verify", tmp_path / "run.rrd", cwd=tmp_path)
    told = run(rerun, "mcap", "info", "--recover", cut, cwd=tmp_path)
    saved = recover(cut, tmp_path / "ours.mcap")
    assert int(re.search(r"Messages\s+(\d+)", told)[1]) == saved.messages


def test_rerun_takes_our_blueprint_and_makes_it_again(python_reader, tmp_path, monkeypatch):
    rerun = python_reader("rerun-sdk==0.41.0", "rerun")
    run(rerun, "analytics", "disable", cwd=tmp_path)
    shipped, again = ROOT / "tools/view/push.rbl", tmp_path / "push.rbl"
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    run(rerun.with_name("python"), "-m", "tools.dev.rerun_blueprint", again, cwd=tmp_path)
    assert (tmp_path / "push.rbl.txt").read_text() == (ROOT / "tools/view/push.rbl.txt").read_text()
    for blueprint in (shipped, again):
        assert "verified without error" in run(rerun, "rrd", "verify", blueprint, cwd=tmp_path)


def test_pybag_reads_and_recovers_as_many_messages_as_we_do(log, cut, python_reader, tmp_path):
    pybag = python_reader("pybag-sdk", "pybag")
    assert messages_of(run(pybag, "info", log, cwd=tmp_path)) == read_summary(log).messages
    run(pybag, "recover", cut, "-o", tmp_path / "theirs.mcap", cwd=tmp_path)
    saved = recover(cut, tmp_path / "ours.mcap")
    assert 0 < saved.messages < read_summary(log).messages
    assert messages_of(run(pybag, "info", tmp_path / "theirs.mcap", cwd=tmp_path)) == saved.messages
    assert messages_of(run(pybag, "info", tmp_path / "ours.mcap", cwd=tmp_path)) == saved.messages


def messages_of(text: str) -> int:
    return int(re.search(r"Messages:\s+([\d,]+)", text)[1].replace(",", ""))
