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

from robot_io.clock import NS_PER_S
from robot_io.rig.config import load_rig
from tools.terminal.live_line import LiveLine
from tools.terminal.live_text import live_text

STATUS = {
    "tick": 100,
    "phase": "PUSH",
    "mode": "PUSHING",
    "paused": False,
    "old": [],
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
        live = LiveLine(load_rig("emulated"))
        for _ in range(3):
            live.show({**STATUS, "faults": ["F01-slow"], "fault_values": [62.4], "mode": "SLOW"})
        said = os.read(to_pipe, 65536).decode().splitlines()
        assert said[0] == "F01-slow no force packet for 50 ms: 62.4 ms, limit 50 ms -> SLOW"
        assert len(said) == 2


def test_the_first_cause_is_said_with_its_number_and_what_follows_from_it_is_not():
    stopped = {**STATUS, "mode": "STOP", "first_fault": "F50-stop", "first_value": 163.2}
    with stderr_is_a_pipe() as to_pipe:
        live = LiveLine(load_rig("emulated"))
        live.show({**stopped, "faults": ["F50-stop"], "fault_values": [163.2]})
        live.show({**stopped, "faults": ["F50-stop", "F31-stop", "F60-late"], "fault_values": [None, 251.0, None]})
        said = os.read(to_pipe, 65536).decode().splitlines()
        assert said[0] == "F50-stop the force is above the limit: 163 N, limit 150 N -> STOP"
        assert len(said) == 2
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


class Screen:
    """What a terminal shows. `wraps`: it lays long lines out anew when its width changes, and takes the cursor along
    (VTE, kitty, tmux); otherwise it cuts them off (xterm)."""

    def __init__(self, columns, *, wraps):
        self.columns, self.wraps = columns, wraps
        self.lines, self.line, self.column = [""], 0, 0

    def write(self, text):
        while text:
            if text.startswith("\x1b[J"):
                del self.lines[self.line + 1 :]
                self.lines[self.line] = self.lines[self.line][: self.column]
                text = text[3:]
                continue
            letter, text = text[0], text[1:]
            if letter == "\r":
                self.column -= self.column % self.columns if self.wraps else self.column
            elif letter == "\n":
                self.line, self.column = self.line + 1, 0
                self.lines += [""] * (self.line + 1 - len(self.lines))
            else:
                assert self.column % self.columns < self.columns - 1 or self.column == 0, "the last column is free"
                row = self.lines[self.line].ljust(self.column)
                self.lines[self.line] = row[: self.column] + letter + row[self.column + 1 :]
                self.column += 1

    def resize(self, columns):
        self.columns = columns
        if not self.wraps:
            self.lines = [row[:columns] for row in self.lines]

    @property
    def rows(self):
        return [row.rstrip() for row in self.lines if row.strip()]


WIDTHS = [(132, 40), (132, 80), (80, 132), (40, 132), (132, 30, 132), (80, 20, 80, 200)]


@pytest.mark.parametrize("wraps", [True, False])
@pytest.mark.parametrize("widths", WIDTHS)
def test_a_terminal_that_is_made_wider_or_narrower_keeps_one_line_and_no_ghost(widths, wraps):
    ours, theirs = pty.openpty()
    os.set_blocking(ours, False)
    screen = Screen(widths[0], wraps=wraps)
    with os.fdopen(theirs, "w") as stderr, contextlib.redirect_stderr(stderr):
        live = LiveLine(load_rig("emulated"))

        def show(act, *, last):
            act()
            written, deadline_s = "", time.monotonic() + 5.0
            while not written.endswith(last):
                assert time.monotonic() < deadline_s
                with contextlib.suppress(BlockingIOError):
                    written += os.read(ours, 65536).decode()
            screen.write(written.replace("\r\n", "\n"))

        show(lambda: live.say("the line before"), last="\n")
        for n, columns in enumerate(widths):
            resize(theirs, columns)
            screen.resize(columns)
            show(lambda n=n: live.show({**STATUS, "progress_m": 0.01 * n}, keys=True), last="\r")
            before, line = screen.rows
            assert before == "the line before"[: min(widths[: n + 1])] if not wraps else before == "the line before"
            assert line.startswith(f"PUSH  0.0{n}/2.00 m")
            assert len(line) < columns
        show(live.end, last="\n")
        assert [row.split("  ")[0] for row in screen.rows[1:]] == ["PUSH"]
    os.close(ours)


@pytest.mark.parametrize("columns", [20, 40, 80, 132, 0])
def test_it_stays_one_line_on_any_terminal(columns):
    """A line as wide as the terminal would wrap, and could not be rewritten; 0 columns: the terminal does not say."""
    ours, theirs = pty.openpty()
    with os.fdopen(theirs, "w") as stderr, contextlib.redirect_stderr(stderr):
        resize(theirs, columns)
        live = LiveLine(load_rig("emulated"))
        live.show({**STATUS, "phase": "APPROACH"}, keys=True)
        live.say("a word")
        shown = b""
        while not shown.endswith(b"\n"):  # a terminal hands over in pieces
            shown += os.read(ours, 65536)
    os.close(ours)
    rewritten = shown.decode().replace("\x1b[J", "").strip().split("\r")
    assert max(len(part) for part in rewritten) < (columns or 80)
    assert rewritten[0].startswith("APPROACH  0.50/2.00 m"[: (columns or 80) - 1])
    assert rewritten[-1] == "a word"


def live_line(*, room=79, keys=True, silent_s=0.0, **status):
    return live_text(load_rig("emulated"), STATUS | status, keys=keys, silent_s=silent_s, room=room)


def test_eighty_columns_name_the_keys_and_the_figures_that_matter():
    line = live_line()
    assert line == "PUSH  0.50/2.00 m  off -0.012 m  13.0/150 N  space pauses, other keys stop"
    assert live_line(room=131).endswith("other keys stop  v 0.10 m/s  theta_p +5.7 deg")
    assert live_line(keys=False, room=79).endswith("13.0/150 N  v 0.10 m/s  theta_p +5.7 deg")
    assert live_line(mode="SLOW", phase="APPROACH").startswith("APPROACH SLOW  0.50/2.00 m")
    assert live_line(mode="SLOW", phase="APPROACH").endswith("space pauses, other keys stop")


def test_the_keys_are_those_of_the_moment():
    assert "PUSH PAUSED" in live_line(paused=True, mode="HOLD")
    assert "space goes on, other keys stop" in live_line(paused=True, mode="HOLD")
    assert "r resumes, space pauses, others stop" in live_line(phase="LOST_HOLD", mode="HOLD")


def test_what_is_old_is_marked():
    assert "13.0/150 N (old)" in live_line(old=["force"])
    assert "0.50/2.00 m (old)" in live_line(old=["pose"], room=None)
    assert "off -0.012 m (old)" in live_line(old=["pose"], room=None)
    assert live_line(silent_s=3.2).startswith("PUSH  OLD: no news for 3 s  0.50/2.00 m")


def read_to_mark(fd):
    """Read to a line that ends in "-": a terminal hands over in pieces."""
    shown = b""
    while not shown.endswith(b"-\r\n"):
        shown += os.read(fd, 65536)
    return shown


def test_a_line_without_news_is_marked_as_old(monkeypatch):
    now = [100 * NS_PER_S]
    monkeypatch.setattr("tools.terminal.live_line.monotonic_ns", lambda: now[0])
    ours, theirs = pty.openpty()
    with os.fdopen(theirs, "w") as stderr, contextlib.redirect_stderr(stderr):
        live = LiveLine(load_rig("emulated"))
        live.mark_old()
        live.show(STATUS)
        now[0] += NS_PER_S
        live.mark_old()
        live.say("-")
        assert b"OLD" not in read_to_mark(ours)
        live.show(STATUS)
        now[0] += 2 * NS_PER_S
        live.mark_old()
        live.say("-")
        assert b"OLD: no news for 2 s" in read_to_mark(ours)
    os.close(ours)


def test_a_terminal_that_cannot_rewrite_gets_a_line_a_second(monkeypatch):
    monkeypatch.setenv("TERM", "dumb")
    ours, theirs = pty.openpty()
    with os.fdopen(theirs, "w") as stderr, contextlib.redirect_stderr(stderr):
        live = LiveLine(load_rig("emulated"))
        for _ in range(5):
            live.show(STATUS)
        live.end()
        live.say("-")
        shown = read_to_mark(ours).decode()
    os.close(ours)
    assert "\x1b" not in shown
    assert len(shown.splitlines()) == 2


def test_a_stopped_terminal_holds_nobody_up():
    ours, theirs = pty.openpty()
    with os.fdopen(theirs, "w") as stderr, contextlib.redirect_stderr(stderr):
        live = LiveLine(load_rig("emulated"))
        live.show(STATUS)
        assert os.read(ours, 65536).startswith(b"\r\x1b[J")
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
