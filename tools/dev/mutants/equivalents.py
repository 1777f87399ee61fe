"""Read the list of equivalent mutants, which no test can notice, each with the reason."""

from __future__ import annotations

import tomllib
from pathlib import Path

import msgspec


class Equivalent(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One entry: the mutant as printed, and why nothing observable changes."""

    path: str
    function: str
    """Qualified name, such as `Gate.step`; empty at module or class level."""
    before: str
    after: str
    reason: str

    @property
    def place(self) -> tuple[str, str, str, str]:
        """Identity shared with the mutant: path, function, before, after."""
        return self.path, self.function, self.before, self.after


class _Listed(msgspec.Struct, forbid_unknown_fields=True):
    equivalent: list[Equivalent] = []


class BadList(Exception):
    """The list is invalid; the message says why."""


def read_equivalents(file: Path) -> list[Equivalent]:
    """Return the entries of the list; raises BadList, also for a duplicate entry or one without a reason."""
    try:
        listed = msgspec.convert(tomllib.loads(file.read_text(encoding="utf-8")), _Listed).equivalent
    except (tomllib.TOMLDecodeError, msgspec.ValidationError) as error:
        raise BadList(str(error)) from None
    for i, entry in enumerate(listed):
        if len(entry.reason.split()) < 3:
            raise BadList(f"{entry.path}: {entry.before} -> {entry.after}: give the reason in a sentence")
        if entry.place in {other.place for other in listed[:i]}:
            raise BadList(f"{entry.path}: {entry.before} -> {entry.after}: listed twice")
    return listed
