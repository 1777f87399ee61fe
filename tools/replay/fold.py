"""Replay: fold a log's inputs again, and compare every byte of what comes out.

The first tick's state is the seed. Each tick's input is folded by today's code with the log's own config, and what
comes out is encoded and compared with what the log holds; a log of an earlier format by the fields that both have. The
world of an emulated or simulated run is built again too, fed with the commands that arrived then, and compared in the
same way, and what the recorder derived from all these is derived again.
"""

from __future__ import annotations

from pathlib import Path

import msgspec

from robot_io.log.log_format import LOG_FORMAT
from robot_io.log.logged_type import LoggedType
from robot_io.log.world_messages import COMMAND_CDR, START_CDR, STATE_CDR
from robot_io.tick import TICK_CDR, ControlTick, TickState
from tools.log.derivation import WORLD_TOPIC
from tools.replay.arrived import ArrivedReplay, ArrivedReplayer
from tools.replay.derived import DerivedReplay, DerivedReplayer
from tools.replay.difference import Difference, difference
from tools.replay.made_by import MadeBy
from tools.replay.verified_log import VerifiedLog
from tools.replay.world import PREFIX, WorldReplay, WorldReplayer, WorldTypes
from tools.run.run_facts import level_of
from tools.run.tick_core import TickCore


class ReplayResult(msgspec.Struct, frozen=True):
    """How a log compared, tick by tick. `notes` say in words what could not be compared."""

    ticks: int
    identical: int
    gaps: int
    first_difference: Difference | None
    world: WorldReplay | None
    derived: DerivedReplay
    arrived: ArrivedReplay | None
    """None where it cannot be compared: the format is not today's, or records did not fit into the gate's ring."""
    complete: bool
    notes: tuple[str, ...]
    made_by: MadeBy
    facts: dict[str, str]

    @property
    def different(self) -> bool:
        """Return whether anything came out otherwise than it is in the log."""
        parts = (self.world, self.derived, self.arrived)
        return self.first_difference is not None or any(part and part.first_difference for part in parts)


def replay(path: Path, *, tolerance: float | None = None) -> ReplayResult:
    """Replay a log.

    Raises UsageError when there is none, LogDamaged for one that cannot be trusted, ReplayDiffers for one whose config
    only the code that made it could use.
    """
    log = VerifiedLog(path)
    rig = log.usable_rig()
    ticks = TickReplayer(TickCore.of(rig, in_contact=log.in_contact), tolerance, log.ticks)
    types = WorldTypes(
        log.type_of("/world/start", START_CDR),
        log.type_of("/world/command", COMMAND_CDR),
        log.type_of(WORLD_TOPIC, STATE_CDR),
    )
    # A world whose records are incomplete cannot be run again.
    world = None if log.dropped("world") else WorldReplayer(rig, types, tolerance)
    derived = DerivedReplayer(rig, log.wall_offset_ns, log.channels, log.made_by.format, tolerance)
    comparable = log.ticks.exact and log.made_by.format == LOG_FORMAT and not log.dropped("gate")
    arrived = ArrivedReplayer(log.wall_offset_ns, log.channels, tolerance) if comparable else None
    for topic, log_time_ns, payload, tick in log.messages():
        if tick is not None:
            ticks.take(tick, payload)
            derived.tick(tick, log_time_ns)
            if arrived is not None:
                arrived.tick(tick)
            continue
        if topic.startswith(PREFIX) and world is not None:
            world.take(topic, payload)
        if topic == WORLD_TOPIC:
            derived.world(types.state.decode(payload), log_time_ns)
        derived.seen(topic, log_time_ns, payload)
        if arrived is not None:
            arrived.seen(topic, log_time_ns, payload)
    ran = None if world is None else world.result()
    made = derived.result(complete=log.complete)
    result = ReplayResult(
        ticks.count,
        ticks.identical,
        ticks.gaps,
        ticks.first,
        ran,
        made,
        None if arrived is None else arrived.result(complete=log.complete),
        log.complete,
        (*_notes(log, ticks.last), *_world_notes(world, ran, types, level_of(rig)), *_derived_notes(made)),
        log.made_by,
        log.facts,
    )
    if not result.different:  # otherwise what differs says more than that something was changed
        log.require_config()
    return result


def _notes(log: VerifiedLog, last: int) -> list[str]:
    notes = [*log.notes, *log.ticks.notes("/control/tick")]
    if not log.complete:
        notes.append(f"the log was recovered: it ends with tick {last}, what came after is lost")
    if not log.config_holds:
        notes.append("the log's config.toml was changed after it was finished")
    return notes


def _world_notes(world: WorldReplayer | None, ran: WorldReplay | None, types: WorldTypes, level: str) -> list[str]:
    if ran is None and level != "hardware":
        why = "records of it did not fit into the log's ring" if world is None else "its start is missing"
        return [f"the world was not compared: {why}"]
    return types.state.notes(WORLD_TOPIC)


def _derived_notes(derived: DerivedReplay) -> list[str]:
    if not derived.not_compared:
        return []
    return [f"not compared, derived in another way today: {', '.join(derived.not_compared)}"]


class TickReplayer:
    """Folds ticks that come in order and compares each; after a gap the state is taken from the log."""

    def __init__(self, core: TickCore, tolerance: float | None, logged: LoggedType[ControlTick]) -> None:
        self._core = core
        self._logged = logged
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
            if self._logged.exact and TICK_CDR.encode(mine) == payload:
                return None, after
        except Exception as error:  # nothing in a log may crash its replay; the run itself has lived through this tick
            return Difference(number, "output", "a tick", f"{type(error).__name__}: {error}"), tick.after
        found = difference(number, tick, mine, self._tolerance, self._logged.missing)
        if found is None and self._tolerance is None and self._logged.exact:
            found = Difference(number, "", "bytes", "other bytes")
        return found, after
