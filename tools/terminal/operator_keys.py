"""The operator's signals and keys, as events of an event loop."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import termios
import tty
from collections.abc import Callable
from types import FrameType
from typing import Any

from robot_io.clock import NS_PER_S
from robot_io.ipc.event_loop import EventLoop

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGTSTP)
"""The signals of Ctrl-C, Ctrl-\\ and Ctrl-Z are among them and count as keys. A launcher suspended by Ctrl-Z would
receive no key while the base keeps pushing."""


BACKGROUND = (signal.SIGTTOU, signal.SIGTTIN)
"""They would suspend a launcher in the background (`push run ... &`) as soon as it touches its terminal."""


LOOK_NS = NS_PER_S // 5
"""How often it is looked whether the shell has given or taken the terminal (`fg`): no signal says so."""


class OperatorKeys:
    """Calls `on_stop` for a signal or a key, `on_resume` for r, `on_pause` for space; restores everything on `close`.

    In the background there are signals only: the keys are the shell's. They come back with the foreground.
    """

    def __init__(
        self, loop: EventLoop, on_stop: Callable[[], None], on_resume: Callable[[], None], on_pause: Callable[[], None]
    ) -> None:
        self._loop = loop
        self._on_stop, self._on_resume, self._on_pause = on_stop, on_resume, on_pause
        self._pipe = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
        # The pipe first: a signal between the two calls would be lost.
        self._wakeup = signal.set_wakeup_fd(self._pipe[1])
        self._handlers = [signal.signal(number, _note) for number in SIGNALS]
        self._ignored = [signal.signal(number, signal.SIG_IGN) for number in BACKGROUND]
        loop.add_fd(self._pipe[0], self._on_signal)
        self._terminal: list[Any] | None = None
        """How the terminal was before its keys were heard one by one; None while they are not heard."""
        self._stdin = -1
        with contextlib.suppress(OSError, ValueError, AttributeError):
            if sys.stdin.isatty():
                self._stdin = sys.stdin.fileno()
        self._look()
        self._timer = loop.call_every(LOOK_NS, lambda _: self._look())

    @property
    def heard(self) -> bool:
        """Return whether keys are heard now."""
        return self._terminal is not None

    def close(self) -> None:
        """Restore handlers and terminal."""
        self._timer.cancel()
        if self._terminal is not None and not _in_background(self._stdin):
            with contextlib.suppress(termios.error):  # the terminal is closed
                # NOW, not DRAIN: on a stopped terminal DRAIN would wait forever.
                termios.tcsetattr(self._stdin, termios.TCSANOW, self._terminal)
        self._leave()
        signal.set_wakeup_fd(self._wakeup)
        for number, handler in zip((*SIGNALS, *BACKGROUND), (*self._handlers, *self._ignored), strict=True):
            signal.signal(number, handler)
        self._loop.remove_fd(self._pipe[0])
        for fd in self._pipe:
            os.close(fd)

    def _look(self) -> None:
        """Hear keys in the foreground only."""
        if self._stdin < 0:
            return
        if _in_background(self._stdin):
            self._leave()
        elif not self.heard:
            with contextlib.suppress(OSError, termios.error):
                before = termios.tcgetattr(self._stdin)
                tty.setcbreak(self._stdin, termios.TCSANOW)
                termios.tcflush(self._stdin, termios.TCIFLUSH)  # what was typed before was meant for the shell
                self._loop.add_fd(self._stdin, self._on_key)
                self._terminal = before

    def _leave(self) -> None:
        """Hear no keys any more. The terminal stays as it is: in the background it is the shell's."""
        if self._terminal is not None:
            self._loop.remove_fd(self._stdin)
            self._terminal = None

    def _on_signal(self, _events: int) -> None:
        with contextlib.suppress(BlockingIOError):
            for number in os.read(self._pipe[0], 64):
                if number in SIGNALS:
                    self._on_stop()

    def _on_key(self, _events: int) -> None:
        try:
            key = os.read(self._stdin, 1)
        except OSError:  # the shell has taken the terminal, or it is closed: then SIGHUP arrives as well
            key = b""
        if not key:
            self._leave()
            self._stdin = self._stdin if _in_background(self._stdin) else -1
        elif key in (b"r", b"R"):
            self._on_resume()
        elif key == b" ":
            self._on_pause()
        else:
            self._on_stop()


def _in_background(terminal: int) -> bool:
    """Return whether another job of the shell has the terminal; one that controls no session has no jobs."""
    try:
        return os.tcgetpgrp(terminal) != os.getpgrp()
    except OSError:
        return False


def _note(_number: int, _frame: FrameType | None) -> None:
    """Do nothing: the byte in the wake-up pipe is the event."""
