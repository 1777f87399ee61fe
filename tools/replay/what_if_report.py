"""The answer of a what-if as lines for people and as one object of JSON."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import msgspec

from robot_io.messages import BodyTwist
from tools.replay.what_if import WhatIfResult
from tools.replay.what_if_sides import End, OtherFault, PartResult

_NAMES = {
    "wanted": "wanted command",
    "command": "safe command",
    "mode": "mode",
    "faults": "faults",
}
_SHOWN = 5
OPEN_LOOP = "open loop: the log's measurements do not react to these settings"


def lines(result: WhatIfResult) -> Iterator[str]:
    """Yield the answer for people."""
    yield f"what if {', '.join(result.settings)}"
    yield OPEN_LOOP
    first = result.first
    where = f"; the first is tick {first.tick} at {first.at_s:.2f} s, in {first.phase}" if first else ""
    yield f"{result.changed} of {result.ticks} ticks would differ{where}"
    for name, words in _NAMES.items():
        yield f"  {words}: {_part_words(result.parts[name])}"
    yield from _fault_lines("with these settings only", result.new_faults, result.exact_to_tick)
    yield from _fault_lines("with the log's settings only", result.missing_faults, result.exact_to_tick)
    yield from _end_lines(result)
    if result.exact_to_tick is not None:
        yield (
            f"exact up to tick {result.exact_to_tick}, where the robot is first told something else; "
            "from there on open loop, because measurements do not follow the commands"
        )
    for note in result.notes:
        yield f"note: {note}"


def as_json(result: WhatIfResult) -> dict[str, Any]:
    """Return the answer as the `--json` object; velocities are [vx, vy, omega]."""
    plain: dict[str, Any] = msgspec.to_builtins(result)
    settings = plain.pop("settings")
    for name in ("wanted", "command"):
        first = plain["parts"][name]["first"]
        if first is not None:
            first.update({side: [_finite(x) for x in first[side].values()] for side in ("log", "what_if")})
    return {"schema": 1, "what_if": settings, "open_loop": True, **plain}


def _part_words(part: PartResult) -> str:
    first = part.first
    if first is None:
        return "the same in every tick"
    old, new = _beside(first.log, first.what_if)
    worst = f"; at most by {part.worst_m_per_s:.4f} m/s, in tick {part.worst_tick}" if part.worst_tick >= 0 else ""
    return f"differs in {part.ticks}, first in tick {first.tick}: {old} -> {new}{worst}"


def _fault_lines(where: str, faults: tuple[OtherFault, ...], exact_to: int | None) -> Iterator[str]:
    for fault in faults[:_SHOWN]:
        label = " (open loop)" if exact_to is not None and fault.tick > exact_to else ""
        yield f"  {where}{label}: {fault.text}, from tick {fault.tick} at {fault.at_s:.2f} s on"
    if len(faults) > _SHOWN:
        yield f"  {where}: {len(faults) - _SHOWN} more; --json lists all"


def _end_lines(result: WhatIfResult) -> Iterator[str]:
    log, other = result.log_end, result.what_if_end
    if log == other:
        return
    if log is not None and other is None:
        yield f"the run would go on where the log ends ({_end(log)}); what would follow is not known"
    elif other is not None:
        ended = "" if log is None else f", that of the log ended at {_end(log)}"
        yield f"the run would end at {_end(other)}{ended}"


def _end(end: End) -> str:
    return f"tick {end.tick}, {end.at_s:.2f} s, with exit code {end.exit_code}"


def _beside(old: Any, new: Any) -> tuple[str, str]:
    """Return both values in words; of velocities as many digits as it takes to tell them apart, three at least."""
    if isinstance(old, BodyTwist):
        for digits in range(3, 18):
            both = _velocity(old, digits), _velocity(new, digits)
            if both[0] != both[1]:
                break
        return both
    if isinstance(old, tuple):
        return ", ".join(old) or "none", ", ".join(new) or "none"
    return str(old), str(new)


def _velocity(twist: BodyTwist, digits: int) -> str:
    return f"({twist.vx:.{digits}f}, {twist.vy:.{digits}f}) m/s, {twist.omega:.{digits}f} rad/s"


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
