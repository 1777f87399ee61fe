"""The live line: rewritten on a terminal, once a second elsewhere, faults in words, and never in the way."""

from __future__ import annotations

import contextlib
import fcntl
import os
import pty
import struct
import termios
import time

import pytest

from robot_io.rig.config import load_rig
from tools.terminal.live_line import LiveLine

STATUS = {
    "tick": 100,
    "phase": "PUSH",
    "mode": "PUSHING",
    "progress_m": 0.5,
    "lateral_m": -0.012,
    "force_N": [12.0, 5.0, 0.0],
    "theta_p": 0.1,
    "speed": 0.1,
    "faults": [],
    "fault_values": [],
    "first_fault": "",
    "first_value": None,
    "late_ms": 0.1,
}


@contextlib.contextmanager
def stderr_is_a_pipe():
    """Give the end to read from. Not a fixture: pytest sets stderr anew for the test itself."""
    read_fd, write_fd = os.pipe()
    os.set_blocking(read_fd, False)
    with os.fdopen(write_fd, "w") as stderr, contextlib.redirect_stderr(stderr):
        yield read_fd
    os.close(read_fd)


def test_one_line_a_second_where_it_is_no_terminal():
    with stderr_is_a_pipe() as to_pipe:
        live = LiveLine(load_rig("emulated"))
        for _ in range(5):
            live.show(STATUS)
        lines = os.read(to_pipe, 65536).decode().splitlines()
        assert len(lines) == 1
        assert "PUSH" in lines[0]
        assert "0.50/2.00 m" in lines[0]
        assert "13.0/150 N" in lines[0]


def test_a_force_that_is_no_number_is_shown_as_such():
    with stderr_is_a_pipe() as to_pipe:
        LiveLine(load_rig("emulated")).show(STATUS | {"force_N": [None, None, None], "theta_p": None})
        assert "nan/150 N" in os.read(to_pipe, 65536).decode()


def test_a_fault_is_said_in_words_once():
    with stderr_is_a_pipe() as to_pipe:
        live = LiveLine(load_rig("emulated"), quiet=True)
        for _ in range(3):
            live.show({**STATUS, "faults": ["F01-slow"], "fault_values": [62.4], "mode": "SLOW"})
        said = os.read(to_pipe, 65536).decode()
        assert said == "F01-slow no force packet for 50 ms: 62.4 ms, limit 50 ms -> SLOW\n"


def test_the_first_cause_is_said_with_its_number_and_what_follows_from_it_is_not():
    stopped = {**STATUS, "mode": "STOP", "first_fault": "F50-stop", "first_value": 163.2}
    with stderr_is_a_pipe() as to_pipe:
        live = LiveLine(load_rig("emulated"), quiet=True)
        live.show({**stopped, "faults": ["F50-stop"], "fault_values": [163.2]})
        live.show({**stopped, "faults": ["F50-stop", "F31-stop", "F60-late"], "fault_values": [None, 251.0, None]})
        said = os.read(to_pipe, 65536).decode()
        assert said == "F50-stop the force is above the limit: 163 N, limit 150 N -> STOP\n"
        dead = {**stopped, "mode": "DEAD", "faults": ["F50-stop", "F34"], "fault_values": [None, 0.042]}
        live.show(dead)
        said = os.read(to_pipe, 65536).decode()
        assert said == "F34 the base moves although it was told to stop: 0.042 m/s, limit 0.03 m/s -> DEAD\n"


def test_a_full_pipe_holds_nobody_up():
    with stderr_is_a_pipe() as to_pipe:
        live = LiveLine(load_rig("emulated"))
        began_s = time.monotonic()
        for n in range(2000):
            live.say(f"{n} {'x' * 100}")
        assert time.monotonic() - began_s < 5.0
        said = b""
        while True:
            try:
                said += os.read(to_pipe, 65536)
            except BlockingIOError:
                break
        lines = said.decode().splitlines()
        assert [int(line.split()[0]) for line in lines] == list(range(len(lines))), "the first ones, whole"
        assert 100 < len(lines) < 2000
        live.say("again")
        assert os.read(to_pipe, 65536) == b"again\n"


def resize(fd, columns):
    fcntl.ioctl(fd, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))


@pytest.mark.parametrize("columns", [20, 40, 80, 132, 0])
def test_it_stays_one_line_on_any_terminal(columns):
    """A line as wide as the terminal would wrap, and could not be rewritten; 0 columns: the terminal does not say."""
    ours, theirs = pty.openpty()
    with os.fdopen(theirs, "w") as stderr, contextlib.redirect_stderr(stderr):
        resize(theirs, 132)
        live = LiveLine(load_rig("emulated"))
        live.show(STATUS)
        os.read(ours, 65536)
        resize(theirs, columns)
        live.show({**STATUS, "phase": "APPROACH"})
        live.say("a word")
        shown = b""
        while not shown.endswith(b"\n"):  # a terminal hands over in pieces
            shown += os.read(ours, 65536)
    os.close(ours)
    rewritten = shown.decode().strip().split("\r")
    assert max(len(part) for part in rewritten) < (columns or 80)
    assert rewritten[0].startswith("APPROACH    0.50/2.00 m  PUSHING"[: (columns or 80) - 1])
    assert rewritten[-1] == "a word"


def test_a_stopped_terminal_holds_nobody_up():
    ours, theirs = pty.openpty()
    with os.fdopen(theirs, "w") as stderr, contextlib.redirect_stderr(stderr):
        live = LiveLine(load_rig("emulated"))
        live.show(STATUS)
        assert os.read(ours, 65536).startswith(b"\r")
        os.write(ours, b"\x13")  # Ctrl-S
        for _ in range(1000):
            live.show(STATUS)  # returns
        os.write(ours, b"\x11")  # Ctrl-Q
        live.end()
    os.close(ours)


def test_a_line_longer_than_the_room_left_holds_nobody_up():
    """A poll says that there is room for a byte; the line may need more."""
    ours, theirs = pty.openpty()
    with os.fdopen(theirs, "w") as stderr, contextlib.redirect_stderr(stderr):
        live = LiveLine(load_rig("emulated"))
        began_s = time.monotonic()
        for _ in range(20):
            live.say("x" * 3000)  # nobody reads
        assert time.monotonic() - began_s < 2.0
        live.close()
        live.close()
        termios.tcflush(theirs, termios.TCOFLUSH)
    os.close(ours)


def test_a_file_is_written_at_its_end(tmp_path):
    with (tmp_path / "err").open("w") as stderr, contextlib.redirect_stderr(stderr):
        print("before", file=stderr, flush=True)
        live = LiveLine(load_rig("emulated"))
        live.say("between")
        print("after", file=stderr, flush=True)
    assert (tmp_path / "err").read_text() == "before\nbetween\nafter\n"


def test_a_closed_terminal_and_none_at_all():
    ours, theirs = pty.openpty()
    stderr = os.fdopen(theirs, "w")
    with contextlib.redirect_stderr(stderr):
        live = LiveLine(load_rig("emulated"))
        os.close(ours)
        live.show(STATUS)
        live.end()
    with contextlib.suppress(OSError):
        stderr.close()  # it could not write either
    with contextlib.redirect_stderr(None):
        none = LiveLine(load_rig("emulated"))
        none.show({**STATUS, "faults": ["F02"], "fault_values": [None]})
        none.end()
