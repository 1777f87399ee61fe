"""Driver of the Clearpath Ridgeback over rosbridge (v2, websocket): velocity out; pose, odometry, status in.

One thread, never blocking after `start`: call `drain` when `fileno()` is readable and at least every 20 ms.
What the bridge gets wrong is handled here: it never reports an error (checked beforehand by
`preflight`, and by hearing our own commands back), it delivers old commands after a hang (nothing
that moves is sent on a quiet link; one that is quiet, or echoes none of our commands, for 0.3 s is given up for good
and gets nothing but zeros, which are then delivered behind what moved), and it forwards NaN, which the base takes for
full speed backwards (refused). The base itself stops 0.25 s after the last command.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Literal, Self

from msgspec.structs import replace

from robot_io.clock import NS_PER_MS, NS_PER_S, ClockNs, monotonic_ns
from robot_io.driver import DriverBase, no_more_options
from robot_io.errors import ConfigError, DeviceUnreachable
from robot_io.messages import BaseFeed, BodyTwist, CommandEcho, DeviceHealth, DeviceInfo, LinkState, Pose2D, Stamped
from robot_io.ridgeback.clock_offset import ask_clock
from robot_io.ridgeback.echo_watch import EchoWatch
from robot_io.ridgeback.feeds import FeedReader, feed_types, with_full_names
from robot_io.ridgeback.intake import Intake
from robot_io.ridgeback.open_socket import parse_url
from robot_io.ridgeback.pending import PendingSamples
from robot_io.ridgeback.preflight import check_topics, join
from robot_io.ridgeback.rosbridge_codec import check_finite, encode_twist, spell_type
from robot_io.ridgeback.sole_command import check_alone
from robot_io.ridgeback.websocket_link import LinkLost, WebSocketLink
from robot_io.rig.topics import TopicsConfig

PoseSource = Literal["mocap", "odometry", "joint_states"]

FRESH_NS = 70 * NS_PER_MS
"""Nothing that moves is sent when the newest message from the bridge is older than this: 7 commands at 100 Hz."""
LINK_STALE_NS = 300 * NS_PER_MS
"""The link is given up when nothing has come from the bridge for this long, or no command of ours was heard back."""
BACKLOG_NS = 200 * NS_PER_MS
"""The link is reset when more waits than can be read, for longer than this."""
FIRST_MESSAGE_TIMEOUT_S = 4.0

ZERO = BodyTwist()


class Ridgeback(DriverBase):
    """A Ridgeback behind rosbridge: takes velocities (m/s, rad/s, BODY frame), gives pose, odometry and status.

    url: `ws://host:port` of the bridge, or `wss://...` for an encrypted one, whose certificate is checked.
    topics: names and types of the base's ROS topics.
    pose_source: which topic says where the base is: `"mocap"`, `"odometry"` or `"joint_states"`.
    base_from_marker: x (m), y (m), yaw (rad) of the motion capture's marker frame in the BODY frame.
    clock: stamps the samples and judges the link, in ns; CLOCK_MONOTONIC unless a test brings its own.
    before_close: called with the descriptor just before the socket is closed, also when the link is given up: an event
        loop must forget it then.

    Raises ConfigError: an address that is no websocket url, topics that cannot serve the pose source. Starts no thread.
    """

    def __init__(
        self,
        url: str,
        *,
        topics: TopicsConfig = TopicsConfig(),  # noqa: B008 - frozen
        pose_source: PoseSource = "mocap",
        base_from_marker: tuple[float, float, float] = (0.0, 0.0, 0.0),
        clock: ClockNs = monotonic_ns,
        before_close: Callable[[int], None] | None = None,
    ) -> None:
        parse_url(url)
        self.url = url
        self.before_close = before_close
        self._clock = clock
        topics = with_full_names(topics)
        self._topic = topics.command
        self._type = spell_type(topics.command_type, topics.ros_version)
        if not self._topic:
            raise ConfigError("the base needs a command topic", where="base.topics.command", do="Name it")
        self._types = feed_types(topics, pose_source)
        self._reader = FeedReader(topics, pose_source, Pose2D(*base_from_marker))
        self._link: WebSocketLink | None = None
        self._state = LinkState.CLOSED
        self._cause = ""
        self._pending = PendingSamples()
        self._intake = Intake(self._reader, clock)
        self._echoes = EchoWatch()
        self._started = False
        self.newest_inbound_ns = 0
        """When the newest message of any topic arrived; 0 before the first."""
        self.newest_pong_ns = 0
        """When the bridge last answered a ping (proves its I/O only); 0 before the first."""
        self.sent_ns = 0
        """When the last command left."""
        self._counters = dict.fromkeys(("sent", "held_back", "unanswered_checks", "pings"), 0)

    @classmethod
    def from_rig(cls, address: str, options: Mapping[str, Any]) -> Self:
        """Return the base at a rig's url; `options` has its topics, pose source and marker, and no others."""
        left = dict(options)
        shared = {name: left.pop(name) for name in ("topics", "pose_source", "base_from_marker") if name in left}
        no_more_options("ridgeback-rosbridge", left)
        return cls(address, **shared)

    def open(self) -> DeviceInfo:
        """Connect, check topics (for 3 s, where `rosapi` is still starting), advertise, subscribe; at most 9 s.

        Nothing is commanded. Raises DeviceUnreachable (unknown name, nothing listens, no handshake, the link broke),
        DeviceProtocolError (no bridge, a certificate that is not trusted, wrong message type) or DeviceNotReady (nobody
        listens to the command topic).
        """
        self.close()
        self._reset()
        self._state = LinkState.OPENING
        self._link = link = WebSocketLink.connect(self.url, self._clock)
        try:
            answers = check_topics(link, self.url, self._topic, {self._topic: self._type, **self._types}, self._clock)
            offset = None if answers.unanswered else ask_clock(link, self._clock)
            join(link, self._topic, self._type, self._types)
        except LinkLost as lost:
            self._give_up(str(lost))
            raise DeviceUnreachable(str(lost), where=self.url, do="Check the bridge's log on the robot") from lost
        except BaseException:
            self.close()
            raise
        self._counters["unanswered_checks"] = len(answers.unanswered)
        return DeviceInfo("ridgeback", self.url, "Ridgeback", link.server, "", answers.remarks(self._topic), offset)

    def start(self) -> None:
        """Wait for the first message of pose, odometry and status, which comes once a second; at most 4 s.

        Raises DeviceNotReady naming the topics that stayed silent, DeviceUnreachable when the link breaks.
        """
        until_ns = self._clock() + int(FIRST_MESSAGE_TIMEOUT_S * NS_PER_S)
        while silent := self._reader.silent_topics():
            if not self._wait(until_ns):
                raise self._intake.refused.explain(silent, self.url, FIRST_MESSAGE_TIMEOUT_S)
            self._receive()
        self._started = True
        if self._link is not None:
            self._state = LinkState.UP

    def take_command(self) -> None:
        """Make sure that nobody else commands the base and that what we send arrives; at most 2.3 s, after `start`.

        Listens to the command topic for 0.3 s, then sends zeros until one is heard back. Raises DeviceNotReady when
        somebody else is heard, or none of ours within 2 s, and DeviceUnreachable when the link breaks.
        """
        check_alone(self._echoes, self._receive_until, lambda: self.command(ZERO), self._clock, self.url)

    def _receive_until(self, until_ns: int) -> None:
        while self._wait(until_ns):
            self._receive()

    def _wait(self, until_ns: int) -> bool:
        """Return whether something arrived before `until_ns`. Raises DeviceUnreachable where the link is gone."""
        if self._link is None or self._state == LinkState.LOST:
            raise DeviceUnreachable(self._cause or "not open", where=self.url, do="Open the driver again")
        return self._link.wait_readable(until_ns)

    def fileno(self) -> int:
        """Return the socket's descriptor, -1 when there is none."""
        return -1 if self._link is None else self._link.fileno()

    def drain(self) -> tuple[Stamped[BaseFeed], ...]:
        """Return every new sample, oldest first (`seq` counts per kind); also keeps the link alive and judged.

        At most 4096; older ones are dropped and counted. Never blocks, never raises; call it at least every 20 ms.
        Takes in at most 200 messages, and about 2 ms of processor time: the rest waits for the next call.
        """
        now_ns = self._clock()  # before looking: what waited while this process was paused is not silence
        self._receive()
        self._tend(now_ns)
        return self._pending.take_all()

    def command(self, wanted: BodyTwist) -> BodyTwist:
        """Send a velocity (m/s, m/s, rad/s, BODY frame); return what was really sent.

        Zero is sent instead when the link has been quiet for 0.07 s or is given up, and zero is returned when nothing
        could be sent (`health` says why): the base then stops by its own timeout. That is 0.25 s after the last
        command, so a motion lasts only as long as commands do. Never blocks. Raises ValueError unless finite.
        """
        check_finite(wanted)
        now_ns = self._clock()
        if now_ns - self.newest_inbound_ns > FRESH_NS:
            self._receive()  # perhaps only nobody has drained
        self._tend(now_ns)
        if self._link is None:
            return ZERO
        if not self._started:
            if self._state == LinkState.LOST:  # what may still be delivered late must be followed by zero
                self._send(ZERO)
            return ZERO
        if wanted != ZERO and now_ns - self.newest_inbound_ns > FRESH_NS:
            self._counters["held_back"] += 1
            wanted = ZERO
        return wanted if self._send(wanted) else ZERO

    def health(self) -> DeviceHealth:
        """Return link state, cause and counters; the rate (Hz) is that of the last 100 poses.

        Counters since `open`: `messages`, `undecodable`, `sent`, `held_back` (motion turned into zero on a quiet link),
        `dropped_samples`, `unanswered_checks`, `pings`, and one for each kind of sample.
        """
        counters = {**self._intake.counters, **self._counters, **self._reader.counters}
        counters["dropped_samples"] = self._pending.dropped
        return DeviceHealth(self._state, self._cause, counters, self._pending.pose_rate_hz())

    def stop(self) -> None:
        """Send zero three times, if the link is up. Never blocks, never raises."""
        for _ in range(3):
            if self._link is not None:
                self._send(ZERO)

    def close(self) -> None:
        """Close the connection within 0.05 s; the bridge forgets us by itself. Idempotent, never raises."""
        link, self._link, self._started = self._link, None, False
        if link is not None:
            self._announce(link)
            link.close()
        self._state = LinkState.CLOSED

    def _reset(self) -> None:
        self._cause = ""
        self._pending.clear()
        self._intake.reset()
        self.newest_inbound_ns = self.newest_pong_ns = self.sent_ns = 0
        self._echoes = EchoWatch()
        self._counters = dict.fromkeys(self._counters, 0)

    def _receive(self) -> None:
        if (link := self._link) is None:
            return
        try:
            samples = self._intake.take(link)
        except LinkLost as lost:
            self._give_up(str(lost))
            return
        if self._state == LinkState.LOST:  # given up: nothing more is believed
            return
        self.newest_inbound_ns = max(self.newest_inbound_ns, self._intake.newest_inbound_ns)
        self.newest_pong_ns = link.newest_pong_ns
        for sample in samples:
            ours = not isinstance(sample.value, CommandEcho) or self._echoes.on_heard(sample.value.twist)
            self._pending.add(sample if ours else replace(sample, value=replace(sample.value, ours=False)))

    def _tend(self, now_ns: int) -> None:
        if self._link is None or not self._started:
            return
        if now_ns - self.newest_inbound_ns > LINK_STALE_NS:
            self._stop_believing(f"no message from the bridge for {LINK_STALE_NS / NS_PER_S:g} s")
        elif self._intake.behind_since_ns and now_ns - self._intake.behind_since_ns > BACKLOG_NS:
            self.stop()
            self._give_up(f"the bridge has sent more than can be read for {BACKLOG_NS / NS_PER_S:g} s")
        elif (since_ns := self._echoes.unheard_since_ns) and now_ns - since_ns > LINK_STALE_NS:  # queued, or discarded
            self._stop_believing(f"the bridge echoed none of our commands for {LINK_STALE_NS / NS_PER_S:g} s")
        else:
            try:
                self._counters["pings"] += self._link.ping_if_due(now_ns)
            except LinkLost as lost:
                self._give_up(str(lost))

    def _send(self, twist: BodyTwist) -> bool:
        payload = encode_twist(self._topic, self._type, twist)
        if self._link is None:
            return False
        try:
            self._link.send_text(payload)
        except LinkLost as lost:
            self._give_up(str(lost))
            return False
        self.sent_ns = self._clock()
        self._echoes.on_sent(twist, self.sent_ns)
        self._counters["sent"] += 1
        return True

    def _stop_believing(self, cause: str) -> None:
        """Give the link up, but keep its connection for zeros.

        A bridge that hangs has commands in hand or in its queue, and delivers at least one of them when it goes on. A
        reset would throw away the zeros behind them, and the base would move once more until its own timeout.
        """
        self._started = False
        self._pending.clear()
        self._state = LinkState.LOST
        self._cause = cause

    def _give_up(self, cause: str) -> None:
        """Reset a connection that is broken or floods us; never reopened from here."""
        link, self._link, self._started = self._link, None, False
        if link is not None:
            self._announce(link)
            link.abort()
        if self._state != LinkState.LOST:  # the first cause stays
            self._cause = cause
        self._state = LinkState.LOST

    def _announce(self, link: WebSocketLink) -> None:
        if self.before_close is not None:
            self.before_close(link.fileno())
