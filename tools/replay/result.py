"""How a log compared with what today's program makes of its inputs, and what could not be compared."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from robot_io.rig.config import RigConfig
from tools.log.derivation import WORLD_TOPIC
from tools.log.run_parts import PART_FACT
from tools.replay.base_inputs import BaseInputsReplay
from tools.replay.code_origin import CodeOrigin
from tools.replay.derived import DerivedReplay
from tools.replay.difference import Difference
from tools.replay.verified_log import VerifiedLog
from tools.replay.world import WorldReplay, WorldTypes
from tools.run.facts.code_facts import ENGINE_FACT, engine_facts
from tools.run.facts.run_facts import level_of


class ReplayResult(msgspec.Struct, frozen=True):
    """How a log compared, tick by tick. `notes` name what could not be compared."""

    ticks: int
    identical: int
    gaps: int
    first_difference: Difference | None
    world: WorldReplay | None
    derived: DerivedReplay | None
    """None if only the ticks were compared, or the log holds none."""
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


def all_derived(parts: Sequence[DerivedReplay]) -> DerivedReplay:
    """Return how the derived topics of all parts compared."""
    first = next((part.first_difference for part in parts if part.first_difference), None)
    left_out = sorted({topic for part in parts for topic in part.not_compared})
    return DerivedReplay(
        sum(part.messages for part in parts), sum(part.identical for part in parts), first, tuple(left_out)
    )


def notes_of(
    logs: Sequence[VerifiedLog],
    last_tick: int,
    rig: RigConfig,
    derived: DerivedReplay | None,
    world: WorldReplay | None,
    types: WorldTypes,
    *,
    has_world: bool,
    engine_missing: bool,
    ticks_only: bool,
) -> tuple[str, ...]:
    """Return in words what could not be compared.

    has_world: whether the log holds all records of its world. engine_missing: what moved it is not installed here.
    """
    notes = [*dict.fromkeys(note for log in logs for note in log.notes), *logs[0].ticks.notes("/control/tick")]
    if not all(log.complete for log in logs):
        notes.append(f"the log was recovered: it ends with tick {last_tick}; everything after that is lost")
    if not all(log.config_intact for log in logs):
        notes.append("the log's config.toml was changed after it was finished")
    if ticks_only:
        return (*notes, "only the ticks were compared")
    if world is None and level_of(rig) != "hardware":
        later = logs[0].facts.get(PART_FACT, "1") != "1"
        start = "it began in an earlier part" if later else "its start is missing"
        if engine_missing:
            start = "MuJoCo is not installed here"
        why = start if has_world else "records of it did not fit into the log's ring"
        notes.append(f"the world was not compared: {why}")
    elif world is not None:
        notes += types.state.notes(WORLD_TOPIC)
    notes += _engine_notes(logs[0].facts, rig)
    if derived is None:
        notes.append("topics that are derived from others were left out of this log")
    elif derived.not_compared:
        words = ", ".join(derived.not_compared)
        notes.append(f"not compared, because they are derived differently today: {words}")
    return tuple(notes)


def _engine_notes(facts: dict[str, str], rig: RigConfig) -> list[str]:
    then, now = facts.get(ENGINE_FACT), engine_facts(rig).get(ENGINE_FACT)
    return [f"the world was made by MuJoCo {then}, and run again by {now}"] if then and now and then != now else []
