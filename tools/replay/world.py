"""Re-run the simulated world of a log: given the same commands, its states must match bit for bit."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

import msgspec

from robot_io.errors import EnvironmentFault
from robot_io.log.logged_type import LoggedType
from robot_io.log.world_messages import COMMAND_CDR, START_CDR, STATE_CDR, WorldCommand, WorldStart, WorldState
from robot_io.rig.config import RigConfig
from sim_backend.world.base_plant import GRID_NS
from sim_backend.world.world import STATE_EVERY_STEPS, World, WorldRecord
from tools.log.thinned_topics import holds_world_state
from tools.replay.difference import Difference, difference
from tools.replay.verified_log import VerifiedLog

PREFIX = "/world/"


class WorldReplay(msgspec.Struct, frozen=True):
    """How the simulated world compared."""

    states: int
    identical: int
    first_difference: Difference | None


class WorldTypes(NamedTuple):
    """How to read a log's records of the world."""

    start: LoggedType[WorldStart]
    command: LoggedType[WorldCommand]
    state: LoggedType[WorldState]

    @classmethod
    def of(cls, log: VerifiedLog) -> WorldTypes:
        """Return those of a log. Raises LogDamaged where they cannot be read as today's."""
        return cls(
            log.type_of("/world/start", START_CDR),
            log.type_of("/world/command", COMMAND_CDR),
            log.type_of("/world/state", STATE_CDR),
        )


class WorldReplayer:
    """Compares the world's records, given in the order of the log. compiled: see `World`."""

    def __init__(
        self, rig: RigConfig, types: WorldTypes, tolerance: float | None = None, *, compiled: bool = False
    ) -> None:
        self._rig = rig
        self._types = types
        self._tolerance = tolerance
        self._compiled = compiled
        self._world: World | None = None
        self._replayed: deque[WorldState] = deque()
        self._states = self._identical = 0
        self._first: Difference | None = None
        self.engine_missing = False
        """Whether the world is one of MuJoCo, and that is not installed here."""

    def take(self, topic: str, payload: bytes) -> None:
        """Take one record. Raises LogDamaged if it cannot be decoded."""
        if topic == "/world/start":
            start = self._types.start.decode(payload)
            self._replayed.clear()
            try:
                self._world = World(self._rig, start.seed, start.start_ns, self._keep, compiled=self._compiled)
            except EnvironmentFault:
                self.engine_missing = True
        elif self._world is None:
            return
        elif topic == "/world/command":
            self._command(self._world, payload)
        elif topic == "/world/state":
            self._compare(self._world, payload)

    def result(self) -> WorldReplay | None:
        """Return the comparison; None if the log contains no world."""
        return None if self._world is None else WorldReplay(self._states, self._identical, self._first)

    def _keep(self, record: WorldRecord) -> None:
        if isinstance(record, WorldState) and holds_world_state(self._rig, record.t_ns):
            self._replayed.append(record)

    def _command(self, world: World, payload: bytes) -> None:
        command = self._types.command.decode(payload)
        try:
            if command.is_switch:
                world.set_drivers(command.drivers_active, command.arrival_ns)
            else:
                world.command_base(command.twist, command.arrival_ns)
        except ValueError as error:  # no world can have written this: the record was altered
            self._first = self._first or Difference(command.arrival_ns, "arrival_ns", command.arrival_ns, str(error))

    def _compare(self, world: World, payload: bytes) -> None:
        while not self._replayed:  # by the world's own clock: a time from the log could demand an endless run
            world.advance_to(world.now_ns + STATE_EVERY_STEPS * GRID_NS)
        replayed = self._replayed.popleft()
        self._states += 1
        found = None
        if not self._types.state.exact or not _matches(replayed, payload):
            logged = self._types.state.decode(payload)
            found = difference(replayed.t_ns, logged, replayed, self._tolerance, self._types.state.missing)
        self._identical += found is None
        self._first = self._first or found


def _matches(state: WorldState, payload: bytes) -> bool:
    try:
        return STATE_CDR.encode(state) == payload
    except ValueError:  # its times exceed what CDR can encode
        return False
