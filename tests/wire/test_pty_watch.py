"""Who opens and closes the emulated sensor's port is told even where the next client is quicker than the emulator."""

from __future__ import annotations

import os
import pty
import termios

import pytest

from sim_backend.ft300.pty_watch import PtyWatch


class Port:
    """A pty with a watch; `opened` is what a client's open gives it."""

    def __init__(self):
        self.master, slave = pty.openpty()
        self.path = os.ttyname(slave)
        os.close(slave)
        self.watch = PtyWatch(self.path)

    def client(self):
        return os.open(self.path, os.O_RDWR | os.O_NOCTTY)


@pytest.fixture
def port():
    port = Port()
    yield port
    port.watch.close()
    os.close(port.master)


def test_one_that_only_opens_it_reopens_nothing(port):
    fd = port.client()
    assert not port.watch.reopened()
    os.close(fd)
    port.watch.nobody()
    fd = port.client()
    assert not port.watch.reopened()
    os.close(fd)


def test_a_close_and_an_open_at_once_are_told_once(port):
    fd = port.client()
    assert not port.watch.reopened()
    os.close(fd)
    fd = port.client()
    assert port.watch.reopened()
    assert not port.watch.reopened()
    os.close(fd)


def test_who_was_quicker_than_the_hang_up_is_told_by_the_next_look(port):
    """The one that stops the stream opens it, writes and closes it; the one behind asks: all since the last look."""
    fd = port.client()
    assert not port.watch.reopened()
    os.close(fd)
    fd = port.client()
    os.write(fd, b"\xff" * 50)
    os.close(fd)
    fd = port.client()
    port.watch.nobody()  # of the first one's hang-up
    assert port.watch.reopened()
    assert not port.watch.reopened()
    os.close(fd)


def test_what_a_client_left_unread_is_not_for_the_next_one(port):
    fd = port.client()
    termios.tcsetattr(fd, termios.TCSANOW, [0, 0, 0, 0, termios.B19200, termios.B19200, termios.tcgetattr(fd)[6]])
    os.write(port.master, b"left")
    os.close(fd)
    port.watch.nobody()
    fd = os.open(port.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    with pytest.raises(BlockingIOError):
        os.read(fd, 4)
    os.close(fd)
