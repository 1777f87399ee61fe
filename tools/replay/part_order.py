"""Whether the parts of a log follow each other: each names the last tick of the one before."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from robot_io.errors import LogDamaged
from tools.log.run_parts import BEFORE_FACT, PART_FACT
from tools.replay.verified_log import VerifiedLog

_LAST_TICK = "last_tick_crc32"


def in_order(logs: Sequence[VerifiedLog]) -> None:
    """Raise LogDamaged unless each part goes on where the one before it ended."""
    for before, part in pairwise(logs):
        numbers = before.facts.get(PART_FACT, "?"), part.facts.get(PART_FACT, "?")
        follows = numbers[0].isdecimal() and numbers[1] == str(int(numbers[0]) + 1)
        # A part that was recovered has lost its end, and does not know which tick was the last.
        if follows and before.complete:
            follows = part.facts.get(BEFORE_FACT) == before.end_facts.get(_LAST_TICK)
        if not follows:
            what = f"it does not go on where {before.path.name} ends"
            raise LogDamaged(what, where=str(part.path), do="Replay each part by itself")
