"""Replay a log: re-run its ticks from their inputs and compare every byte of the result.

The first tick's state is the initial state. Today's code processes each tick's input with the log's own config; the
result is encoded and compared with the log (for a log of an earlier format, only the fields that both have). The
simulated world of an emulated or simulated run is also rebuilt, given the commands it received then, and compared in
the same way; finally the topics the recorder derived are derived again and compared. Of a log in parts, ticks and world
go on from part to part; each part derived its topics anew.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from robot_io.mcap.files import files_of
from robot_io.rig.config import RigConfig
from tools.log.derivation import WORLD_TOPIC
from tools.log.run_log import DERIVED_FACT, NOT_DERIVED
from tools.log.run_parts import SINCE_FACT
from tools.replay.base_inputs import FIRST_FORMAT, BaseInputsReplayer
from tools.replay.derived import DerivedReplay, DerivedReplayer
from tools.replay.law import law_of, with_law_source
from tools.replay.result import ReplayResult, all_derived, notes_of
from tools.replay.shares import ticks_shared
from tools.replay.ticks import TickReplayer
from tools.replay.verified_log import VerifiedLog, in_order
from tools.replay.world import PREFIX, WorldReplayer, WorldTypes
from tools.run.tick_core import TickCore

WORTH_COMPILING_NS = 60_000_000_000
"""Loading the compiled kernel of the world takes as long as a minute of pushing saves."""


def replay(
    path: Path, *, tolerance: float | None = None, law: str = "", ticks_only: bool = False, jobs: int = 1
) -> ReplayResult:
    """Replay a log, in one file or in parts. law: `module:Class` of its law where that is not a shipped one.

    ticks_only: neither the world, nor derived topics, nor what arrived. jobs: processes; the result is the same for any
    number. Raises UsageError if there is no such log,
    LogDamaged if it cannot be trusted, ReplayDiffers if only the code that wrote it can use its config, and as
    `law_of`.
    """
    return replay_files(files_of(path), tolerance=tolerance, law=law, ticks_only=ticks_only, jobs=jobs)


def replay_files(
    files: Sequence[Path],
    *,
    tolerance: float | None = None,
    law: str = "",
    ticks_only: bool = False,
    jobs: int = 1,
) -> ReplayResult:
    """Replay files that follow each other; the first need not be that of the run. As `replay`."""
    logs = [VerifiedLog(file) for file in files]
    in_order(logs)
    session = _Session(logs[0], tolerance, law, ticks_only=ticks_only)
    can_share = jobs > 1 and tolerance is None and not law  # a law of one's own is imported here alone
    shared = ticks_shared(logs, jobs) if can_share and ticks_only else None
    if shared is not None:
        session.take_shared(*shared)
    else:
        for log in logs:
            session.take(log)
    result = session.result(logs)
    if not result.different:  # a difference tells more than a changed config
        for log in logs:
            log.require_config()
    return result


class _Session:
    """What goes on from part to part of one log."""

    def __init__(self, log: VerifiedLog, tolerance: float | None, law: str, *, ticks_only: bool) -> None:
        self._rig: RigConfig = log.usable_rig()
        self._tolerance = tolerance
        self._ticks_only = ticks_only
        own, sha256 = law_of(log.path, self._rig.control, law)
        self._made_by = with_law_source(log.made_by, log.facts, sha256)
        core = TickCore.of(self._rig, in_contact=log.in_contact, law=own)
        self._ticks = TickReplayer(core, tolerance, log.ticks)
        self._types = WorldTypes.of(log)
        # A world with incomplete records cannot be re-run.
        can_run = not ticks_only and not log.dropped("world")
        long = log.end_ns - log.start_ns > WORTH_COMPILING_NS
        self._world = WorldReplayer(self._rig, self._types, tolerance, compiled=long) if can_run else None
        known = log.made_by.format >= FIRST_FORMAT and log.ticks.holds_all_of("input.base")
        self._arrived = (
            BaseInputsReplayer(log.wall_offset_ns, log.channels, log.made_by.format, tolerance, since_ns=_since(log))
            if known and not ticks_only and not log.dropped("gate")
            else None
        )
        self._derived: list[DerivedReplay] = []
        self._derives = log.facts.get(DERIVED_FACT) != NOT_DERIVED

    def take_shared(self, ticks: int, last: int) -> None:
        """Take that so many ticks were found identical by others; `last` is the number of the last."""
        self._ticks.count = self._ticks.identical = ticks
        self._ticks.last = last

    def take(self, log: VerifiedLog) -> None:
        """Re-run and compare one file. Raises LogDamaged."""
        if self._ticks_only:
            for _, _, payload, tick in log.messages():
                if tick is not None:
                    self._ticks.take(tick, payload)
            return
        derived = DerivedReplayer(self._rig, log.wall_offset_ns, log.channels, log.made_by.format, self._tolerance)
        ticks, world, arrived, state = self._ticks, self._world, self._arrived, self._types.state
        for topic, log_time_ns, payload, tick in log.messages():
            if tick is not None:
                ticks.take(tick, payload)
                if self._derives:
                    derived.tick(tick, log_time_ns)
                if arrived is not None:
                    arrived.tick(tick)
                continue
            if topic.startswith(PREFIX) and world is not None:
                world.take(topic, payload)
            if topic == WORLD_TOPIC and self._derives:
                derived.world(state.decode(payload), log_time_ns)
            if self._derives:
                derived.seen(topic, log_time_ns, payload)
            if arrived is not None:
                arrived.seen(topic, log_time_ns, payload)
        if self._derives:
            self._derived.append(derived.result(complete=log.complete))

    def result(self, logs: Sequence[VerifiedLog]) -> ReplayResult:
        """Return how all files compared."""
        ticks, last = self._ticks, logs[-1]
        world = None if self._world is None else self._world.result()
        derived = all_derived(self._derived) if self._derived else None
        return ReplayResult(
            ticks.count,
            ticks.identical,
            ticks.gaps,
            ticks.first,
            world,
            derived,
            None if self._arrived is None else self._arrived.result(complete=last.complete),
            all(log.complete for log in logs),
            notes_of(
                logs,
                ticks.last,
                self._rig,
                derived,
                world,
                self._types,
                has_world=self._world is not None,
                engine_missing=self._world is not None and self._world.engine_missing,
                ticks_only=self._ticks_only,
            ),
            self._made_by,
            logs[0].facts,
        )


def _since(log: VerifiedLog) -> int:
    """Return when a part began, 0 for the first: what its ticks hold from before is in the part before."""
    text = log.facts.get(SINCE_FACT, "0")
    return int(text) if text.isdecimal() and len(text) < 20 else 0
