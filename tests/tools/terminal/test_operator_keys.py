"""The operator's keys on a real terminal: what each does, and how they go and come with the foreground."""

from __future__ import annotations

import os
import pty
import sys
import termios
import time

import pytest

from robot_io.ipc.event_loop import EventLoop
from tools.terminal import operator_keys
from tools.terminal.operator_keys import OperatorKeys


class Desk:
    """A terminal as stdin, keys that note what was asked, and a shell that may take the terminal away."""

    def __init__(self, monkeypatch):
        self.ours, self.theirs = pty.openpty()
        self.stdin = os.fdopen(self.theirs, "r")
        monkeypatch.setattr(sys, "stdin", self.stdin)
        self.background = False
        monkeypatch.setattr(operator_keys, "_in_background", lambda _: self.background)
        self.before = termios.tcgetattr(self.theirs)
        self.loop = EventLoop()
        self.asked = []
        self._keys = None

    def keys(self):
        self._keys = OperatorKeys(
            self.loop,
            lambda: self.asked.append("stop"),
            lambda: self.asked.append("resume"),
            lambda: self.asked.append("pause"),
        )
        return self._keys

    def close_keys(self):
        if self._keys is not None:
            self._keys.close()
            self._keys = None

    def until(self, done):
        deadline_s = time.monotonic() + 10.0
        while not done():
            assert time.monotonic() < deadline_s, self.asked
            self.loop.run_once(20)

    def type(self, keys, *asked):
        self.asked.clear()
        os.write(self.ours, keys)
        self.until(lambda: len(self.asked) >= len(asked))
        assert self.asked == list(asked)

    def cooked(self):
        return termios.tcgetattr(self.theirs) == self.before


@pytest.fixture
def desk(monkeypatch):
    desk = Desk(monkeypatch)
    yield desk
    desk.close_keys()
    desk.loop.close()
    desk.stdin.close()
    os.close(desk.ours)


def test_space_pauses_r_resumes_and_every_other_key_stops(desk):
    assert desk.keys().heard
    desk.type(b" ", "pause")
    desk.type(b"rR", "resume", "resume")
    for key in (b"x", b"q", b"\n", b"\x1b", b"\x04"):
        desk.type(key, "stop")
    desk.close_keys()
    assert desk.cooked()


def test_a_run_that_began_in_the_background_hears_keys_after_fg(desk):
    desk.background = True
    assert not desk.keys().heard
    assert desk.cooked()
    desk.background = False  # fg: no signal says so
    desk.until(lambda: desk._keys.heard)
    desk.type(b" x", "pause", "stop")
    desk.close_keys()
    assert desk.cooked()


def test_in_the_background_again_the_terminal_is_the_shells(desk):
    desk.keys()
    desk.background = True
    desk.until(lambda: not desk._keys.heard)
    shells = termios.tcgetattr(desk.theirs)
    shells[3] |= termios.ICANON | termios.ECHO
    termios.tcsetattr(desk.theirs, termios.TCSANOW, shells)
    os.write(desk.ours, b"ls\n")
    for _ in range(20):
        desk.loop.run_once(20)
    assert desk.asked == []
    assert termios.tcgetattr(desk.theirs)[:4] == shells[:4]
    assert os.read(desk.theirs, 64) == b"ls\n"
    desk.background = False
    desk.until(lambda: desk._keys.heard)
    desk.type(b" ", "pause")


def test_what_was_typed_before_the_keys_were_heard_stops_nothing(desk):
    os.write(desk.ours, b"push report\n")
    desk.keys()
    desk.type(b" ", "pause")
