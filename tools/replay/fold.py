"""Replay a log: re-run its ticks from their inputs and compare every byte of the result.

The first tick's state is the initial state. Today's code processes each tick's input with the log's own config; the
result is encoded and compared with the log (for a log of an earlier format, only the fields that both have). The
simulated world of an emulated or simulated run is also rebuilt, given the commands it received then, and compared in
the same way; finally the topics the recorder derived are derived again and compared.
"""

from __future__ import annotations

from pathlib import Path

import msgspec

from robot_io.log.logged_type import LoggedType
from robot_io.log.world_messages import COMMAND_CDR, START_CDR, STATE_CDR
from robot_io.tick import TICK_CDR, ControlTick, TickState
from tools.log.derivation import WORLD_TOPIC
from tools.log.run_log import DERIVED_FACT, NOT_DERIVED
from tools.replay.base_inputs import FIRST_FORMAT, BaseInputsReplay, BaseInputsReplayer
from tools.replay.code_origin import CodeOrigin
from tools.replay.derived import DerivedReplay, DerivedReplayer
from tools.replay.difference import Difference, difference
from tools.replay.law import law_of, with_law_source
from tools.replay.verified_log import VerifiedLog
from tools.replay.world import PREFIX, WorldReplay, WorldReplayer, WorldTypes
from tools.run.facts.run_facts import level_of
from tools.run.tick_core import TickCore


class ReplayResult(msgspec.Struct, frozen=True):
    """How a log compared, tick by tick. `notes` name what could not be compared."""

    ticks: int
    identical: int
    gaps: int
    first_difference: Difference | None
    world: WorldReplay | None
    derived: DerivedReplay
    arrived: BaseInputsReplay | None
    """None if it cannot be compared: the log is of an earlier format, or records did not fit into the gate's ring."""
    complete: bool
    notes: tuple[str, ...]
    made_by: CodeOrigin
    facts: dict[str, str]

    @property
    def different(self) -> bool:
        """Return whether any result differs from the log."""
        parts = (self.world, self.derived, self.arrived)
        return self.first_difference is not None or any(part and part.first_difference for part in parts)


def replay(path: Path, *, tolerance: float | None = None, law: str = "") -> ReplayResult:
    """Replay a log. law: `module:Class` of its law where that is not a shipped one.

    Raises UsageError if there is no such log, LogDamaged if it cannot be trusted, ReplayDiffers if only the code that
    wrote it can use its config, and as `law_of`.
    """
    log = VerifiedLog(path)
    rig = log.usable_rig()
    own, sha256 = law_of(path, rig.control, law)
    made_by = with_law_source(log.made_by, log.facts, sha256)
    ticks = TickReplayer(TickCore.of(rig, in_contact=log.in_contact, law=own), tolerance, log.ticks)
    types = WorldTypes(
        log.type_of("/world/start", START_CDR),
        log.type_of("/world/command", COMMAND_CDR),
        log.type_of(WORLD_TOPIC, STATE_CDR),
    )
    # A world with incomplete records cannot be re-run.
    world = None if log.dropped("world") else WorldReplayer(rig, types, tolerance)
    derived = DerivedReplayer(rig, log.wall_offset_ns, log.channels, log.made_by.format, tolerance)
    known = log.made_by.format >= FIRST_FORMAT and log.ticks.holds_all_of("input.base")
    comparable = known and not log.dropped("gate")
    arrived = (
        BaseInputsReplayer(log.wall_offset_ns, log.channels, log.made_by.format, tolerance) if comparable else None
    )
    left_out = log.facts.get(DERIVED_FACT) == NOT_DERIVED
    for topic, log_time_ns, payload, tick in log.messages():
        if tick is not None:
            ticks.take(tick, payload)
            if not left_out:
                derived.tick(tick, log_time_ns)
            if arrived is not None:
                arrived.tick(tick)
            continue
        if topic.startswith(PREFIX) and world is not None:
            world.take(topic, payload)
        if topic == WORLD_TOPIC and not left_out:
            derived.world(types.state.decode(payload), log_time_ns)
        if not left_out:
            derived.seen(topic, log_time_ns, payload)
        if arrived is not None:
            arrived.seen(topic, log_time_ns, payload)
    world_replay = None if world is None else world.result()
    derived_replay = DerivedReplay(0, 0, None, ()) if left_out else derived.result(complete=log.complete)
    result = ReplayResult(
        ticks.count,
        ticks.identical,
        ticks.gaps,
        ticks.first,
        world_replay,
        derived_replay,
        None if arrived is None else arrived.result(complete=log.complete),
        log.complete,
        (
            *_notes(log, ticks.last),
            *_world_notes(world, world_replay, types, level_of(rig)),
            *_derived_notes(derived_replay, left_out),
        ),
        made_by,
        log.facts,
    )
    if not result.different:  # a difference tells more than a changed config
        log.require_config()
    return result


def _notes(log: VerifiedLog, last: int) -> list[str]:
    notes = [*log.notes, *log.ticks.notes("/control/tick")]
    if not log.complete:
        notes.append(f"the log was recovered: it ends with tick {last}; everything after that is lost")
    if not log.config_intact:
        notes.append("the log's config.toml was changed after it was finished")
    return notes


def _world_notes(world: WorldReplayer | None, replayed: WorldReplay | None, types: WorldTypes, level: str) -> list[str]:
    if replayed is None and level != "hardware":
        why = "records of it did not fit into the log's ring" if world is None else "its start is missing"
        return [f"the world was not compared: {why}"]
    return types.state.notes(WORLD_TOPIC)


def _derived_notes(derived: DerivedReplay, left_out: bool) -> list[str]:
    if left_out:
        return ["topics that are derived from others were left out of this log"]
    if not derived.not_compared:
        return []
    return [f"not compared, because they are derived differently today: {', '.join(derived.not_compared)}"]


class TickReplayer:
    """Re-runs ticks given in order and compares each; after a gap the state comes from the log."""

    def __init__(self, core: TickCore, tolerance: float | None, logged: LoggedType[ControlTick]) -> None:
        self._core = core
        self._logged = logged
        self._tolerance = tolerance
        self._state: TickState | None = None
        self.count = self.identical = self.gaps = 0
        self.last = -1
        self.first: Difference | None = None

    def take(self, tick: ControlTick, payload: bytes) -> None:
        """Re-run and compare one tick."""
        number = tick.input.tick
        if self._state is None or number != self.last + 1 + tick.input.host.skipped:
            self.gaps += self._state is not None
            self._state = tick.before[0] if tick.before else None
        found: Difference | None = Difference(number, "before", "no state", "a state to start from")
        after = tick.after
        if self._state is not None:
            found, after = self._compare(tick, payload, self._state)
        self.count += 1
        self.identical += found is None
        self.first = self.first or found
        # With a tolerance the log's own state is used, so that rounding errors do not accumulate.
        self._state = after if self._tolerance is None else tick.after
        self.last = number

    def _compare(self, tick: ControlTick, payload: bytes, before: TickState) -> tuple[Difference | None, TickState]:
        number = tick.input.tick
        try:
            after, output = self._core.fold(before, tick.input)
            kept = (before,) if tick.before else ()
            replayed = ControlTick(tick.crc32_before, tick.reserved, tick.input, kept, after, output)
            encoded = TICK_CDR.encode(replayed)
            if self._logged.exact and encoded == payload:
                return None, after
            replayed = TICK_CDR.decode(encoded)  # as a log holds it: a whole number where a float belongs is one
        except Exception as error:  # nothing in a log may crash its replay; the run itself survived this tick
            return Difference(number, "output", "a tick", f"{type(error).__name__}: {error}"), tick.after
        found = difference(number, tick, replayed, self._tolerance, self._logged.missing)
        if found is None and self._tolerance is None and self._logged.exact:
            found = Difference(number, "", "bytes", "other bytes")
        return found, after
