"""The terminal of `push watch`: a picture that is redrawn in place, keys, and signals that end it."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import termios
import tty
from types import FrameType, TracebackType
from typing import Any, Self

from tools.watch.screen import Line

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGTSTP)
"""All of them end it. Suspended by Ctrl-Z it would keep the devices and show nothing."""
COLUMNS, ROWS = 80, 24
_ALTERNATE, _NORMAL = "\x1b[?1049h\x1b[?25l", "\x1b[?25h\x1b[?1049l"
_STYLES = {"title": "\x1b[1m", "sign": "\x1b[1;30;46m", "bad": "\x1b[1;31m", "faint": "\x1b[2m"}
_PLAIN_STYLES = {"title": "\x1b[1m", "sign": "\x1b[1;7m", "bad": "\x1b[1;4m"}
"""Without colour (NO_COLOR): bold, inverse and underlined."""


class Signals:
    """Notes the signals that end the program; `asked` says whether one has come. `with` restores the handlers.

    The descriptor of `fileno` is readable when one came, or when the terminal was resized.
    """

    def __enter__(self) -> Self:
        self._pipe = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
        self._wakeup = signal.set_wakeup_fd(self._pipe[1])
        numbers = (*SIGNALS, signal.SIGWINCH)
        self._handlers = [(number, signal.signal(number, _note)) for number in numbers]
        self.asked = False
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        signal.set_wakeup_fd(self._wakeup)
        for number, handler in self._handlers:
            signal.signal(number, handler)
        for fd in self._pipe:
            os.close(fd)

    def fileno(self) -> int:
        """Return the descriptor to wait for."""
        return self._pipe[0]

    def take(self) -> None:
        """Take in what came."""
        with contextlib.suppress(BlockingIOError):
            self.asked = self.asked or any(number in SIGNALS for number in os.read(self._pipe[0], 64))


class Terminal:
    """The screen and the keys of a terminal; `with` gives them back as they were."""

    def __init__(self) -> None:
        self._colour = not os.environ.get("NO_COLOR")
        self.unicode = "utf" in (sys.stdout.encoding or "").lower()

    @staticmethod
    def is_there() -> bool:
        """Return whether both stdin and stdout are a terminal that can be drawn on, and is not that of another job."""
        try:
            if not (sys.stdin.isatty() and sys.stdout.isatty()) or os.environ.get("TERM") == "dumb":
                return False
        except (AttributeError, ValueError):  # closed
            return False
        try:
            return os.tcgetpgrp(sys.stdin.fileno()) == os.getpgrp()
        except OSError:  # it controls no session, and has no jobs
            return True

    def __enter__(self) -> Self:
        self._stdin = sys.stdin.fileno()
        self._before: list[Any] = termios.tcgetattr(self._stdin)
        tty.setcbreak(self._stdin)
        self._write(_ALTERNATE)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._write(_NORMAL)
        with contextlib.suppress(termios.error):  # the terminal is gone
            termios.tcsetattr(self._stdin, termios.TCSANOW, self._before)

    def fileno(self) -> int:
        """Return the descriptor that is readable when a key was pressed."""
        return self._stdin

    def keys(self) -> str:
        """Return the keys that were pressed; "q" also when the terminal is closed."""
        try:
            return os.read(self._stdin, 64).decode(errors="replace") or "q"
        except OSError:
            return "q"

    @staticmethod
    def columns() -> int:
        """Return the width of the terminal as it is now."""
        return _size().columns

    def draw(self, lines: list[Line]) -> None:
        """Draw the picture over the last one; what does not fit below the last row is left out."""
        rows = _size().lines
        styles = _STYLES if self._colour else _PLAIN_STYLES
        shown = [f"{styles[style]}{text}\x1b[0m" if style in styles else text for text, style in lines[:rows]]
        self._write("\x1b[H" + "\x1b[K\n".join(shown) + "\x1b[K\x1b[J")

    @staticmethod
    def _write(text: str) -> None:
        with contextlib.suppress(OSError, ValueError):  # the terminal is closed; SIGHUP arrives as well
            sys.stdout.write(text)
            sys.stdout.flush()


def _size() -> os.terminal_size:
    """Return what the terminal itself says: COLUMNS and LINES of the environment do not follow a resize."""
    try:
        size = os.get_terminal_size(sys.stdout.fileno())
    except (OSError, ValueError):  # it was closed
        return os.terminal_size((COLUMNS, ROWS))
    return size if size.columns and size.lines else os.terminal_size((COLUMNS, ROWS))


def _note(_number: int, _frame: FrameType | None) -> None:
    """Do nothing: the byte in the wake-up pipe is the event."""
