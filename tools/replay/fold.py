"""Replay: fold a log's inputs again, and compare every byte of what comes out.

The first tick's state is the seed. Each tick's input is folded by today's code with the log's own config, and what
comes out is encoded and compared with what the log holds. The world of an emulated or simulated run is built again
too, fed with the commands that arrived then, and compared in the same way.
"""

from __future__ import annotations

from pathlib import Path

import msgspec

from robot_io.tick import TICK_CDR, ControlTick, TickState
from tools.replay.difference import Difference, difference
from tools.replay.verified_log import VerifiedLog
from tools.replay.world import PREFIX, WorldReplay, WorldReplayer
from tools.run.run_facts import level_of
from tools.run.tick_core import TickCore


class ReplayResult(msgspec.Struct, frozen=True):
    """How a log compared, tick by tick. `notes` say in words what could not be compared."""

    ticks: int
    identical: int
    gaps: int
    first_difference: Difference | None
    world: WorldReplay | None
    complete: bool
    notes: tuple[str, ...]
    facts: dict[str, str]

    @property
    def different(self) -> bool:
        """Whether anything came out otherwise than it is in the log."""
        return self.first_difference is not None or (self.world is not None and self.world.first_difference is not None)


def replay(path: Path, *, tolerance: float | None = None) -> ReplayResult:
    """Replay a log. Raises UsageError when there is none, LogDamaged for one that cannot be trusted."""
    log = VerifiedLog(path)
    ticks = TickReplayer(TickCore.of(log.rig, in_contact=log.in_contact), tolerance)
    # A world whose records are incomplete cannot be run again.
    world = None if log.dropped("world") else WorldReplayer(log.rig, tolerance)
    for topic, payload, tick in log.messages():
        if tick is not None:
            ticks.take(tick, payload)
        elif world is not None and topic.startswith(PREFIX):
            world.take(topic, payload)
    ran = None if world is None else world.result()
    notes = []
    if not log.complete:
        notes.append(f"the log was recovered: it ends with tick {ticks.last}, what came after is lost")
    if not log.config_holds:
        notes.append("the log's config.toml was changed after it was finished")
    if ran is None and level_of(log.rig) != "hardware":
        why = "records of it did not fit into the log's ring" if world is None else "its start is missing"
        notes.append(f"the world was not compared: {why}")
    result = ReplayResult(
        ticks.count, ticks.identical, ticks.gaps, ticks.first, ran, log.complete, tuple(notes), log.facts
    )
    if not result.different:  # otherwise what differs says more than that something was changed
        log.require_config()
    return result


class TickReplayer:
    """Folds ticks that come in order and compares each; after a gap the state is taken from the log."""

    def __init__(self, core: TickCore, tolerance: float | None) -> None:
        self._core = core
        self._tolerance = tolerance
        self._state: TickState | None = None
        self.count = self.identical = self.gaps = 0
        self.last = -1
        self.first: Difference | None = None

    def take(self, tick: ControlTick, payload: bytes) -> None:
        """Fold and compare one tick."""
        number = tick.input.tick
        if self._state is None or number != self.last + 1 + tick.input.host.skipped:
            self.gaps += self._state is not None
            self._state = tick.before
        found, after = self._compare(tick, payload, self._state)
        self.count += 1
        self.identical += found is None
        self.first = self.first or found
        # With a tolerance the log's own state goes on, so that rounding does not pile up.
        self._state = after if self._tolerance is None else tick.after
        self.last = number

    def _compare(self, tick: ControlTick, payload: bytes, before: TickState) -> tuple[Difference | None, TickState]:
        number = tick.input.tick
        try:
            after, output = self._core.fold(before, tick.input)
            mine = ControlTick(tick.crc32_before, tick.reserved, tick.input, before, after, output)
            if TICK_CDR.encode(mine) == payload:
                return None, after
        except Exception as error:  # nothing in a log may crash its replay; the run itself has lived through this tick
            return Difference(number, "output", "a tick", f"{type(error).__name__}: {error}"), tick.after
        found = difference(number, tick, mine, self._tolerance)
        if found is None and self._tolerance is None:
            found = Difference(number, "", "bytes", "other bytes")
        return found, after
