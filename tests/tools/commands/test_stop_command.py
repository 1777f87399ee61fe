"""`push stop`: runs under way, whatever of them is frozen; a base without a run; nothing at all."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time

import msgspec
import pytest

from robot_io.messages import BodyTwist
from tests.forked_push import forked
from tests.host_watch import repeated_when_the_host_stalls
from tests.push_runs import QUICK, finished, one_error, stands, started, world_of
from tests.wire.bridge_process import running_bridge, until
from tools.places import running
from tools.places.running import Process, RunningRun, running_runs, start_time

STOP, CONT = signal.SIGSTOP, signal.SIGCONT


def running_folder(state):
    return list((state / "single-point-push" / "running").iterdir())


def emulated(folder, *more):
    return "run", "emulated", *QUICK, "--distance-m", "3", "--out", str(folder), "--json", *more


@repeated_when_the_host_stalls
@pytest.mark.parametrize("asked", [(), pytest.param(("emulated",), marks=pytest.mark.long)])
def test_a_run_under_way_is_stopped(state, tmp_path, host, asked):
    with started(state, *emulated(tmp_path / "run"), host=host) as run:
        run.wait_for("PUSH ")
        stop = finished(state, "stop", *asked, "--json")
        ended = run.wait(10.0)
        run.wait_gone(3.0)
    assert stop.code == 0, stop.err
    assert stop.last_object == {"schema": 1, "stopped": ["emulated"], "zeros_sent": False, "at_rest": True}
    assert ended.code == 130, ended.err
    assert stands(world_of(tmp_path / "run" / "run.mcap")[1][-1][1])


@pytest.mark.long
def test_a_simulated_run_is_stopped_too(state, tmp_path):
    with started(state, "run", "sim", *QUICK, "--distance-m", "3", "--out", str(tmp_path / "run")) as run:
        run.wait_for("PUSH ")
        assert finished(state, "stop", "--json").last_object["stopped"] == ["sim"]
        assert run.wait(10.0).code == 130
        assert running_folder(state) == []


@pytest.mark.long
@repeated_when_the_host_stalls
def test_a_run_of_another_rig_goes_on(state, tmp_path, host):
    with started(state, *emulated(tmp_path / "run"), host=host) as run:
        run.wait_for("PUSH ")
        stop = finished(state, "stop", "barrel", "--set", "base.level=emulated", "--json")
        assert stop.last_object["stopped"] == []
        time.sleep(0.5)
        if run.process.poll() is not None:
            run.wait()  # raises where the host stopped it
        assert run.process.poll() is None
        run.signal(signal.SIGTERM)
        run.wait(10.0)


@pytest.mark.long
@pytest.mark.parametrize("frozen", ["launcher", "control"])
@repeated_when_the_host_stalls
def test_a_frozen_process_does_not_keep_it_from_stopping(state, tmp_path, host, frozen):
    with started(state, *emulated(tmp_path / "run"), host=host) as run:
        run.wait_for("PUSH ")
        pids = json.loads((tmp_path / "run" / "processes.json").read_text())
        os.kill(pids[frozen], STOP)
        stop = finished(state, "stop")
        if frozen == "launcher":
            run.signal(CONT)
        run.wait(10.0)
        run.wait_gone(3.0)
    assert stop.code == 0, stop.err
    assert stands(world_of(tmp_path / "run" / "run.mcap")[1][-1][1])


def of_base(url):
    return "stop", "emulated", "--set", "base.level=hardware", "--set", f"base.url={url}"


def test_a_base_without_a_run_is_sent_zeros_and_its_address_is_said(state):
    with running_bridge() as bridge:
        stop = forked(state, *of_base(bridge.url), "--json")
        heard = bridge.heard()
    assert stop.code == 0, stop.err
    assert f"connecting to {bridge.url} and sending zeros" in stop.err
    assert stop.last_object["zeros_sent"] is True
    assert len(heard) > 10
    assert {entry[1:] for entry in heard} == {(0.0, 0.0, 0.0)}


@pytest.mark.long
def test_a_base_that_moves_on_is_not_called_at_rest(state):
    with running_bridge() as bridge:
        bridge.do("joystick", BodyTwist(0.1, 0.0, 0.0), 30.0)
        assert until(lambda: abs(bridge.report()["velocity"][0]) > 0.05)
        error = one_error(finished(state, *of_base(bridge.url), "--json"), 4)
    assert "still shows motion" in error["what"]


def test_a_base_that_nobody_answers_for(state):
    error = one_error(forked(state, *of_base("ws://127.0.0.1:1"), "--json"), 4)
    assert error["where"] == "ws://127.0.0.1:1"


@pytest.mark.parametrize("asked", [(), ("emulated",), ("sim",)])
def test_nothing_to_stop(state, asked):
    stop = forked(state, "stop", *asked, "--json")
    assert stop.code == 0, stop.err
    assert stop.last_object["stopped"] == []
    assert "no run is under way" in stop.err


def test_a_process_id_that_is_another_processs_now_is_left_alone(tmp_path, monkeypatch):
    """Ids are used again: only one that also started then is the run's."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as other:
        began = start_time(other.pid)
        assert began is not None
        Process(other.pid, began - 1).signal(signal.SIGKILL)
        assert not Process(other.pid, began - 1).alive()
        assert Process(other.pid, began).alive()
        folder = running._folder()
        folder.mkdir(parents=True)
        for name, wrong in (("1", 1), ("2", 0)):
            run = RunningRun("a rig", (), {"control": Process(other.pid, began - wrong)})
            (folder / f"{name}.json").write_bytes(msgspec.json.encode(run))
        assert running_runs() == [RunningRun("a rig", (), {"control": Process(other.pid, began)})]
        assert [path.name for path in folder.iterdir()] == ["2.json"]
        Process(other.pid, began).signal(signal.SIGKILL)
        assert other.wait(5) == -signal.SIGKILL
        assert start_time(other.pid) is None
