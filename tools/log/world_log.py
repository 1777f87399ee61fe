"""Encode records of the simulated world as ring records of the log."""

from __future__ import annotations

from collections.abc import Callable

from robot_io.log.channels import Kind
from robot_io.log.world_messages import (
    COMMAND_CDR,
    STALL_CDR,
    START_CDR,
    STATE_CDR,
    WorldCommand,
    WorldStall,
    WorldStart,
    WorldState,
)

WorldRecord = WorldStart | WorldCommand | WorldState | WorldStall


def encode_record(record: WorldRecord) -> tuple[Kind, int, bytes]:
    """Return the kind, time (ns) and payload of a record."""
    if isinstance(record, WorldState):
        return Kind.WORLD_STATE, record.t_ns, STATE_CDR.encode(record)
    if isinstance(record, WorldCommand):
        return Kind.WORLD_COMMAND, record.arrival_ns, COMMAND_CDR.encode(record)
    if isinstance(record, WorldStart):
        return Kind.WORLD_START, record.start_ns, START_CDR.encode(record)
    return Kind.WORLD_STALL, record.t_ns, STALL_CDR.encode(record)


def ring_listener(push: Callable[[int, int, bytes], object]) -> Callable[[WorldRecord], None]:
    """Return a listener for `World(on_record=...)` that pushes each record."""

    def listen(record: WorldRecord) -> None:
        push(*encode_record(record))

    return listen
