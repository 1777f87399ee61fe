"""The operator's display during a run: one line, rewritten on a terminal, once a second elsewhere; faults in full."""

from __future__ import annotations

import os
import select
import stat
import sys
from typing import Any

from robot_io.clock import NS_PER_S, monotonic_ns
from robot_io.rig.config import RigConfig
from tools.terminal.live_text import live_text
from tools.verdict.first_cause import fault_words, limit_and_unit, stronger_than

USUAL_COLUMNS = 80
"""Width assumed if the terminal does not report it."""


CLEAR = "\r\x1b[J"
"""To the start of the line, and nothing behind it on the screen."""
NEWS_NS = NS_PER_S
"""Control reports five times a second: without news for longer, what is shown is marked as old."""
NO_REWRITING = ("dumb", "")


class LiveLine:
    """Prints to stderr; never waits and never raises if nobody reads it.

    On a terminal the cursor stays at the start of the line. A terminal that is made narrower wraps the line and takes
    the cursor along with its first letter, so that all of it is behind the cursor and can be cleared.
    """

    def __init__(self, rig: RigConfig) -> None:
        self._rig = rig
        self._terminal = sys.stderr is not None and sys.stderr.isatty() and os.environ.get("TERM") not in NO_REWRITING
        self._fd = _without_waiting()
        self._last_ns = 0
        self._status: dict[str, Any] = {}
        self._keys = self._shown = False
        self._faults: tuple[str, ...] = ()

    def show(self, status: dict[str, Any], *, keys: bool = False) -> None:
        """Show one status event of control; `keys`: whether the operator's keys are heard."""
        self._tell_faults(status)
        now_ns = monotonic_ns()
        if not self._terminal and now_ns - self._last_ns < NS_PER_S:
            return
        self._last_ns, self._status, self._keys = now_ns, status, keys
        if self._terminal:
            self._rewrite(keys=keys)
        else:
            self._write(live_text(self._rig, status, keys=False, silent_s=0.0, room=None) + "\n")

    def mark_old(self) -> None:
        """Mark what is shown as old if it is; to be called now and then while control may be silent."""
        silent_ns = monotonic_ns() - self._last_ns
        if self._shown and silent_ns > NEWS_NS:
            self._rewrite(keys=self._keys, silent_s=silent_ns / NS_PER_S)

    def _tell_faults(self, status: dict[str, Any]) -> None:
        """Tell each new fault; behind the first cause of a stop only what asks for more than it: the rest follows."""
        first, found = status["first_fault"], dict(zip(status["faults"], status["fault_values"], strict=True))
        if first:
            found = {first: status["first_value"]} | {i: found[i] for i in stronger_than(first, list(found))}
        for fault, value in found.items():
            if fault not in self._faults:
                words = fault_words(fault, value, *limit_and_unit(self._rig, fault))
                self.say(f"{words} -> {status['mode']}")
        self._faults = tuple(found)

    def say(self, text: str) -> None:
        """Print a separate line."""
        self._write(f"{CLEAR if self._shown else ''}{text}\n")
        self._shown = False

    def end(self) -> None:
        """Move on to a new line."""
        if self._shown:
            self._rewrite(keys=False)
            self._write("\n")
            self._shown = False

    def close(self) -> None:
        """Release its descriptor; later lines go to stderr as it is. Idempotent."""
        if self._fd >= 0:
            os.close(self._fd)
            self._fd = -1

    def _rewrite(self, *, keys: bool, silent_s: float = 0.0) -> None:
        """Write the newest status over the line. Cut to fit: a wrapped line would fill the screen."""
        text = live_text(self._rig, self._status, keys=keys, silent_s=silent_s, room=self._room())
        self._write(f"{CLEAR}{text}\r")
        self._shown = True

    @staticmethod
    def _room() -> int:
        """Return how many characters fit before the terminal's right edge; it may be resized at any time."""
        try:
            columns = os.get_terminal_size(sys.stderr.fileno()).columns
        except (OSError, AttributeError, ValueError):
            columns = 0
        return (columns or USUAL_COLUMNS) - 1

    def _write(self, text: str) -> None:
        """Write what the terminal or pipe takes now; the rest is lost.

        While the launcher waits for the terminal, it cannot receive the operator's stop.
        """
        try:
            if self._fd >= 0:
                os.write(self._fd, text.encode(errors="replace"))
            elif not self._would_block():
                sys.stderr.write(text)
                sys.stderr.flush()
        except (OSError, AttributeError, ValueError):
            return

    def _would_block(self) -> bool:
        """Return whether a write would block now."""
        poll = select.poll()
        poll.register(sys.stderr.fileno(), select.POLLOUT)
        return not poll.poll(0)


def _without_waiting() -> int:
    """Return a descriptor of its own on stderr's terminal or pipe, on which nothing waits; -1 where that is neither.

    Setting stderr itself so would also set it so for the shell that shares it.
    """
    try:
        fd = sys.stderr.fileno()
        if not (os.isatty(fd) or stat.S_ISFIFO(os.fstat(fd).st_mode)):
            return -1
        return os.open(f"/proc/self/fd/{fd}", os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC)
    except (OSError, AttributeError, ValueError):
        return -1
