"""The question between two trials: is the object back in its place?"""

from __future__ import annotations

import contextlib
import sys
import termios

from robot_io.error_report import tell

REAL = "Put the object back and clear the floor: the robot moves as soon as you press Enter (q ends): "
SIMULATED = "The simulated object is put back by itself. Enter goes on, q ends: "


def has_terminal() -> bool:
    """Return whether somebody can be asked."""
    return sys.stdin is not None and sys.stdin.isatty()


def goes_on(question: str) -> bool:
    """Ask on the terminal until there is an answer; True for Enter alone, False for q or a terminal that is gone.

    What was typed before is no answer: nobody has seen the question yet.
    """
    with contextlib.suppress(OSError, termios.error):
        termios.tcflush(sys.stdin.fileno(), termios.TCIFLUSH)
    while True:
        print(question, end="", file=sys.stderr, flush=True)
        try:
            answer = sys.stdin.readline()
        except (OSError, KeyboardInterrupt):
            answer = ""
        if answer.strip().lower() in ("q", "quit") or not answer:
            tell("")
            return False
        if not answer.strip():
            return True
