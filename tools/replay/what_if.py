"""Run the ticks of a log with other settings, and find where their outputs differ from those with the log's own.

Open loop: the inputs stay those of the log. Until the safe command or the mode first differs they are what the robot
would have sent with the other settings, too, and the answer is exact; from there on the measurements do not follow the
commands. The state is carried on throughout: a stop that only the other settings latch stays latched.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import msgspec

from robot_io.errors import ConfigError
from robot_io.mcap.files import files_of
from robot_io.rig.config import RigConfig
from robot_io.tick import ControlTick, Phase
from safety import limits
from tools.replay.law import core_maker
from tools.replay.verified_log import VerifiedLog, in_order
from tools.replay.what_if_keys import other_rig
from tools.replay.what_if_sides import PARTS, Change, End, OtherFault, Part, PartResult, Side, parts_of
from tools.run.tick_core import TickCore

_REACHES_THE_ROBOT = ("command", "mode", "end")


class First(msgspec.Struct, frozen=True):
    """The first tick in which anything differs; at_s counts from the log's first tick, the phase is the log's."""

    tick: int
    at_s: float
    phase: str
    parts: tuple[str, ...]


class WhatIfResult(msgspec.Struct, frozen=True):
    """How the outputs of a log differ with other settings; `tick` numbers are those of the log."""

    settings: tuple[str, ...]
    ticks: int
    """How many were compared."""
    changed: int
    """In how many of them anything differs."""
    first: First | None
    exact_to_tick: int | None
    """Up to here the answer is exact: the first tick with another safe command, mode or end than the log has, because
    of the settings or of today's program; None if there is none."""
    parts: dict[str, PartResult]
    new_faults: tuple[OtherFault, ...]
    missing_faults: tuple[OtherFault, ...]
    log_end: End | None
    what_if_end: End | None
    not_run: int
    """Ticks of the log behind the end of the run with the other settings."""
    notes: tuple[str, ...]


class WhatIf:
    """Compares the outputs of ticks, given in order, with two rigs' settings."""

    def __init__(self, own: TickCore, other: TickCore) -> None:
        self._own, self._other = Side(own), Side(other)
        self._parts = {name: Part() for name in PARTS}
        self._last: int | None = None
        self._first_ns = 0
        self._state_known = True
        self._ticks = self._changed = self._not_run = 0
        self._first: First | None = None
        self._log_end: End | None = None
        self._other_code_from: int | None = None
        self._notes: list[str] = []

    def take(self, tick: ControlTick) -> None:
        """Take the next tick."""
        if self._last is None:
            self._first_ns = tick.input.now_ns
        if tick.output.finished:
            self._log_end = End(tick.input.tick, self._at_s(tick), tick.output.exit_code)
        if self._other.end is not None:
            self._not_run += 1
        elif self._state_known and self._find_state(tick):
            self._compare(tick)
        self._last = tick.input.tick

    def result(self, settings: Sequence[str], notes: Sequence[str] = ()) -> WhatIfResult:
        """Return what was found. notes: said in front of those of the comparison."""
        parts = {name: part.result() for name, part in self._parts.items()}
        reached = [first.tick for name in _REACHES_THE_ROBOT if (first := parts[name].first)]
        if self._other_code_from is not None:
            reached.append(self._other_code_from)
        return WhatIfResult(
            tuple(settings),
            self._ticks,
            self._changed,
            self._first,
            min(reached, default=None),
            parts,
            self._other.faults_not_in(self._own),
            self._own.faults_not_in(self._other),
            self._log_end,
            self._other.end,
            self._not_run,
            (*notes, *self._notes),
        )

    def _at_s(self, tick: ControlTick) -> float:
        return round((tick.input.now_ns - self._first_ns) / 1e9, 3)

    def _find_state(self, tick: ControlTick) -> bool:
        """Take the state from the log at its start and after a gap; return False where nobody knows it any more."""
        number = tick.input.tick
        if self._last is not None and number == self._last + 1 + tick.input.host.skipped:
            return True
        if tick.before and self._own.remembers_the_same(self._other):
            self._own.state = self._other.state = tick.before[0]
            return True
        self._state_known = False
        self._notes.append(
            f"ticks are missing before tick {number}: the state with the other settings is not known there, "
            "so nothing was compared from there on"
        )
        return False

    def _compare(self, tick: ControlTick) -> None:
        number = tick.input.tick
        at_s = self._at_s(tick)
        own = parts_of(self._own.run(tick.input, at_s))
        other = parts_of(self._other.run(tick.input, at_s))
        self._ticks += 1
        if self._other_code_from is None and own != parts_of(tick.output):
            self._other_code_from = number
            self._notes.append(
                f"today's program does not compute the outputs of the log itself (from tick {number} on; see "
                "`push replay` without --what-if): both settings were run with today's program"
            )
        different = tuple(name for name in PARTS if own[name] != other[name])
        for name in different:
            self._parts[name].take(Change(number, at_s, own[name], other[name]))
        if different:
            self._changed += 1
            phase = Phase(self._own.state.control.phase).name
            self._first = self._first or First(number, at_s, phase, different)


def what_if(path: Path, settings: Sequence[str], *, law: str = "") -> WhatIfResult:
    """Run the ticks of a log with `key=value` settings laid over its rig.

    Raises UsageError for keys that cannot change a replay, ConfigError for values that no rig can have, and as
    `VerifiedLog` for the log. law: `module:Class` of its law where that is not a shipped one; raises as `law_of`.
    """
    logs = [VerifiedLog(file) for file in files_of(path)]
    in_order(logs)
    for log in logs:
        log.require_config()
    log = logs[0]
    rig = log.usable_rig()
    core_of = core_maker(path, rig.control, law, in_contact=log.in_contact)
    other = other_rig(rig, settings, core_of)
    found = WhatIf(core_of(rig), core_of(other))
    for part in logs:
        for _, _, _, tick in part.messages():
            if tick is not None:
                found.take(tick)
    return found.result(settings, _refusals(other))


def _refusals(rig: RigConfig) -> list[str]:
    """Return a note where a run would not start with these settings."""
    try:
        limits.check(rig)
    except ConfigError as error:
        return [f"`push run` would refuse these settings: {error.what}"]
    return []
