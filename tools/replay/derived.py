"""Recompute the derived topics of a log and compare every byte, even if the log has been reordered since.

The derived messages and those in the log must be the same. Each message waits here for its counterpart, which in a log
in its original order follows at once; at the end none may be left.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

import msgspec

from robot_io.errors import LogDamaged
from robot_io.log import log_format
from robot_io.log.channels import BY_TOPIC, DERIVED
from robot_io.log.messages import GATE_SAYS, INJECTED, SAFETY_EVENT
from robot_io.log.world_messages import WorldState
from robot_io.mcap.read import ChannelInfo
from robot_io.rig.config import RigConfig
from robot_io.tick import ControlTick
from tools.log.derivation import SLIDER_TOPIC, TICK_TOPIC, WORLD_TOPIC, Derivation
from tools.log.tick_topics import Message
from tools.replay.difference import Difference
from tools.replay.payloads import earlier_types, is_current_type, payload_difference, payloads_equal

SCENE = ("/robot_description", "/tf_static", "/path")
EVENTS, ROSOUT = "/safety/event", "/rosout"
MOST_WAITING = 100_000
"""Keys with messages still waiting, about 50 MB; beyond this the log is reported as different."""
Key = tuple[int, str]
"""Log time in ns, and topic."""


class DerivedReplay(msgspec.Struct, frozen=True):
    """How the derived topics compared. In `first_difference`, `tick` is the message's log time in ns."""

    messages: int
    identical: int
    first_difference: Difference | None
    not_compared: tuple[str, ...]
    """Topics whose messages have a different type or meaning today."""


class Waiting(NamedTuple):
    """A message without its counterpart: derived but not yet seen, or seen but not yet derived."""

    payload: bytes
    derived: bool


class DerivedReplayer:
    """Compares all messages of one log; only the ticks must be in order."""

    def __init__(
        self,
        rig: RigConfig,
        wall_offset_ns: int,
        channels: Iterable[ChannelInfo],
        log_format_number: int,
        tolerance: float | None = None,
    ) -> None:
        self._derive = Derivation(rig, wall_offset_ns, log_format_number)
        self._tolerance = tolerance
        compared = {channel.topic for channel in DERIVED} | {EVENTS, ROSOUT}
        if not self._derive.slider_is_tracked:
            compared.add(SLIDER_TOPIC)
        self._earlier = earlier_types(channels, log_format_number)
        other = {c.topic for c in channels if not is_current_type(c) and c.topic not in self._earlier}
        other |= {topic for topic, last_format in log_format.CHANGED_TOPICS if log_format_number <= last_format}
        self._not_compared, self._compared = compared & other, compared - other
        self._waiting: dict[Key, list[Waiting]] = {}
        self._newest: dict[str, list[Message]] = {}
        self._scene_derived = self._too_many = False
        self._failed: Difference | None = None
        self._seen = self._matched = 0

    def tick(self, tick: ControlTick, log_time_ns: int) -> None:
        """Derive the messages of a tick."""
        self._expect(TICK_TOPIC, log_time_ns, lambda: self._derive.tick(tick))

    def world(self, state: WorldState, log_time_ns: int) -> None:
        """Derive the messages of a state of the simulated world."""
        self._expect(WORLD_TOPIC, log_time_ns, lambda: self._derive.world(state, log_time_ns))

    def seen(self, topic: str, log_time_ns: int, payload: bytes) -> None:
        """Take a message of any other topic."""
        if topic == SLIDER_TOPIC and self._derive.slider_is_tracked:
            self._expect(SLIDER_TOPIC, log_time_ns, lambda: self._derive.slider(payload, log_time_ns))
        if topic not in self._compared:
            return
        if topic in self._earlier:
            payload = self._today(topic, payload)
        if topic == EVENTS and _is_input(payload):
            return
        if topic in SCENE and not self._scene_derived:
            self._scene_derived = True  # derived from the first record's time, which only these messages hold
            self._expect(topic, log_time_ns, lambda: self._derive.scene(log_time_ns))
        self._seen += 1
        self._take((log_time_ns, topic), payload, derived=False)

    def result(self, *, complete: bool) -> DerivedReplay:
        """Return the comparison. In an incomplete log, messages derived from its newest records may be missing."""
        if not complete:
            for derived in self._newest.values():
                for topic, log_time_ns, payload in derived:
                    self._forget((log_time_ns, topic), payload)
        first = self._failed
        if self._waiting and not self._too_many:
            key = min(self._waiting)
            if first is None or key[0] < first.tick:
                first = _difference_at(key, self._waiting[key])
        if not self._scene_derived and self._compared >= set(SCENE):
            first = first or Difference(0, SCENE[0], "no message", "one, at the start")
        return DerivedReplay(self._seen, self._matched, first, tuple(sorted(self._not_compared)))

    def _expect(self, source: str, log_time_ns: int, derive: Callable[[], list[Message]]) -> None:
        try:
            derived = [message for message in derive() if message.topic in self._compared]
        except Exception as error:  # nothing in a log may crash its replay
            what = f"{type(error).__name__}: {error}"
            self._failed = self._failed or Difference(log_time_ns, f"derived from {source}", "messages", what)
            return
        self._newest[source] = derived
        for topic, message_time_ns, payload in derived:
            self._take((message_time_ns, topic), payload, derived=True)

    def _today(self, topic: str, payload: bytes) -> bytes:
        """Return a message of an earlier type as today's; as it is where it is none of that type."""
        try:
            return BY_TOPIC[topic].cdr_type.encode(self._earlier[topic].decode(payload))
        except (LogDamaged, ValueError):
            return payload

    def _take(self, key: Key, payload: bytes, *, derived: bool) -> None:
        """Match a message with its counterpart, or let it wait."""
        waiting = self._waiting.get(key, ())
        for i, other in enumerate(waiting):
            if other.derived != derived and payloads_equal(key[1], payload, other.payload, self._tolerance):
                self._drop(key, i)
                self._matched += 1
                return
        if len(self._waiting) < MOST_WAITING:
            self._waiting.setdefault(key, []).append(Waiting(payload, derived))
        elif not self._too_many:
            self._too_many = True
            what = f"more than {MOST_WAITING} messages far from the records they are derived from"
            self._failed = Difference(key[0], key[1], what, "each next to its record")

    def _forget(self, key: Key, payload: bytes) -> None:
        for i, other in enumerate(self._waiting.get(key, ())):
            if other == (payload, True):
                self._drop(key, i)
                return

    def _drop(self, key: Key, index: int) -> None:
        waiting = self._waiting[key]
        del waiting[index]
        if not waiting:
            del self._waiting[key]


def _is_input(payload: bytes) -> bool:
    """Return whether an event is an input, not derived: the gate itself reported it, or a fault was injected."""
    try:
        event = SAFETY_EVENT.decode(payload)
        return event.kind == INJECTED or event.text.startswith(GATE_SAYS)
    except LogDamaged:
        return False


def _difference_at(key: Key, waiting: list[Waiting]) -> Difference:
    replayed = next((one.payload for one in waiting if one.derived), None)
    logged = next((one.payload for one in waiting if not one.derived), None)
    return payload_difference(*key, logged, replayed)
