"""Runs the simulated world of a log again: fed with the commands that arrived then, it must come out bit for bit."""

from __future__ import annotations

from collections import deque

import msgspec

from robot_io.log.world_messages import COMMAND_CDR, START_CDR, STATE_CDR, WorldState
from robot_io.rig.config import RigConfig
from sim_backend.world.base_plant import GRID_NS
from sim_backend.world.world import STATE_EVERY_STEPS, World, WorldRecord
from tools.replay.difference import Difference, difference

PREFIX = "/world/"


class WorldReplay(msgspec.Struct, frozen=True):
    """How the simulated world compared."""

    states: int
    identical: int
    first_difference: Difference | None


class WorldReplayer:
    """Takes the world's records in the order of the log."""

    def __init__(self, rig: RigConfig, tolerance: float | None = None) -> None:
        self._rig = rig
        self._tolerance = tolerance
        self._world: World | None = None
        self._made: deque[WorldState] = deque()
        self._states = self._identical = 0
        self._first: Difference | None = None

    def take(self, topic: str, payload: bytes) -> None:
        """Take one record. Raises LogDamaged when it cannot be read."""
        if topic == "/world/start":
            start = START_CDR.decode(payload)
            self._made.clear()
            self._world = World(self._rig, start.seed, start.start_ns, self._keep)
        elif self._world is None:
            return
        elif topic == "/world/command":
            self._command(self._world, payload)
        elif topic == "/world/state":
            self._compare(self._world, payload)

    def result(self) -> WorldReplay | None:
        """Return how it compared; None when the log holds no world."""
        return None if self._world is None else WorldReplay(self._states, self._identical, self._first)

    def _keep(self, record: WorldRecord) -> None:
        if isinstance(record, WorldState):
            self._made.append(record)

    def _command(self, world: World, payload: bytes) -> None:
        command = COMMAND_CDR.decode(payload)
        try:
            if command.is_switch:
                world.set_drivers(command.drivers_active, command.arrival_ns)
            else:
                world.command_base(command.twist, command.arrival_ns)
        except ValueError as error:  # no world has ever said this: the record was altered
            self._first = self._first or Difference(command.arrival_ns, "arrival_ns", command.arrival_ns, str(error))

    def _compare(self, world: World, payload: bytes) -> None:
        if not self._made:  # by its own clock, never by a time in the log, which could ask for an endless run
            world.advance_to(world.now_ns + STATE_EVERY_STEPS * GRID_NS)
        mine = self._made.popleft()
        self._states += 1
        found = None
        try:
            same = STATE_CDR.encode(mine) == payload
        except ValueError:  # it began at the end of all times
            same = False
        if not same:
            found = difference(mine.t_ns, STATE_CDR.decode(payload), mine, self._tolerance)
        self._identical += found is None
        self._first = self._first or found
