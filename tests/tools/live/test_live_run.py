"""`push run --live` and `push watch --live`: viewers see the run, and the run does not depend on them."""

import json
import os
import signal

import pytest

from tests.host_watch import repeated_when_the_host_stalls
from tests.push_runs import QUICK, finished, one_error, started
from tests.tools.live.viewer import Viewer, free_port
from tests.wire.ur_process import wait_until


@pytest.mark.long
def test_a_viewer_sees_a_simulated_run_whose_log_is_the_same_without_it(state, tmp_path):
    port = free_port()
    argv = ("run", "sim", "--distance-m", "0.1", *QUICK, "--out")
    with started(state, *argv, str(tmp_path / "seen"), "--live", "--live-port", str(port)) as run:
        with Viewer(port) as viewer:
            viewer.subscribe("/control/tick")
            viewer.subscribe("/robot_description")
            found = {}
            while len(found) < 2:
                topic, _, value = viewer.message()
                found[topic] = value
        assert found["/control/tick"].output.mode in range(7)
        assert "<robot" in found["/robot_description"].data
        ended = run.wait()
        run.wait_gone(3.0)
    assert ended.code == 0
    assert f"live view: ws://127.0.0.1:{port}" in ended.err
    assert finished(state, *argv, str(tmp_path / "unseen"), "--fast").code == 0
    assert (tmp_path / "seen/run.mcap").read_bytes() == (tmp_path / "unseen/run.mcap").read_bytes()


@pytest.mark.long
def test_a_run_goes_on_when_its_live_view_is_killed_or_not_read(state, host, tmp_path):
    @repeated_when_the_host_stalls
    def attempt(tmp_path):
        port, out = free_port(), tmp_path / "out"
        argv = ("run", "emulated", "--distance-m", "0.5", "--out", str(out), *QUICK, "--live", "--live-port", str(port))
        with started(state, *argv, host=host) as run, Viewer(port) as viewer:
            viewer.subscribe("/control/tick")  # and never reads
            run.wait_for("PUSH ")
            [live] = [pid for pid, command in run.alive().items() if "tools.live.server" in command]
            os.kill(live, signal.SIGKILL)
            run.wait_for("the live view has ended; the run goes on")
            ended = run.wait()
        assert ended.code == 0, ended.err
        summary = json.loads((out / "summary.json").read_text())
        assert any("the live process was killed by SIGKILL" in note for note in summary["notes"])
        missed = [note for note in summary["notes"] if "the live view missed" in note]
        assert int(missed[0].split()[4]) > 1000, "all that was recorded afterwards"
        assert finished(state, "replay", str(out)).code == 0

    attempt(tmp_path=tmp_path)


@pytest.mark.long
def test_a_frozen_live_view_costs_messages_and_nothing_else(state, host, tmp_path):
    @repeated_when_the_host_stalls
    def attempt(tmp_path):
        port, out = free_port(), tmp_path / "out"
        argv = ("run", "emulated", "--distance-m", "0.5", "--out", str(out), *QUICK, "--live", "--live-port", str(port))
        with started(state, *argv, host=host) as run:
            run.wait_for("APPROACH|PUSH ")
            [live] = [pid for pid, command in run.alive().items() if "tools.live.server" in command]
            os.kill(live, signal.SIGSTOP)
            ended = run.wait()
            run.wait_gone(3.0)
        assert ended.code == 0, ended.err
        notes = json.loads((out / "summary.json").read_text())["notes"]
        assert any("the live view missed" in note for note in notes), notes
        assert not any("ring buffers" in note or "not complete" in note for note in notes), notes

    attempt(tmp_path=tmp_path)


@pytest.mark.long
def test_watch_serves_the_devices_that_it_has_opened(state):
    port = free_port()
    with started(state, "watch", "emulated", "--live", "--live-port", str(port)) as watch:
        topics = ("/ft/wrench_raw", "/ft/wrench", "/arm/joint_states", "/base/pose", "/base/odom", "/tf", "/tf_static")
        with Viewer(port) as viewer:
            for topic in topics:
                viewer.subscribe(topic)
            found = {}
            while set(found) != set(topics):
                topic, _, value = viewer.message()
                found[topic] = value
        assert found["/arm/joint_states"].position[0] == pytest.approx(1.5708, abs=0.01)
        watch.signal(signal.SIGINT)
        assert watch.wait().code == 0
        watch.wait_gone(3.0)


@pytest.mark.long
def test_watch_serves_the_run_that_it_follows(state, tmp_path):
    port = free_port()
    with started(state, "run", "sim", "--distance-m", "0.6", "--out", str(tmp_path / "out"), *QUICK) as run:
        run.wait_for("APPROACH|PUSH ")
        with started(state, "watch", "sim", "--live", "--live-port", str(port)) as watch, Viewer(port) as viewer:
            viewer.subscribe("/robot_description")
            assert "<robot" in viewer.message()[2].data
            viewer.subscribe("/base/cmd_vel")
            assert viewer.message()[0] == "/base/cmd_vel"
            assert watch.wait().code == 0
        assert run.wait().code == 0


@pytest.mark.parametrize("command", ["run", "watch"])
def test_a_port_that_is_taken_is_said_before_anything_starts(state, tmp_path, command):
    import socket

    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        out = ("--out", str(tmp_path / "out")) if command == "run" else ()
        error = one_error(finished(state, command, "sim", *out, "--live", "--live-port", port, "--json"), 3)
    assert "--live-port" in error["do"]
    assert not (tmp_path / "out").exists()


def test_a_run_that_is_faster_than_the_clock_has_no_live_view(state, tmp_path):
    argv = ("run", "sim", "--fast", "--live", "--out", str(tmp_path / "out"), "--json")
    assert "--fast" in one_error(finished(state, *argv), 2)["what"]


def test_the_state_of_a_simulated_run_is_forgotten(state):
    wait_until(lambda: not list(state.glob("single-point-push/running/*.json")), "no run is under way")
