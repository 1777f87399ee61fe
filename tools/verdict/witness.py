"""What is known of a run beside control's own figures: whether its log is all there, and how the others ended."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec

from robot_io.errors import LogDamaged
from robot_io.mcap.files import files_of
from robot_io.mcap.write import MAGIC


class Witness(msgspec.Struct, frozen=True):
    """What the processes other than control say of a run.

    log: why the log is not complete, "" if it is. records_missing: records that are not in it. gate: how the gate
    failed, "" if it did not. unanswered: questions of the base's preflight that were not answered, None where there is
    no such count.
    """

    log: str = ""
    records_missing: int = 0
    gate: str = ""
    unanswered: int | None = None


def witness_of(log: Path, ticks: int, *, recorder: dict[str, Any] | str, gate: dict[str, Any] | str) -> Witness:
    """Return what recorder and gate say: what they reported at their end or, where they did not, how they ended.

    ticks: how many control has run.
    """
    counters = gate.get("counters", {}) if isinstance(gate, dict) else {}
    lost_gate = gate if isinstance(gate, str) else ""
    unanswered = counters.get("unanswered_checks")
    if isinstance(recorder, str):
        return Witness(recorder, 0, lost_gate, unanswered)
    missing = sum(recorder["dropped"].values()) + recorder["lost"] + recorder["undecodable"]
    return Witness(what_is_missing(log, recorder, ticks), missing, lost_gate, unanswered)


def what_is_missing(log: Path, recorder: dict[str, Any], ticks: int) -> str:
    """Return why the log is not complete, "" if nothing says so; the file itself has the last word."""
    if not recorder["complete"]:
        return "it could not be written to its end"
    if recorder["ticks"] < ticks:
        return f"it holds {recorder['ticks']} of {ticks} ticks"
    try:
        ends = [_end_of(file) for file in files_of(log)]
    except OSError as error:
        return f"it cannot be read: {error.strerror}"
    except LogDamaged as error:
        return error.what
    return "" if all(end == MAGIC for end in ends) else "its end is not that of a finished log"


def _end_of(path: Path) -> bytes:
    with path.open("rb") as file:
        file.seek(-len(MAGIC), 2)
        return file.read()
