"""Look at a base through its bridge: it is subscribed to and asked by rosapi; nothing is advertised or published."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Self, TypeVar

import msgspec

from robot_io.clock import NS_PER_S, ClockNs, monotonic_ns
from robot_io.errors import DeviceUnreachable
from robot_io.messages import BaseFeed, CommandEcho, Pose2D, Stamped
from robot_io.ridgeback.feeds import FeedReader, feed_types, with_full_names
from robot_io.ridgeback.intake import Intake
from robot_io.ridgeback.preflight import ASK_AGAIN_S, ROSAPI_TIMEOUT_S
from robot_io.ridgeback.rosbridge_codec import (
    ServiceAnswer,
    decode_frame,
    decode_publishers,
    decode_subscribers,
    decode_time,
    decode_topic_type,
    encode_call,
    encode_subscribe,
    spell_type,
    type_fits,
)
from robot_io.ridgeback.websocket_link import LinkLost, WebSocketLink
from robot_io.rig.topics import TopicsConfig

T = TypeVar("T")

ANSWER_WITHIN_S = 1.0
ROUND_TRIPS = 10
BATTERY_LOW_V, BATTERY_EMPTY_V = 24.0, 20.0
"""Below these the Ridgeback's own diagnostics warn and report an error."""


class Heard(msgspec.Struct, frozen=True):
    """What came while listening."""

    samples: tuple[Stamped[BaseFeed], ...]
    span_s: float
    pose_frame: str
    """Frame in which the first pose came, "" where none did."""
    why_silent: Mapping[str, str]
    """For each topic that is needed and said nothing usable: what came instead, or "" for nothing."""


class RoundTrip(msgspec.Struct, frozen=True):
    """Times of questions to the bridge."""

    typical_s: float
    worst_s: float
    ahead_s: float | None
    """How far the robot's clock is ahead of this machine's; None where it was not told."""
    by: str
    """What answered: `rosapi`, or only the bridge's `ping`."""


class RidgebackLook:
    """A connection to a base's bridge that only asks and listens.

    topics, pose_source, base_from_marker: as for `Ridgeback`. Raises ConfigError, DeviceUnreachable (nothing
    listens, no handshake) or DeviceProtocolError (no bridge); every step DeviceUnreachable where the link breaks.
    """

    def __init__(
        self,
        url: str,
        topics: TopicsConfig,
        pose_source: str,
        base_from_marker: tuple[float, float, float],
        clock: ClockNs = monotonic_ns,
    ) -> None:
        topics = with_full_names(topics)
        self._url = url
        self._clock = clock
        self.command = topics.command
        self.feeds = feed_types(topics, pose_source)
        self._command_type = spell_type(topics.command_type, topics.ros_version)
        self._reader = FeedReader(topics, pose_source, Pose2D(*base_from_marker))
        self._link = WebSocketLink.connect(url, clock)
        self._calls = 0
        self._cold_until_ns = clock() + int(ROSAPI_TIMEOUT_S * NS_PER_S)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the connection; never raises."""
        self._link.close()

    @property
    def server(self) -> str:
        """What the bridge calls itself."""
        return self._link.server

    def wrong_types(self) -> dict[str, tuple[str, str] | None]:
        """Return for each topic whose type does not fit what the rig says and what it carries; None: no answer.

        A topic that fits, or that nobody has named yet, is left out.
        """
        types = {self.command: self._command_type, **self.feeds}
        found: dict[str, tuple[str, str] | None] = {}
        for topic, ours in types.items():
            values = self._ask("/rosapi/topic_type", {"topic": topic})
            reported = _decoded(decode_topic_type, values)
            if reported is None:
                found[topic] = None
            elif reported and not type_fits(ours, reported):
                found[topic] = (ours, reported)
        return found

    def listeners(self) -> list[str] | None:
        """Return the nodes that subscribe to the command topic; None: no answer."""
        return _decoded(decode_subscribers, self._ask("/rosapi/subscribers", {"topic": self.command}))

    def publishers(self) -> list[str] | None:
        """Return the nodes that publish on the command topic; None: no answer."""
        return _decoded(decode_publishers, self._ask("/rosapi/publishers", {"topic": self.command}))

    def round_trip(self) -> RoundTrip:
        """Ask for the time over and over; without rosapi, time the bridge's answers to pings."""
        times, offsets = list[float](), list[float]()
        for _ in range(ROUND_TRIPS):
            before_ns, wall_s = self._clock(), time.time()
            values = self._ask("/rosapi/get_time", {})
            took_s = (self._clock() - before_ns) / NS_PER_S
            told_s = _decoded(decode_time, values)
            if told_s is None:
                return RoundTrip(*self._ping(), None, "ping")
            times.append(took_s)
            offsets.append(told_s - wall_s - took_s / 2)
        nearest = min(range(len(times)), key=lambda i: times[i])
        return RoundTrip(sorted(times)[len(times) // 2], max(times), offsets[nearest], "rosapi")

    def listen(self, least_s: float, most_s: float, until: Callable[[], bool] = lambda: True) -> Heard:
        """Subscribe to everything, also to the command topic; return what comes.

        Ends after `least_s` when every topic that is needed has spoken and `until` (called ten times a second and more)
        is true, at the latest after `most_s`.
        """
        samples: list[Stamped[BaseFeed]] = []
        began_ns = self._clock()
        intake = self.subscribe()
        while (now_ns := self._clock()) - began_ns < most_s * NS_PER_S:
            over = until() and now_ns - began_ns > least_s * NS_PER_S
            if over and not self._reader.silent_topics():
                break
            samples += self.heard_by(intake, now_ns + NS_PER_S // 10)
        span_s = (self._clock() - began_ns) / NS_PER_S
        why = {topic: intake.refused.reason_of(topic) for topic in self._reader.silent_topics()}
        return Heard(tuple(samples), span_s, self._reader.pose_frame, why)

    def subscribe(self) -> Intake:
        """Ask for everything, also for what others command; return what `heard_by` takes it in with."""
        intake = Intake(self._reader, self._clock)
        try:
            for topic, type_name in {**self.feeds, self.command: self._command_type}.items():
                self._link.send_text(encode_subscribe(topic, type_name))
        except LinkLost as lost:
            raise self._gone(lost) from lost
        return intake

    def heard_by(self, intake: Intake, until_ns: int) -> list[Stamped[BaseFeed]]:
        """Return what has come, after waiting for something until `until_ns` at the latest."""
        try:
            self._link.wait_readable(until_ns)
            return intake.take(self._link)
        except LinkLost as lost:
            raise self._gone(lost) from lost

    def _ask(self, service: str, arguments: dict[str, str]) -> bytes | None:
        """Return the values of an answer; None where none comes within 1 s, or the call fails.

        A call that fails is made again while the bridge may only be starting.
        """
        while True:
            answer = self._ask_once(service, arguments)
            if answer is None or answer.ok:
                return answer.values if answer is not None else None
            if self._clock() > self._cold_until_ns:
                return None
            time.sleep(ASK_AGAIN_S)

    def _ask_once(self, service: str, arguments: dict[str, str]) -> ServiceAnswer | None:
        self._calls += 1
        call_id = f"look:{self._calls}"
        try:
            self._link.send_text(encode_call(call_id, service, arguments))
            until_ns = self._clock() + int(ANSWER_WITHIN_S * NS_PER_S)
            while self._link.wait_readable(until_ns):
                for text, _ in self._link.receive():
                    answer = _decoded(decode_frame, text)
                    if isinstance(answer, ServiceAnswer) and answer.call_id == call_id:
                        return answer
        except LinkLost as lost:
            raise self._gone(lost) from lost
        return None

    def _ping(self) -> tuple[float, float]:
        """Return typical and longest time of an answer to a ping, s; 1 s stands for none."""
        times = []
        try:
            for _ in range(ROUND_TRIPS):
                sent_ns = self._clock()
                self._link.send_ping(sent_ns.to_bytes(8, "big"))
                until_ns = sent_ns + int(ANSWER_WITHIN_S * NS_PER_S)
                while self._link.newest_pong_ns < sent_ns and self._link.wait_readable(until_ns):
                    self._link.receive()
                answered = self._link.newest_pong_ns >= sent_ns
                times.append((self._link.newest_pong_ns - sent_ns) / NS_PER_S if answered else ANSWER_WITHIN_S)
        except LinkLost as lost:
            raise self._gone(lost) from lost
        return sorted(times)[len(times) // 2], max(times)

    def _gone(self, lost: LinkLost) -> DeviceUnreachable:
        return DeviceUnreachable(str(lost), where=self._url, do="Check the bridge's log on the robot")


def commands_of_others(heard: Heard) -> list[CommandEcho]:
    """Return the velocities that somebody published on the command topic: nothing there is ours."""
    return [sample.value for sample in heard.samples if isinstance(sample.value, CommandEcho)]


def _decoded(decode: Callable[[bytes], T], values: bytes | None) -> T | None:
    if values is None:
        return None
    try:
        return decode(values)
    except ValueError:
        return None
