"""Replay: fold a log's inputs again, and compare every byte of what comes out.

The first tick's state is the seed. Each tick is decoded, folded by today's code with the log's own config, encoded
again and compared with what the log holds. The world of an emulated or simulated run is built again too, fed
with the commands that arrived then, and compared in the same way.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec

from robot_io.config import RigConfig, rig_from_toml
from robot_io.errors import LogDamaged, PushError
from robot_io.mcap_read import LogSummary, read_log, read_summary
from robot_io.tick import TICK_CDR, ControlTick, TickState
from robot_io.tick_chain import TickChain
from robot_io.world_messages import COMMAND_CDR, START_CDR, STATE_CDR, WorldState
from sim_backend.world import World, WorldRecord
from tools.tick_core import TickCore

DO_DAMAGED = "Do not trust this log from there on; `push log info` shows what it holds"


class Difference(msgspec.Struct, frozen=True):
    """The first place where replay and log differ."""

    tick: int
    field: str
    logged: Any
    replayed: Any


class WorldReplay(msgspec.Struct, frozen=True):
    """How the simulated world compared."""

    states: int
    identical: int
    first_difference: Difference | None


class ReplayResult(msgspec.Struct, frozen=True):
    """How a log compared, tick by tick."""

    ticks: int
    identical: int
    gaps: int
    first_difference: Difference | None
    world: WorldReplay | None
    facts: dict[str, str]


def load(path: Path) -> tuple[LogSummary, RigConfig, dict[str, str]]:
    """Verify a log and return its summary, rig and facts. Raises LogDamaged."""
    summary = read_summary(path)
    facts = {key: value for record in summary.metadata.values() for key, value in record.items()}
    try:
        text = summary.attachments["config.toml"].decode()
        return summary, rig_from_toml(text), facts
    except (KeyError, UnicodeDecodeError, PushError) as error:
        raise LogDamaged(f"the log holds no usable config.toml ({error})", where=str(path), do=DO_DAMAGED) from None


def ticks_of(path: Path, facts: dict[str, str]) -> Iterator[ControlTick]:
    """Yield the ticks of a log, each checked against the chain. Raises LogDamaged naming the tick."""
    chain = TickChain()
    last = -1
    for topic, _, payload, _ in read_log(path):
        if topic != "/control/tick":
            continue
        if not chain.holds(payload):
            raise LogDamaged(
                f"tick {last} or {last + 1} was altered: the chain of checksums breaks", where=str(path), do=DO_DAMAGED
            )
        tick = TICK_CDR.decode(payload)
        if TICK_CDR.encode(tick) != payload:
            raise LogDamaged(f"tick {tick.input.tick} holds bits that mean nothing", where=str(path), do=DO_DAMAGED)
        last = tick.input.tick
        yield tick
    wanted = facts.get("last_tick_crc32")
    if wanted is None:
        raise LogDamaged("the log does not say how it ends", where=str(path), do=DO_DAMAGED)
    if wanted != f"{chain.crc32:08x}" or facts.get("ticks") != str(chain.ticks):
        raise LogDamaged(f"tick {last}, the last one, was altered or ticks are missing", where=str(path), do=DO_DAMAGED)


def replay(path: Path, *, tolerance: float | None = None) -> ReplayResult:
    """Replay a log. Raises LogDamaged for one that cannot be trusted."""
    _, rig, facts = load(path)
    core = TickCore.of(rig, in_contact=facts.get("in_contact") == "True")
    state: TickState | None = None
    count = identical = gaps = 0
    last = -1
    first: Difference | None = None
    for tick in ticks_of(path, facts):
        expected = last + 1 + tick.input.host.skipped
        if state is None or (last >= 0 and tick.input.tick != expected):
            gaps += state is not None
            state = tick.before
        after, output = core.fold(state, tick.input)
        mine = ControlTick(tick.crc32_before, tick.reserved, tick.input, state, after, output)
        same = TICK_CDR.encode(mine) == TICK_CDR.encode(tick)
        found = None if same else difference(tick.input.tick, tick, mine, tolerance)
        identical += found is None
        if first is None:
            first = found
        # With a tolerance the log's own state goes on, so that rounding does not pile up.
        state = after if tolerance is None else tick.after
        last = tick.input.tick
        count += 1
    if count == 0:
        raise LogDamaged("the log holds no tick", where=str(path), do="The run ended before its loop began")
    return ReplayResult(count, identical, gaps, first, replay_world(path, rig), facts)


def replay_world(path: Path, rig: RigConfig) -> WorldReplay | None:
    """Run the simulated world of a log again; None when it has none."""
    made: list[WorldState] = []

    def keep(record: WorldRecord) -> None:
        if isinstance(record, WorldState):
            made.append(record)

    world: World | None = None
    states = identical = taken = 0
    first: Difference | None = None
    for topic, _, payload, _ in read_log(path):
        if topic == "/world/start":
            start = START_CDR.decode(payload)
            world = World(rig, start.seed, start.start_ns, keep)
        elif world is None:
            continue
        elif topic == "/world/command":
            command = COMMAND_CDR.decode(payload)
            if command.is_switch:
                world.set_drivers(command.drivers_active, command.arrival_ns)
            else:
                world.command_base(command.twist, command.arrival_ns)
        elif topic == "/world/state":
            logged = STATE_CDR.decode(payload)
            world.advance_to(logged.t_ns)
            mine = made[taken] if taken < len(made) else None
            taken += 1
            states += 1
            if mine is not None and STATE_CDR.encode(mine) == payload:
                identical += 1
            elif first is None:
                first = difference(logged.t_ns, logged, mine, None) or Difference(logged.t_ns, "", None, None)
    return None if world is None else WorldReplay(states, identical, first)


def difference(tick: int, logged: Any, mine: Any, tolerance: float | None) -> Difference | None:
    """Return the first field that differs (more than `tolerance`), by its dotted name."""
    for name, old, new in fields(logged, mine):
        if isinstance(old, float) and isinstance(new, float):
            if tolerance is not None and (abs(old - new) <= tolerance or (math.isnan(old) and math.isnan(new))):
                continue
            if tolerance is None and msgspec.json.encode(old.hex()) == msgspec.json.encode(new.hex()):
                continue
        elif old == new:
            continue
        return Difference(tick, name, old, new)
    return None


def fields(logged: Any, mine: Any, name: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Yield (dotted name, logged, replayed) of every leaf."""
    if isinstance(logged, msgspec.Struct) and isinstance(mine, msgspec.Struct):
        for key in logged.__struct_fields__:
            yield from fields(getattr(logged, key), getattr(mine, key), f"{name}.{key}" if name else key)
    elif isinstance(logged, tuple) and isinstance(mine, tuple) and len(logged) == len(mine):
        for i, (old, new) in enumerate(zip(logged, mine, strict=True)):
            yield from fields(old, new, f"{name}[{i}]")
    else:
        yield name, logged, mine
