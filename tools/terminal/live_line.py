"""The operator's display during a run: one line, rewritten on a terminal, once a second elsewhere; faults in full."""

from __future__ import annotations

import math
import os
import select
import stat
import sys
import time
from typing import Any

from robot_io.rig.config import RigConfig
from tools.verdict.first_cause import fault_words, limit_and_unit, stronger_than

USUAL_COLUMNS = 80
"""Width assumed if the terminal does not report it."""


class LiveLine:
    """Prints to stderr; never waits and never raises if nobody reads it."""

    def __init__(self, rig: RigConfig, *, quiet: bool = False) -> None:
        self._rig = rig
        self._quiet = quiet
        self._terminal = sys.stderr is not None and sys.stderr.isatty()
        self._fd = _without_waiting()
        self._last_s = 0.0
        self._width = 0
        self._faults: tuple[str, ...] = ()

    def show(self, status: dict[str, Any]) -> None:
        """Show one status event of control."""
        self._tell_faults(status)
        if self._quiet:
            return
        now_s = time.monotonic()
        if not self._terminal and now_s - self._last_s < 1.0:
            return
        self._last_s = now_s
        line = self._line(status)
        if self._terminal:
            # Cut to fit: a wrapped line cannot be rewritten and would fill the screen.
            room = self._room()
            line = line[:room]
            self._write(f"\r{line:<{min(self._width, room)}}")
            self._width = len(line)
        else:
            self._write(line + "\n")

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
        if self._terminal and self._width:
            self._write("\r" + " " * min(self._width, self._room()) + "\r")
            self._width = 0
        self._write(text + "\n")

    def end(self) -> None:
        """Move on to a new line."""
        if self._terminal and self._width:
            self._write("\n")
            self._width = 0

    def close(self) -> None:
        """Release its descriptor; later lines go to stderr as it is. Idempotent."""
        if self._fd >= 0:
            os.close(self._fd)
            self._fd = -1

    def _line(self, status: dict[str, Any]) -> str:
        # JSON has no NaN: a figure that is not known yet (no pose so far), or no number, is sent as null.
        status = {key: math.nan if value is None else value for key, value in status.items()}
        fx, fy, _ = (math.nan if value is None else value for value in status["force_N"])
        control = self._rig.control
        return (
            f"{status['phase']:<9} {status['progress_m']:6.2f}/{control.distance_m:.2f} m  {status['mode']:<7}"
            f"  off {status['lateral_m']:+.3f} m  |F| {math.hypot(fx, fy):5.1f}/{self._rig.limits.max_force_N:.0f} N"
            f"  v {status['speed']:.2f} m/s  theta_p {math.degrees(status['theta_p']):+6.1f} deg"
        )

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
