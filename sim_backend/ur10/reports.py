"""What the controller reports to the clients of its primary port as it happens."""

from __future__ import annotations

import msgspec

STARTED = "PROGRAM_XXX_STARTED"
STOPPED = "PROGRAM_XXX_STOPPED"


class TextReport(msgspec.Struct, frozen=True):
    """A program's `textmsg`."""

    text: str


class KeyReport(msgspec.Struct, frozen=True):
    """A program started or stopped: `title` says which, `text` names the program."""

    title: str
    text: str


class ProgramError(msgspec.Struct, frozen=True):
    """A program that cannot be compiled, or ended by an error. Lines and columns count from 1."""

    line: int
    column: int
    text: str


class ErrorCode(msgspec.Struct, frozen=True):
    """A numbered fault of the robot, CxxxAy: code, argument, and 2 for a warning, 3 for a fault."""

    code: int
    argument: int
    level: int
    text: str


class SafetyModeReport(msgspec.Struct, frozen=True):
    """The safety mode changed."""

    mode: int


Report = TextReport | KeyReport | ProgramError | ErrorCode | SafetyModeReport
