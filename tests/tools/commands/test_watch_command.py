"""`push watch` as somebody uses it: beside devices on loopback, on a terminal, and beside a run."""

import contextlib
import fcntl
import json
import os
import pty
import re
import signal
import struct
import termios
import time

import pytest

from robot_io.rig.topics import TopicsConfig
from tests.forked_push import forked
from tests.push_runs import PUSH, QUICK, ROOT, finished, one_error, started
from tests.wire.bridge_process import running_bridge
from tests.wire.ft300_process import ft300_process
from tests.wire.ur_process import EmulatorProcess as UrProcess
from tests.wire.ur_process import wait_until
from tools.places.device_locks import DeviceLocks
from tools.rig import resolve_rig

FRAME = b"\x1b[H"
ALTERNATE, NORMAL = b"\x1b[?1049h", b"\x1b[?1049l"


def pictures(run):
    """Return what `--json` has printed so far."""
    return [json.loads(line) for line in run.out.splitlines(keepends=True) if line.endswith("\n")]


def newest(run, wanted, what, within_s=30.0):
    """Wait until the newest picture is as wanted; return it."""

    def look():
        assert run.process.poll() is None, run.err
        shown = pictures(run)
        return shown[-1] if shown and wanted(shown[-1]) else None

    return wait_until(look, what, within_s)


@contextlib.contextmanager
def robot(*, hold="monitor"):
    """Give an FT 300, a UR10 and a Ridgeback on loopback, and the settings that make the rig `emulated` use them."""
    with ft300_process() as sensor, UrProcess() as arm, running_bridge(topics=TopicsConfig()) as bridge:
        where = {"ft.port": sensor.port, "arm.host": arm.host, "base.url": bridge.url, "arm.hold": hold}
        levels = {f"{device}.level": "hardware" for device in ("ft", "arm", "base")}
        yield sensor, arm, bridge, [word for pair in (where | levels).items() for word in ("--set", "=".join(pair))]


def test_pressing_the_ball_shows_its_sign_and_nothing_is_sent_that_moves(state):
    with robot(hold="servo") as (sensor, arm, bridge, settings):
        at_rest = (12.34, -56.78, 100.0, 0.1, -1.23, 3.21)
        with started(state, "watch", "emulated", "--json", *settings) as watch:
            newest(watch, lambda shown: shown["force_on_ball_body_N"] is not None, "it tares")
            sensor.ask("press", [*at_rest[:2], 85.0, *at_rest[3:]])
            shown = newest(watch, lambda shown: abs(shown["force_on_ball_sensor_N"][2] + 15.0) < 0.1, "the press")
            assert shown["force_on_ball_body_N"] == pytest.approx([-15.0, 0.0, 0.0], abs=0.1)
            assert shown["theta_f_rad"] == pytest.approx(0.0, abs=0.1)
            up = newest(watch, lambda shown: shown["arm"]["state"] == shown["base"]["state"] == "up", "all are up")
            assert (up["ft"]["state"], up["run"]) == ("up", None)
            assert up["arm"]["arm_state"] == "holding"
            assert sensor.ask("counters")["streaming"]
            watch.signal(signal.SIGINT)
            ended = watch.wait()
            watch.wait_gone(3.0)
        assert (ended.code, ended.err) == (0, "")
        counters, heard = arm.get("counters"), bridge.report()
        assert (arm.get("requests.script_bytes"), counters["input_frames"], counters["programs_started"]) == (0, 0, 0)
        assert (heard["heard"], heard["counters"]["commands_forwarded"]) == ([], 0)
        told = sensor.ask("counters")
        assert (told["starts"], told["streaming"]) == (1, False), "the stream is stopped at the end"


@pytest.mark.long
def test_a_device_that_is_lost_is_said_and_comes_back(state):
    with robot() as (_, _, bridge, settings), started(state, "watch", "emulated", "--json", *settings) as watch:
        newest(watch, lambda shown: shown["base"]["state"] == "up", "it is up")
        bridge.do("freeze", 6.0)
        lost = newest(watch, lambda shown: shown["base"]["state"] == "lost", "it is lost")
        assert "nothing has come from the bridge" in lost["base"]["cause"]
        assert lost["ft"]["state"] == "up"
        newest(watch, lambda shown: shown["base"]["state"] == "up", "it is back")
        watch.signal(signal.SIGTERM)
        assert watch.wait().code == 0


@pytest.mark.long
def test_a_device_that_is_not_there_is_said_beside_those_that_are(state):
    nowhere = ("--set", "base.level=hardware", "--set", "base.url=ws://127.0.0.1:1")
    with started(state, "watch", "emulated", "--json", *nowhere) as watch:
        shown = newest(
            watch, lambda shown: shown["base"]["state"] == "lost" and shown["ft"]["state"] == "up", "the others are up"
        )
        assert "Start rosbridge" in shown["base"]["cause"]
        watch.signal(signal.SIGINT)
        assert watch.wait().code == 0


@pytest.mark.long
def test_killed_it_leaves_no_process_and_no_stream_behind_and_meanwhile_no_run_starts(state):
    with robot() as (sensor, _, _, settings), started(state, "watch", "emulated", "--json", *settings) as watch:
        newest(watch, lambda shown: shown["ft"]["state"] == shown["arm"]["state"] == "up", "they are up")
        error = one_error(finished(state, "run", "emulated", "--move-robot", "--json", *settings), 3)
        assert "in use by another run" in error["what"]
        watch.signal(signal.SIGKILL)
        watch.process.wait()
        watch.wait_gone(6.0)
        assert not sensor.ask("counters")["streaming"]


@pytest.mark.long
def test_where_there_is_no_terminal_it_prints_lines_and_shows_the_hands_of_the_rig(state):
    hand = "world.hand=[{at_s = 6.0, for_s = 60.0, force_body_N = [0.0, 12.0, 0.0]}]"
    with started(state, "watch", "emulated", "--set", hand) as watch:
        wait_until(lambda: "LEFT 1" in watch.out and watch.out.count("\n") >= 3, "lines", 40.0)
        assert "no force" in watch.out
        assert "BODY" in watch.out
        assert "\x1b" not in watch.out
        watch.signal(signal.SIGHUP)
        assert watch.wait().code == 0


def test_devices_that_are_all_in_use_are_not_opened(state, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(state))
    where = {"ft.port": "socket://127.0.0.1:1", "arm.host": "127.0.0.1", "base.url": "ws://127.0.0.1:2"}
    keys = [f"{key}={value}" for key, value in where.items()] + [f"{d}.level=hardware" for d in ("ft", "arm", "base")]
    with DeviceLocks(resolve_rig("emulated", keys)):
        settings = [word for key in keys for word in ("--set", key)]
        error = one_error(forked(state, "watch", "emulated", "--json", *settings), 3)
    assert f"process {os.getpid()}" in error["what"]


def test_at_level_sim_there_is_nothing_to_watch(state):
    error = one_error(forked(state, "watch", "sim", "--json"), 2)
    assert "nothing to watch" in error["what"]


class Screen:
    """`push watch` on a terminal of its own."""

    def __init__(self, state, columns, **env):
        pid, self.fd = pty.fork()
        if not pid:
            os.chdir(ROOT)
            full = {**os.environ, "XDG_STATE_HOME": str(state), "PYTHONPATH": str(ROOT), "TERM": "xterm", **env}
            os.execve(PUSH[0], [*PUSH, "watch", "emulated"], full)
        self.pid, self.shown = pid, b""
        self.resize(columns)
        os.set_blocking(self.fd, False)

    def resize(self, columns):
        fcntl.ioctl(self.fd, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))

    def read(self):
        with contextlib.suppress(OSError):
            while data := os.read(self.fd, 65536):
                self.shown += data
        return self.shown

    def frame(self):
        """Return the lines of the newest whole picture, without their styles."""
        frames = self.read().split(FRAME)[1:-1]
        return [strip(line) for line in frames[-1].decode().splitlines()] if frames else []

    def code(self):
        """Return its exit code, reading what it still shows."""
        deadline_s = time.monotonic() + 15.0
        while True:
            self.read()
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                self.read()
                return os.waitstatus_to_exitcode(status)
            assert time.monotonic() < deadline_s, "it did not end"
            time.sleep(0.02)


def strip(line):
    for mark in (
        "\x1b[0m",
        "\x1b[1m",
        "\x1b[1;30;46m",
        "\x1b[1;31m",
        "\x1b[2m",
        "\x1b[K",
        "\x1b[J",
        "\x1b[1;7m",
        "\x1b[1;4m",
    ):
        line = line.replace(mark, "")
    assert "\x1b" not in line, repr(line)
    return line


@pytest.mark.long
def test_it_survives_a_resize_and_gives_the_terminal_back(state):
    screen = Screen(state, 100, LANG="C.UTF-8", PYTHONUTF8="1", COLUMNS="80")  # some shells export it
    wait_until(lambda: any(line.startswith("BODY ") for line in screen.frame()), "the force is shown", 30.0)
    assert screen.read().startswith(ALTERNATE)
    assert any(line.startswith("base") for line in screen.frame())
    screen.resize(40)
    wait_until(lambda: max(map(len, screen.frame())) <= 40, "the narrow picture", 10.0)
    assert any(line.startswith("BODY ") for line in screen.frame())
    os.write(screen.fd, b"t")
    wait_until(lambda: any("touch neither" in line for line in screen.frame()), "it tares again", 10.0)
    os.write(screen.fd, b"q")
    assert screen.code() == 0
    assert NORMAL in screen.shown[-20:]


@pytest.mark.long
@pytest.mark.parametrize("key", [b"\x03", b"\x1a"], ids=["Ctrl-C", "Ctrl-Z"])
def test_keys_that_signal_end_it_too(state, key):
    screen = Screen(state, 80, NO_COLOR="1")
    wait_until(lambda: any("holding" in line for line in screen.frame()), "the arm is shown", 30.0)
    os.write(screen.fd, key)
    assert screen.code() == 0
    assert not re.search(rb"\x1b\[[0-9;]*[34][0-7]", screen.shown), "no colour"
    assert b"\x1b[1;7m" in screen.shown


@pytest.mark.long
def test_a_simulated_run_is_watched_through_its_log(state, tmp_path):
    argv = ("run", "sim", "--distance-m", "0.6", "--out", str(tmp_path / "out"), *QUICK)
    with started(state, *argv) as run:
        run.wait_for("APPROACH|PUSH")
        with started(state, "watch", "sim", "--json") as watch:
            shown = newest(watch, lambda shown: shown["run"] is not None, "it is attached")
            assert shown["source"] == f"the run in {tmp_path / 'out'}"
            assert shown["tare"] == "tared by the run"
            ended = watch.wait()
        assert run.wait().code == 0
    assert ended.code == 0
    assert ended.err.strip() == f"the run has ended; its log is {tmp_path / 'out' / 'run.mcap'}"
    assert pictures(watch)[-1]["run"]["phase"] == "DONE"
    assert {shown["run"]["phase"] for shown in pictures(watch) if shown["run"]} & {"APPROACH", "PUSH", "REST"}
