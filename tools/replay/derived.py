"""Derives again what the recorder derived, and compares every byte, whatever order the log was brought into since.

What is derived and what the log holds must be the same messages. Each one waits here until its twin comes, which in a
log as it was written is at once; at the end none may be left over.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

import msgspec

from robot_io.errors import LogDamaged
from robot_io.log import log_format
from robot_io.log.channels import DERIVED
from robot_io.log.messages import GATE_SAYS, SAFETY_EVENT
from robot_io.log.world_messages import WorldState
from robot_io.mcap.read import ChannelInfo
from robot_io.rig.config import RigConfig
from robot_io.tick import ControlTick
from tools.log.derivation import SLIDER_TOPIC, TICK_TOPIC, WORLD_TOPIC, Derivation
from tools.log.tick_topics import Message
from tools.replay.difference import Difference
from tools.replay.payloads import is_todays, same, where_they_differ

SCENE = ("/robot_description", "/tf_static", "/path")
EVENTS, ROSOUT = "/safety/event", "/rosout"
MOST_WAITING = 100_000
"""Places with messages without their twin, about 50 MB: beyond it a log is taken to differ."""
Place = tuple[int, str]
"""Log time in ns, and topic."""


class DerivedReplay(msgspec.Struct, frozen=True):
    """How the derived topics compared. Of `first_difference`, `tick` is the message's log time in ns."""

    messages: int
    identical: int
    first_difference: Difference | None
    not_compared: tuple[str, ...]
    """Topics whose messages have another form or meaning today."""


class Waiting(NamedTuple):
    """A message without its twin: derived and not yet seen, or seen and not yet derived."""

    payload: bytes
    derived: bool


class DerivedReplayer:
    """Takes all messages of one log, in any order in which the ticks come one after another."""

    def __init__(
        self,
        rig: RigConfig,
        wall_offset_ns: int,
        channels: Iterable[ChannelInfo],
        its_format: int,
        tolerance: float | None = None,
    ) -> None:
        self._derive = Derivation(rig, wall_offset_ns)
        self._tolerance = tolerance
        compared = {channel.topic for channel in DERIVED} | {EVENTS, ROSOUT}
        if not self._derive.slider_is_seen:
            compared.add(SLIDER_TOPIC)
        other = {channel.topic for channel in channels if not is_todays(channel)}
        other |= {topic for topic, last_format in log_format.CHANGED_TOPICS if its_format <= last_format}
        self._not_compared, self._compared = compared & other, compared - other
        self._waiting: dict[Place, list[Waiting]] = {}
        self._newest: dict[str, list[Message]] = {}
        self._scene_made = self._too_many = False
        self._failed: Difference | None = None
        self._seen = self._twins = 0

    def tick(self, tick: ControlTick, log_time_ns: int) -> None:
        """Derive what comes of a tick."""
        self._expect(TICK_TOPIC, log_time_ns, lambda: self._derive.tick(tick))

    def world(self, state: WorldState, log_time_ns: int) -> None:
        """Derive what comes of a state of the world."""
        self._expect(WORLD_TOPIC, log_time_ns, lambda: self._derive.world(state, log_time_ns))

    def seen(self, topic: str, log_time_ns: int, payload: bytes) -> None:
        """Take a message of any other topic."""
        if topic == SLIDER_TOPIC and self._derive.slider_is_seen:
            self._expect(SLIDER_TOPIC, log_time_ns, lambda: self._derive.slider(payload, log_time_ns))
        if topic not in self._compared or (topic == EVENTS and _is_of_the_gate(payload)):
            return
        if topic in SCENE and not self._scene_made:
            self._scene_made = True  # by the first record's time, which only these messages hold
            self._expect(topic, log_time_ns, lambda: self._derive.scene(log_time_ns))
        self._seen += 1
        self._take((log_time_ns, topic), payload, derived=False)

    def result(self, *, complete: bool) -> DerivedReplay:
        """Return how it compared. What comes of the newest records may be lost with the end of a log."""
        if not complete:
            for made in self._newest.values():
                for topic, log_time_ns, payload in made:
                    self._forget((log_time_ns, topic), payload)
        first = self._failed
        if self._waiting and not self._too_many:
            place = min(self._waiting)
            if first is None or place[0] < first.tick:
                first = _named(place, self._waiting[place])
        if not self._scene_made and self._compared >= set(SCENE):
            first = first or Difference(0, SCENE[0], "no message", "one, at the start")
        return DerivedReplay(self._seen, self._twins, first, tuple(sorted(self._not_compared)))

    def _expect(self, source: str, log_time_ns: int, derive: Callable[[], list[Message]]) -> None:
        try:
            made = [message for message in derive() if message.topic in self._compared]
        except Exception as error:  # nothing in a log may crash its replay
            what = f"{type(error).__name__}: {error}"
            self._failed = self._failed or Difference(log_time_ns, f"what comes of {source}", "messages", what)
            return
        self._newest[source] = made
        for topic, its_time_ns, payload in made:
            self._take((its_time_ns, topic), payload, derived=True)

    def _take(self, place: Place, payload: bytes, *, derived: bool) -> None:
        """Find the twin of a message, or let it wait."""
        waiting = self._waiting.get(place, ())
        for i, other in enumerate(waiting):
            if other.derived != derived and same(place[1], payload, other.payload, self._tolerance):
                self._drop(place, i)
                self._twins += 1
                return
        if len(self._waiting) < MOST_WAITING:
            self._waiting.setdefault(place, []).append(Waiting(payload, derived))
        elif not self._too_many:
            self._too_many = True
            what = f"more than {MOST_WAITING} messages far from what they come of"
            self._failed = Difference(place[0], place[1], what, "each beside it")

    def _forget(self, place: Place, payload: bytes) -> None:
        for i, other in enumerate(self._waiting.get(place, ())):
            if other == (payload, True):
                self._drop(place, i)
                return

    def _drop(self, place: Place, index: int) -> None:
        waiting = self._waiting[place]
        del waiting[index]
        if not waiting:
            del self._waiting[place]


def _is_of_the_gate(payload: bytes) -> bool:
    """Return whether an event is the gate's own word, which came in and was not derived."""
    try:
        return SAFETY_EVENT.decode(payload).text.startswith(GATE_SAYS)
    except LogDamaged:
        return False


def _named(place: Place, waiting: list[Waiting]) -> Difference:
    mine = next((one.payload for one in waiting if one.derived), None)
    logged = next((one.payload for one in waiting if not one.derived), None)
    return where_they_differ(*place, logged, mine)
