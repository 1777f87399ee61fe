"""From the text that a client uploads to something that runs."""

from __future__ import annotations

import re

from sim_backend.ur10.programs.control_script import CONTROL_SCRIPT_MARK, ControlScript
from sim_backend.ur10.programs.program import Program, ProgramRefused, Robot, ScriptError
from sim_backend.ur10.programs.script import Script

_HEAD = re.compile(r"\s*(?:def|sec)\s+(\w+)\s*\(")
UNNAMED = "unnamed"
"""What the controller calls a program that is a line."""


class OtherProgram:
    """A program of the pendant: it runs, does not move, and ends when it is stopped."""

    def __init__(self, name: str) -> None:
        self.name = name

    def step(self, robot: Robot, now_ns: int) -> bool:
        """See `Program.step`."""
        return True


def program_of(text: str) -> Program:
    """Return the program for an uploaded text. Raises ProgramRefused for one that this controller cannot run."""
    head = _HEAD.match(text)
    name = head.group(1) if head else UNNAMED
    try:
        if CONTROL_SCRIPT_MARK in text:
            return ControlScript(text)
        return Script(name, text)
    except ScriptError as error:
        raise ProgramRefused(name, error) from error
