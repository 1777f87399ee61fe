"""The operator at a real terminal during a run: pause, go on, stop, Ctrl-Z, `&` and `fg`; at level sim and emulated."""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import pty
import shlex
import shutil
import struct
import subprocess
import termios
import time

import pytest

from robot_io.messages import BodyTwist
from robot_io.tick import TICK_CDR, Mode
from tests.host_watch import repeated_when_the_host_stalls
from tests.push_runs import PUSH, QUICK, ROOT, messages, started, world_of
from tests.replay.runs import push
from tools.cli import main

SIM = ("run", "sim", *QUICK, "--distance-m", "2", "--json")


class Terminal:
    """Our end of a terminal of 100 columns that is the controlling one of what is started on it."""

    def __init__(self):
        self.fd, self.theirs = pty.openpty()
        os.set_blocking(self.fd, False)
        fcntl.ioctl(self.theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 100, 0, 0))
        self.shown = ""

    def taken(self):
        fcntl.ioctl(self.theirs, termios.TIOCSCTTY, 0)

    def wait_for(self, text, within_s=60.0):
        """Wait until it shows `text`, and forget what it showed until then."""
        deadline_s = time.monotonic() + within_s
        while text not in self.shown:
            assert time.monotonic() < deadline_s, self.shown[-2000:]
            try:
                self.shown += os.read(self.fd, 65536).decode(errors="replace")
            except BlockingIOError:
                time.sleep(0.01)
        self.shown = self.shown.partition(text)[2]

    def type(self, keys):
        os.write(self.fd, keys)

    def streams(self):
        return {"stdin": self.theirs, "stderr": self.theirs, "preexec_fn": self.taken}

    def close(self):
        for fd in (self.fd, self.theirs):
            with contextlib.suppress(OSError):
                os.close(fd)


@pytest.fixture
def terminal():
    terminal = Terminal()
    yield terminal
    terminal.close()


def ticks_of(out):
    return [TICK_CDR.decode(message.payload) for message in messages(out / "run.mcap", "/control/tick")]


def operator_events(out, capsys):
    """Return what the log says of the operator, as `push log cat` prints it."""
    capsys.readouterr()
    assert main(["log", "cat", str(out / "run.mcap"), "--topics", "/safety/event"]) == 0
    events = [json.loads(line)["message"] for line in capsys.readouterr().out.splitlines()]
    return [event["text"] for event in events if event["kind"] == "operator"]


def check_pause(out, *, resting_after_s=0.5):
    """Check that the base stood while it was paused, that it went on afterwards, and that all of it replays."""
    ticks = ticks_of(out)
    held = [tick for tick in ticks if tick.input.paused]
    assert len(held) > 30
    assert {tick.output.mode for tick in held} == {Mode.HOLD}
    still = [tick for tick in held if tick.input.now_ns - held[0].input.now_ns > resting_after_s * 1e9]
    assert still
    assert {tick.output.command_body for tick in still} == {BodyTwist()}
    assert {tick.input.base.sent for tick in still} == {BodyTwist()}
    after = [tick for tick in ticks if tick.input.tick > held[-1].input.tick]
    assert max(tick.output.command_body.vx for tick in after) > 0.05
    assert {tick.after.control.resumes for tick in ticks} == {0}


@pytest.mark.long
@repeated_when_the_host_stalls
def test_at_level_sim_space_pauses_and_goes_on_and_any_other_key_stops(tmp_path, capsys):
    terminal, out = Terminal(), tmp_path / "run"
    before = termios.tcgetattr(terminal.theirs)
    with started(tmp_path / "state", *SIM, "--out", str(out), **terminal.streams()) as run:
        terminal.wait_for("PUSH  0.")
        terminal.wait_for("space pauses, other keys stop")
        terminal.type(b" ")
        terminal.wait_for("PUSH PAUSED")
        terminal.wait_for("space goes on, other keys stop")
        for _ in range(4):  # a fifth of a second each
            terminal.wait_for("PUSH PAUSED")
        terminal.type(b" ")
        terminal.wait_for("PUSH  ")
        terminal.wait_for("v 0.10 m/s")
        terminal.type(b"x")
        terminal.wait_for("stopping ...")
        ended = run.wait(20.0)
    assert ended.code == 130
    summary = json.loads((out / "summary.json").read_text())
    assert (summary["verdict"], summary["faults"], summary["pauses"]) == ("operator stop", ["F64"], 1)
    assert summary["paused_s"] > 0.5
    check_pause(out)
    assert operator_events(out, capsys) == ["paused", "goes on after a pause"]
    assert termios.tcgetattr(terminal.theirs) == before
    assert push("replay", out, "--json", state=tmp_path).returncode == 0
    terminal.close()


@repeated_when_the_host_stalls
def test_ctrl_z_at_level_sim_stops_and_freezes_nothing(tmp_path):
    terminal, out = Terminal(), tmp_path / "run"
    with started(tmp_path / "state", *SIM, "--out", str(out), **terminal.streams()) as run:
        terminal.wait_for("APPROACH")
        terminal.type(b"\x1a")
        assert run.wait(20.0).code == 130
    assert json.loads((out / "summary.json").read_text())["faults"] == ["F64"]
    terminal.close()


@pytest.mark.long
def test_a_pause_is_an_event_of_the_log(tmp_path, capsys):
    terminal, out = Terminal(), tmp_path / "run"
    with started(tmp_path / "state", *SIM, "--out", str(out), **terminal.streams()) as run:
        terminal.wait_for("APPROACH")
        terminal.type(b" ")
        terminal.wait_for("APPROACH PAUSED")
        terminal.type(b" ")
        terminal.wait_for("space pauses")
        terminal.type(b"x")
        run.wait(20.0)
    terminal.close()
    assert operator_events(out, capsys) == ["paused", "goes on after a pause"]


@pytest.mark.long
@repeated_when_the_host_stalls
def test_with_real_drivers_a_pause_holds_the_base_and_no_deadline_runs_out(tmp_path, host):
    terminal, out = Terminal(), tmp_path / "run"
    argv = ("run", "emulated", *QUICK, "--distance-m", "0.6", "--out", str(out), "--json")
    with started(tmp_path / "state", *argv, host=host, **terminal.streams()) as run:
        terminal.wait_for("PUSH  0.")
        terminal.type(b" ")
        terminal.wait_for("PUSH PAUSED")
        until_s = time.monotonic() + 12.0
        while time.monotonic() < until_s:
            terminal.wait_for("PUSH PAUSED")
        terminal.type(b" ")
        ended = run.wait(60.0)
        assert ended.code == 0, terminal.shown
    summary = json.loads((out / "summary.json").read_text())
    assert (summary["verdict"], summary["pauses"], summary["first_fault"]) == ("done", 1, None)
    assert summary["paused_s"] > 10.0
    check_pause(out)
    paused_ns = [tick.input.now_ns for tick in ticks_of(out) if tick.input.paused]
    _, wheels = world_of(out / "run.mcap")
    stood = [twist for at_ns, twist in wheels if paused_ns[0] + 1_000_000_000 < at_ns < paused_ns[-1]]
    assert {(twist.vx, twist.vy, twist.omega) for twist in stood} == {(0.0, 0.0, 0.0)}
    assert push("replay", out, "--json", state=tmp_path).returncode == 0
    terminal.close()


@pytest.mark.long
@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash for `&` and `fg`")
def test_a_run_in_the_background_hears_keys_once_it_is_in_the_foreground(tmp_path, terminal):
    """A real shell with jobs: `push run ... &`, `fg`, space, space, x."""
    out = tmp_path / "run"
    command = shlex.join([*PUSH, *SIM, "--out", str(out)])
    env = {**os.environ, "XDG_STATE_HOME": str(tmp_path), "PS1": "shell> ", "PYTHONPATH": str(ROOT), "TERM": "xterm"}
    shell = subprocess.Popen(
        ["bash", "--norc", "--noprofile", "-i"],
        env=env,
        stdin=terminal.theirs,
        stdout=terminal.theirs,
        stderr=terminal.theirs,
        preexec_fn=lambda: (os.setsid(), terminal.taken()),
    )
    try:
        terminal.wait_for("shell> ")
        terminal.type(f"{command} &\n".encode())
        terminal.wait_for("PUSH  0.")
        assert "space pauses" not in terminal.shown.partition("PUSH")[0]
        terminal.type(b"fg\n")
        terminal.wait_for("space pauses, other keys stop")
        terminal.type(b" ")
        terminal.wait_for("PUSH PAUSED")
        terminal.type(b" ")
        terminal.wait_for("space pauses, other keys stop")
        terminal.type(b"x")
        terminal.wait_for("shell> ")
        terminal.type(b"echo code $?\n")
        terminal.wait_for("code 130")
    finally:
        shell.kill()
        shell.wait()
