"""`push run emulated` as a user runs it: one real run shared by many checks, then short ones for what can happen."""

from __future__ import annotations

import contextlib
import fcntl
import importlib.util
import json
import os
import pty
import signal
import termios
import time

import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from robot_io.mcap.read import read_summary
from robot_io.tick import TICK_CDR
from tests.forked_push import forked
from tests.host_watch import repeated_when_the_host_stalls
from tests.how_many import mostly_long
from tests.push_runs import QUICK, Run, finished, messages, one_error, stands, started, world_of
from tests.wire.ur_process import wait_until

DISTANCE_M = 0.2
FILES = {"run.mcap", "config.toml", "summary.json", "processes.json"}


@pytest.fixture(scope="module")
def shared_run(state, host, tmp_path_factory):
    """The run that the first tests look at, with all its defaults but the distance and the tare; and its folder.

    It is started in a folder with packages that are called like ours, as in many a project.
    """
    found = []
    elsewhere = tmp_path_factory.mktemp("project")
    for package in ("tools", "control", "safety"):
        (elsewhere / package).mkdir()
        (elsewhere / package / "__init__.py").write_text("raise ImportError('not this one')")

    @repeated_when_the_host_stalls
    def push(tmp_path):
        out = tmp_path / "one"
        argv = ("run", "emulated", "--distance-m", str(DISTANCE_M), "--out", str(out), "--json")
        found[:] = [finished(state, *argv, host=host, cwd=elsewhere), out]

    push(tmp_path=tmp_path_factory.mktemp("runs"))
    return found


@pytest.fixture(scope="module")
def done(shared_run):
    return shared_run[0]


@pytest.fixture(scope="module")
def folder(shared_run):
    return shared_run[1]


@pytest.fixture(scope="module")
def replayed(done, state, folder):
    return forked(state, "replay", str(folder), "--json")


def furthest_m(log):
    """Return the largest progress of a run; at rest afterwards, the pose's noise may read a little less."""
    return max(TICK_CDR.decode(message.payload).after.control.progress_m for message in messages(log, "/control/tick"))


def test_the_verdict(done, folder):
    assert done.code == 0, done.err
    summary = done.last_object
    assert summary["schema"] == 1
    assert (summary["verdict"], summary["exit_code"]) == ("done", 0)
    assert furthest_m(folder / "run.mcap") >= DISTANCE_M, "it goes on until the measured distance is reached"
    assert summary["distance_m"] == pytest.approx(DISTANCE_M, abs=0.05)
    assert abs(summary["lateral_error_m"]) < 0.1
    assert summary["log"] == str(folder / "run.mcap")
    assert summary["contact_seen"] is True
    assert abs(summary["residual_N"]) < 5.0
    assert summary["notes"] == []


def test_counters_of_all_three_devices(done):
    devices = done.last_object["devices"]
    ticks = done.last_object["loop"]["ticks"]
    assert set(devices) == {"ft300", "ur10", "ridgeback"}
    assert devices["ft300"]["packets_ok"] > 0.95 * ticks
    assert devices["ft300"]["crc_fail"] == 0
    assert devices["ur10"]["packets"] > 1.2 * ticks  # 125 Hz beside 100 Hz
    assert devices["ridgeback"]["pose"] > 0.9 * ticks
    assert devices["ridgeback"]["undecodable"] == 0


def test_loop_timing_and_safety_events(done):
    summary = done.last_object
    loop = summary["loop"]
    assert loop["rate_hz"] == 100.0
    assert loop["measured_hz"] == pytest.approx(100.0, abs=1.0)
    assert 0.0 <= loop["late_p50_ms"] <= loop["late_p99_ms"] <= loop["late_worst_ms"]
    assert loop["ticks"] > 400
    stopping = {"STOP", "DEAD"}
    assert not [event for event in summary["safety_events"] if event["mode"] in stopping]
    assert all(isinstance(count, int) for count in summary["fault_counts"].values())


def test_the_folder(done, folder):
    with_report = {"report.html"} if importlib.util.find_spec("tools.commands.report") else set()
    assert {path.name for path in folder.iterdir()} == FILES | with_report
    assert json.loads((folder / "summary.json").read_text()) == done.last_object
    processes = json.loads((folder / "processes.json").read_text())
    assert set(processes) == {"schema", "launcher", "emulators", "recorder", "gate", "arm", "control"}


def test_people_read_it_on_stderr(done):
    assert "emulated" in done.err.splitlines()[0]
    assert f"pushed {DISTANCE_M:.2f} m" in done.err
    assert "loop: " in done.err
    assert "safety events: " in done.err
    assert "Traceback" not in done.err


def test_replay_is_identical_ticks_and_world(done, replayed):
    assert replayed.code == 0, replayed.err
    result = replayed.last_object
    assert result["ticks"] == result["identical"] == done.last_object["loop"]["ticks"]
    assert (result["gaps"], result["first_difference"]) == (0, None)
    assert result["world"]["states"] == result["world"]["identical"] > 400


@pytest.mark.long
def test_the_log_in_the_eyes_of_others(done, folder):
    ours = {channel.topic: channel.messages for channel in read_summary(folder / "run.mcap").channels}
    assert ours["/control/tick"] == done.last_object["loop"]["ticks"]

    from rosbags.highlevel import AnyReader

    with AnyReader([folder / "run.mcap"]) as reader:
        assert {connection.topic: connection.msgcount for connection in reader.connections} == ours

    counts = dict.fromkeys(ours, 0)
    progress = 0.0
    with (folder / "run.mcap").open("rb") as file:
        for _, channel, _, message in make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
            counts[channel.topic] += 1
            if channel.topic == "/control/tick":
                progress = max(progress, message.after.control.progress_m)
    assert counts == ours
    assert progress == pytest.approx(done.last_object["distance_m"], abs=0.01)


def test_a_folder_with_a_run_is_refused(done, state, folder):
    before = {path.name: path.stat().st_mtime_ns for path in folder.iterdir()}
    error = one_error(forked(state, "run", "emulated", "--out", str(folder), "--json"), 2)
    assert str(folder) in error["where"]
    assert {path.name: path.stat().st_mtime_ns for path in folder.iterdir()} == before


@pytest.mark.long
@repeated_when_the_host_stalls
def test_in_contact_with_the_tare_of_the_run_before(done, state, tmp_path, host):
    ended = finished(
        *(state, "run", "emulated", "--start-in-contact", "--distance-m", "0.1"),
        *(*QUICK, "--out", str(tmp_path / "run"), "--json"),
        host=host,
    )
    assert ended.code == 0, ended.err
    assert furthest_m(tmp_path / "run" / "run.mcap") >= 0.1
    controls = [
        TICK_CDR.decode(message.payload).after.control
        for message in messages(tmp_path / "run" / "run.mcap", "/control/tick")
    ]
    assert all(control.tared for control in controls), "the saved tare holds from the start"
    met = next(control for control in controls if control.contact_seen)
    assert met.contact_from_m - met.approach_from_m < 0.03, "the gap of the scene is closed"


def test_in_contact_without_a_tare_is_refused(tmp_path):
    ended = forked(tmp_path / "state", "run", "emulated", "--start-in-contact", "--out", str(tmp_path / "x"), "--json")
    error = one_error(ended, 2)
    assert "tare" in error["what"]
    assert not (tmp_path / "x").exists()


@pytest.mark.long
@repeated_when_the_host_stalls
def test_two_emulated_runs_share_nothing_and_stops_are_clean(state, tmp_path, host):
    with started(state, "run", "emulated", *QUICK, "--out", str(tmp_path / "first"), "--json", host=host) as first:
        first.wait_for("PUSH ")
        beside = (*QUICK, "--out", str(tmp_path / "second"), "--json")
        with started(state, "run", "emulated", *beside, host=host) as second:
            second.wait_for("PUSH ")
            assert_clean_stop(second, tmp_path / "second", signal.SIGINT)
        assert_clean_stop(first, tmp_path / "first", signal.SIGINT)


def assert_clean_stop(run: Run, folder, *signals: int) -> None:
    """Stop a pushing run; check exit code, log, and that the base was braked, not dropped."""
    for number in signals:
        run.signal(number)
    ended = run.wait(20.0)
    assert ended.code == 130, ended.err
    summary = ended.last_object
    assert summary["verdict"] == "operator stop"
    assert summary["faults"][0] == "F64"
    run.wait_gone(3.0)
    ticks = [TICK_CDR.decode(message.payload) for message in messages(folder / "run.mcap", "/control/tick")]
    assert ticks[-1].output.finished
    commands, wheels = world_of(folder / "run.mcap")
    assert stands(commands[-1][1])
    assert stands(wheels[-1][1])
    assert not [event for event in summary["safety_events"] if "F65" in event["faults"]]
    assert {path.name for path in folder.iterdir()} == FILES


@pytest.mark.long
@repeated_when_the_host_stalls
def test_sigterm_twice_at_once_is_one_clean_stop(state, tmp_path, host):
    """`timeout` signals the program and then its whole group."""
    with started(state, "run", "barrel", *QUICK, "--out", str(tmp_path / "run"), "--json", host=host) as run:
        run.wait_for("PUSH ")
        run.signal(signal.SIGTERM)
        time.sleep(0.02)  # so that the first one is taken, and the second is not the same pending signal
        assert_clean_stop(run, tmp_path / "run", signal.SIGTERM)


@pytest.mark.parametrize(
    "moment", mostly_long(("announced", "emulators ready", "all started"), "announced", "all started")
)
def test_ctrl_c_while_starting_leaves_nothing(state, tmp_path, moment):
    out = tmp_path / "run"
    with started(state, "run", "emulated", *QUICK, "--out", str(out), "--json") as run:
        run.wait_for("base  emulated")
        if moment != "announced":
            file = out / ("config.toml" if moment == "emulators ready" else "processes.json")
            wait_until(file.exists, str(file))
        run.signal(signal.SIGINT)
        ended = run.wait(20.0)
        assert ended.code == 130, ended
        assert "Traceback" not in ended.err
        assert ended.last_object["error"]["code"] == 130
        run.wait_gone(3.0)
    assert not out.exists()


@pytest.mark.long
@repeated_when_the_host_stalls
def test_a_barrel_is_pushed_with_stdin_closed(state, tmp_path, host):
    argv = ("run", "barrel", "--distance-m", "0.15", *QUICK, "--out", str(tmp_path / "run"), "--json")
    ended = finished(state, *argv, host=host, preexec_fn=lambda: os.close(0))
    assert ended.code == 0, ended.err
    summary = ended.last_object
    assert summary["rig"] == "barrel"
    assert summary["distance_m"] >= 0.15


@pytest.mark.long
@repeated_when_the_host_stalls
def test_an_e_series_arm_pushes_with_its_own_sensor(state, tmp_path, host):
    """To the end, without a fault, and its log replays tick by tick."""
    argv = ("run", "ur10e-emulated", "--distance-m", "0.3", *QUICK, "--out", str(tmp_path / "run"), "--json")
    ended = finished(state, *argv, host=host)
    assert ended.code == 0, ended.err
    summary = ended.last_object
    assert (summary["verdict"], summary["fault_counts"]) == ("done", {})
    assert summary["devices"]["tool-force"]["packets_ok"] > 500 * 5
    replayed = finished(state, "replay", str(tmp_path / "run"), "--json", host=host)
    assert replayed.code == 0, replayed.err


class Terminal:
    """Our end of a terminal, read without waiting."""

    def __init__(self):
        self.fd, self.theirs = pty.openpty()
        os.set_blocking(self.fd, False)
        self.shown = b""

    def wait_for(self, text, within_s=40.0):
        deadline_s = time.monotonic() + within_s
        while text not in self.shown:
            assert time.monotonic() < deadline_s, self.shown
            try:
                self.shown += os.read(self.fd, 65536)
            except BlockingIOError:
                time.sleep(0.01)

    def all_shown(self):
        with contextlib.suppress(BlockingIOError):
            self.shown += os.read(self.fd, 65536)
        return self.shown[-600:].decode(errors="replace")

    def taken(self):
        """Make it the controlling terminal of the process that is being started: its signals go to the whole group."""
        fcntl.ioctl(self.theirs, termios.TIOCSCTTY, 0)

    def close(self):
        os.close(self.fd)
        os.close(self.theirs)


@repeated_when_the_host_stalls
def test_on_a_terminal_a_key_stops(state, tmp_path, host):
    """stdin and stderr are a terminal: a live line, a clean stop by a key, and the terminal is left as it was."""
    terminal = Terminal()
    out = tmp_path / "run"
    before = termios.tcgetattr(terminal.theirs)
    argv = ("run", "emulated", *QUICK, "--out", str(out), "--json")
    with started(state, *argv, host=host, stdin=terminal.theirs, stderr=terminal.theirs) as run:
        wait_until((out / "processes.json").exists, "the processes", 40.0)
        os.write(terminal.fd, b"r")  # resume means nothing yet, and harms nothing
        terminal.wait_for(b"PUSH ")
        assert b"\r" in terminal.shown
        os.write(terminal.fd, b"x")
        code = run.wait(20.0).code
        assert code == 130, terminal.all_shown()
        run.wait_gone(3.0)
    assert termios.tcgetattr(terminal.theirs) == before
    terminal.close()


@pytest.mark.long
@repeated_when_the_host_stalls
def test_a_closed_terminal_is_a_clean_stop(state, tmp_path, host):
    """The window is closed, or the connection of a remote login breaks: SIGHUP for all of the launcher's group, and
    nobody to write the verdict to."""
    terminal = Terminal()
    out = tmp_path / "run"
    streams = {"stdin": terminal.theirs, "stdout": terminal.theirs, "stderr": terminal.theirs}
    argv = ("run", "emulated", *QUICK, "--out", str(out))
    with started(state, *argv, host=host, preexec_fn=terminal.taken, **streams) as run:
        terminal.wait_for(b"PUSH ")
        terminal.close()
        assert run.wait(20.0).code == 130
        assert run.left_files() == []
    summary = json.loads((out / "summary.json").read_text())
    assert (summary["verdict"], summary["faults"], summary["notes"]) == ("operator stop", ["F64"], [])


@pytest.mark.long
@pytest.mark.parametrize("key", [b"\x1a", b"\x1c"], ids=["Ctrl-Z", "Ctrl-backslash"])
@repeated_when_the_host_stalls
def test_keys_that_a_terminal_makes_signals_of_stop_like_any_other(state, tmp_path, host, key):
    """A launcher put to sleep would hear no key, and the base would push on; the other processes hear none of it."""
    terminal = Terminal()
    out = tmp_path / "run"
    argv = ("run", "emulated", *QUICK, "--out", str(out), "--json")
    streams = {"stdin": terminal.theirs, "stderr": terminal.theirs}
    with started(state, *argv, host=host, preexec_fn=terminal.taken, **streams) as run:
        terminal.wait_for(b"PUSH ")
        os.write(terminal.fd, key)
        assert_clean_stop(run, out)
    summary = json.loads((out / "summary.json").read_text())
    assert (summary["faults"], summary["notes"]) == (["F64"], [])
    terminal.close()


@pytest.mark.long
@repeated_when_the_host_stalls
def test_a_reader_that_stopped_reading_does_not_hold_up_the_stop(state, tmp_path, host):
    """`push run 2>&1 | less`: nobody reads on, the pipe is full, and a stop must get through all the same."""
    read_fd, write_fd = os.pipe()
    argv = ("run", "emulated", *QUICK, "--out", str(tmp_path / "run"), "--json")
    with started(state, *argv, host=host, stderr=write_fd) as run:
        shown = b""
        while b"PUSH " not in shown:
            shown += os.read(read_fd, 65536)
        os.set_blocking(write_fd, False)
        with contextlib.suppress(BlockingIOError):
            while True:
                os.write(write_fd, b"x" * 4096)
        os.set_blocking(write_fd, True)
        control = json.loads((tmp_path / "run" / "processes.json").read_text())["control"]
        run.signal(signal.SIGTERM)
        wait_until(lambda: control not in run.alive(), "control ends", 10.0)
        os.set_blocking(read_fd, False)

        def ended():
            with contextlib.suppress(BlockingIOError):
                os.read(read_fd, 65536)
            return run.process.poll() is not None

        wait_until(ended, "the run ends", 20.0)
        assert_clean_stop(run, tmp_path / "run")
    os.close(read_fd)
    os.close(write_fd)


def test_dry_run_opens_nothing(state, tmp_path):
    out = tmp_path / "dry"
    ended = forked(state, "run", "thing", "--dry-run", "--out", str(out), "--json")
    assert ended.code == 0, ended.err
    assert ended.last_object["dry_run"] is True
    assert ended.last_object["devices"]["ur10"]["level"] == "hardware"
    assert not out.exists()


def test_fast_needs_level_sim(state):
    error = one_error(forked(state, "run", "emulated", "--fast", "--json"), 2)
    assert "--fast" in error["what"]


@pytest.mark.long
@pytest.mark.timeout(240)
@repeated_when_the_host_stalls
def test_six_metres_with_force_feedback(state, tmp_path, host):
    out = tmp_path / "run"
    ended = finished(
        state, "run", "emulated", "--distance-m", "6", "--out", str(out), "--json", within_s=200.0, host=host
    )
    assert ended.code == 0, ended.err
    assert furthest_m(out / "run.mcap") >= 6.0
    ticks = [TICK_CDR.decode(message.payload) for message in messages(out / "run.mcap", "/control/tick")]
    pushing = [tick.after.control for tick in ticks if tick.after.control.contact_seen]
    assert max(abs(control.lateral_m) for control in pushing) < 0.5


@pytest.mark.long
@pytest.mark.timeout(240)
@pytest.mark.parametrize("seed", [0, 7])
@repeated_when_the_host_stalls
def test_open_loop_loses_the_object(state, tmp_path, seed, host):
    argv = ("run", "emulated", "--law", "open-loop", "--distance-m", "6", "--seed", str(seed))
    ended = finished(state, *argv, "--out", str(tmp_path / "run"), "--json", within_s=200.0, host=host)
    assert ended.code == 6, ended.err
    summary = ended.last_object
    assert summary["verdict"] == "contact lost"
    assert summary["distance_m"] < 2.0
    _, wheels = world_of(tmp_path / "run" / "run.mcap")
    assert stands(wheels[-1][1])


LATE_ADAPTER = """
import sys
if "tools.run.control_process" in sys.orig_argv:
    from robot_io.ft300 import serial_link
    serial_link._milliseconds = lambda timer: 16
"""


@pytest.mark.long
def test_what_a_driver_warns_of_is_said(state, tmp_path):
    """An adapter that delivers late must be mended by the operator, and its driver knows how."""
    (tmp_path / "sitecustomize.py").write_text(LATE_ADAPTER)
    with started(state, "run", "emulated", *QUICK, env={"PYTHONPATH": str(tmp_path)}, cwd=tmp_path) as run:
        run.wait_for(r"ft300: .*delivers only every 16 ms .*udev rule")
        run.signal(signal.SIGINT)
        assert run.wait(20.0).code == 130
