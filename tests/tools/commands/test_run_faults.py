"""`push run --fault`: what a run with an injected fault does, says and logs, at levels sim and emulated."""

from __future__ import annotations

import json
import time

import pytest

from robot_io.log.messages import SAFETY_EVENT
from robot_io.mcap.read import read_log, read_summary
from tests.host_watch import repeated_when_the_host_stalls
from tests.push_runs import QUICK, SAFETY_STOP, blame_the_host, finished
from tests.replay.runs import push

SIM = ("run", "sim", "--fast", "--no-report", "--distance-m", "0.5", "--json", "--set", "ft.tare_s=1")
FROZEN = "ft.frozen at 5 s for 1 s"


def injected_events(log):
    events = [SAFETY_EVENT.decode(m.payload) for m in read_log(log) if m.topic == "/safety/event"]
    return [event.text for event in events if event.kind == "injected"]


def test_a_fault_at_level_sim_is_met_noted_and_replayed(tmp_path):
    done = push(*SIM, "--out", tmp_path / "run", "--fault", FROZEN, state=tmp_path)
    assert done.returncode == 5, done.stderr
    summary = json.loads(done.stdout.splitlines()[-1])
    assert summary["faults"] == ["F06"]
    assert 25 <= summary["injected"][FROZEN] <= 110
    log = tmp_path / "run/run.mcap"
    assert injected_events(log) == [f"injected: {FROZEN}"]
    assert read_summary(log).metadata["run"]["faults_injected"] == FROZEN
    replay = push("replay", log, "--json", state=tmp_path)
    assert replay.returncode == 0, replay.stdout
    result = json.loads(replay.stdout.splitlines()[-1])
    assert result["ticks"] == result["identical"] > 100


def test_several_faults_and_those_of_the_rig_count_together(tmp_path):
    words = ("arm.slow=60 at 1 s", "base.pose.slow=50 at 1 s")
    rig = ("--set", 'faults.inject=["base.odometry.slow=25 at 2 s"]')
    out = ("--out", tmp_path / "run")
    done = push(*SIM, *out, *rig, "--fault", words[0], "--fault", words[1], state=tmp_path)
    summary = json.loads(done.stdout.splitlines()[-1])
    assert set(summary["injected"]) == {"base.odometry.slow=25 at 2 s", *words}
    assert min(summary["injected"].values()) > 50
    assert sorted(injected_events(tmp_path / "run/run.mcap")) == sorted(f"injected: {w}" for w in summary["injected"])


@pytest.mark.parametrize("words", ["ft.frozen at 300 s", "base.status.frozen at 1 s"])
def test_a_fault_that_changed_nothing_is_an_error(tmp_path, words):
    done = push(*SIM, "--distance-m", "0.1", "--out", tmp_path / "run", "--fault", words, state=tmp_path)
    assert done.returncode == 2
    [error] = [line for line in done.stderr.splitlines() if line.startswith("push: ")]
    assert f"`{words}` changed nothing" in error
    assert json.loads(done.stdout.splitlines()[-1])["error"]["code"] == 2
    assert (tmp_path / "run/summary.json").exists(), "what came of the run is kept"


@pytest.mark.parametrize("words", ["ft.bogus at 3 s", "ft.frozen", "lidar.off at 1 s"])
def test_words_that_cannot_be_read_start_nothing(tmp_path, words):
    done = push(*SIM, "--out", tmp_path / "run", "--fault", words, state=tmp_path)
    assert done.returncode == 2
    assert not (tmp_path / "run").exists()


def test_no_fault_is_injected_where_a_device_is_real(tmp_path):
    real = ("--set", "base.level=hardware", "--set", "base.url=ws://127.0.0.1:9", "--move-robot", "--drive-blind")
    done = push("run", "emulated", *real, "--json", "--fault", "ft.off at 1 s", state=tmp_path)
    assert done.returncode == 2
    error = json.loads(done.stdout.splitlines()[-1])["error"]
    assert "no fault is injected where a device is real" in error["what"]
    assert "base is at level hardware" in error["what"]


@pytest.mark.long
@pytest.mark.parametrize(
    ("words", "fault"),
    [
        (FROZEN, "F06"),
        ("base.pose.off at 5 s", "F40-stop"),
        ("arm.protective-stop at 5 s", "F22"),
    ],
)
@repeated_when_the_host_stalls
def test_the_same_words_at_level_emulated(tmp_path, host, words, fault):
    """The real drivers run; the sensor and the arm are met in control's process, the base in the gate's."""
    argv = ("run", "emulated", *QUICK, "--out", str(tmp_path / "run"), "--fault", words, "--json")
    began_ns = time.monotonic_ns()
    ended = finished(tmp_path / "state", *argv)
    if fault not in ended.err or ended.last_object.get("faults") != [fault]:
        blame_the_host(host, began_ns, SAFETY_STOP, ended.err)  # it may have stopped the run before the fault
    assert ended.code == 5, ended.err
    assert ended.last_object["faults"] == [fault]
    assert ended.last_object["injected"][words] > 5
    assert injected_events(tmp_path / "run/run.mcap") == [f"injected: {words}"]
    replay = push("replay", tmp_path / "run", "--json", state=tmp_path)
    assert replay.returncode == 0, replay.stdout
