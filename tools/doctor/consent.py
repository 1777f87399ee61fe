"""The one question before a real robot moves."""

from __future__ import annotations

import sys

from robot_io.errors import OperatorStop
from robot_io.rig.config import RigConfig


def ask_once(rig: RigConfig, question: str) -> None:
    """Ask on the terminal before a real robot moves; nothing is asked where none moves, or stdin is no terminal.

    Raises OperatorStop unless the answer is yes.
    """
    moves = rig.base.level == "hardware" or (rig.arm.level == "hardware" and rig.arm.hold == "servo")
    if not moves or sys.stdin is None or not sys.stdin.isatty():
        return
    print(f"Is the floor clear, and the e-stop in a hand? {question} [y/N] ", end="", file=sys.stderr, flush=True)
    if sys.stdin.readline().strip().lower() not in ("y", "yes"):
        raise OperatorStop("not started: the question was not answered with yes", where="command line")
