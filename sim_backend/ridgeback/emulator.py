"""An emulated Ridgeback behind a rosbridge websocket: server, ROS graph, the robot's nodes, motion capture.

Single-threaded inside an event loop. The base itself is the `source`: every command that gets through is passed
to it with its arrival time.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable

from robot_io.clock import NS_PER_S, monotonic_ns, wall_offset_ns
from robot_io.ipc.event_loop import EventLoop, Timer
from sim_backend.ridgeback.feeds import FeedWriter
from sim_backend.ridgeback.motion_capture import MotionCapture
from sim_backend.ridgeback.nodes import DIRECT_TOPIC, RidgebackNodes
from sim_backend.ridgeback.ros_graph import RosGraph, Topic
from sim_backend.ridgeback.ros_types import RosTypes
from sim_backend.ridgeback.rosapi.services import Answer, RosApi
from sim_backend.ridgeback.rosbridge_ops import Session
from sim_backend.ridgeback.settings import BridgeSettings, RidgebackSettings
from sim_backend.ridgeback.websocket_server import WebSocketPeer, WebSocketServer
from sim_backend.world.plant import BaseSource

CLIENT_COUNT_TOPIC = "/rosbridge_websocket/client_count"
_MAX_HELD = 50_000
"""Messages kept while frozen or held back; a real bridge's buffers are finite too."""


class RosbridgeEmulator:
    """Serves `ws://host:port` from `loop` until `close`; `port` 0 picks a free one (see `url`).

    Raises UsageError (not a loopback address), ConfigError (impossible topics), EnvironmentFault (port taken).
    """

    def __init__(
        self,
        loop: EventLoop,
        source: BaseSource,
        *,
        host: str = "127.0.0.1",
        port: int = 9090,
        settings: RidgebackSettings = RidgebackSettings(),  # noqa: B008 - frozen
        bridge: BridgeSettings = BridgeSettings(),  # noqa: B008 - frozen
    ) -> None:
        self._loop = loop
        settings = settings.resolved()
        self._bridge = bridge
        self.clock_offset_ns = wall_offset_ns() + round(bridge.clock_skew_s * NS_PER_S)
        self._counters: Counter[str] = Counter()
        self._sessions: dict[WebSocketPeer, Session] = {}
        self._outbox: deque[tuple[int, WebSocketPeer, str]] = deque(maxlen=_MAX_HELD)
        self._release_timer: Timer | None = None
        self.lag_ns = 0
        """Delay of everything sent to the clients."""
        self.hold_ns = 0
        """Everything sent to the clients waits for the next multiple of this time."""
        self.zero_on_new_connection = bridge.zero_on_new_connection
        types = RosTypes(settings.topics.ros_version, lambda: self._stamp(monotonic_ns()))
        self.graph = RosGraph(types)
        self.rosapi = RosApi(self.graph, lambda: self._stamp(monotonic_ns())) if bridge.rosapi else None
        self.answer_delay_ns = round(bridge.answer_delay_s * NS_PER_S)
        """How long `rosapi` takes over each answer."""
        writer = FeedWriter(
            settings.topics.ros_version, lambda t_ns: types.time(self._stamp(t_ns)), settings.base_from_marker
        )
        start_ns = monotonic_ns()
        self.cold_until_ns = start_ns + round(bridge.cold_s * NS_PER_S)
        """Until when `rosapi` is still starting."""
        self.nodes = RidgebackNodes(loop, self.graph, writer, source, settings, start_ns)
        self.mocap = MotionCapture(loop, self.graph, writer, source, settings, start_ns)
        self._client_count = self.graph.provide(CLIENT_COUNT_TOPIC, "std_msgs/Int32", "/rosbridge_websocket")
        self.server = WebSocketServer(
            loop,
            host,
            port,
            on_open=self._on_open,
            on_text=self._on_text,
            on_close=self._on_close,
            nagle=bridge.nagle,
            ping_interval_s=bridge.ping_interval_s,
            ping_timeout_s=bridge.ping_timeout_s,
        )

    @property
    def url(self) -> str:
        """The address to connect to."""
        return f"ws://{self.server.host}:{self.server.port}"

    @property
    def counters(self) -> dict[str, int]:
        """Clients opened and closed, texts received and sent, requests ignored, commands forwarded and masked."""
        return {
            **self._counters,
            "commands_forwarded": self.nodes.commands_forwarded,
            "commands_masked": self.nodes.commands_masked,
        }

    def release(self, _: int = 0) -> None:
        """Send delayed messages that are due by now; nothing while frozen."""
        self._release_timer = None
        while self.server.running and self._outbox and self._outbox[0][0] <= monotonic_ns():
            _, peer, text = self._outbox.popleft()
            peer.send_text(text)
        if self.server.running and self._outbox:
            self._release_timer = self._loop.call_at(self._outbox[0][0], self.release)

    def close(self) -> None:
        """Stop everything; idempotent."""
        self.nodes.close()
        self.mocap.close()
        self.server.close()
        if self._release_timer is not None:
            self._release_timer.cancel()

    def _stamp(self, t_ns: int) -> tuple[int, int]:
        return divmod(t_ns + self.clock_offset_ns, NS_PER_S)

    def _on_open(self, peer: WebSocketPeer) -> None:
        self._counters["clients_opened"] += 1
        self._sessions[peer] = Session(
            self._loop,
            self.graph,
            self._call_service,
            lambda text: self._send(peer, text),
            self._counters,
            escape_slashes=self._bridge.escape_slashes,
            on_new_connection=self._on_new_connection,
        )
        self._publish_client_count()

    def _call_service(self, service: str, arguments: object, on_answer: Callable[[Answer], None]) -> None:
        now_ns = monotonic_ns()
        if self.rosapi is None or now_ns < self.cold_until_ns:
            on_answer((False, f"Service {self.graph.resolve(service)} does not exist"))
        elif self.answer_delay_ns:
            answer = self.rosapi.call(service, arguments)
            self._loop.call_at(now_ns + self.answer_delay_ns, lambda _: on_answer(answer))
        else:
            on_answer(self.rosapi.call(service, arguments))

    def _on_text(self, peer: WebSocketPeer, text: str) -> None:
        session = self._sessions.get(peer)
        if session is not None:  # None: this client was dropped because of an earlier message
            self._counters["received"] += 1
            session.incoming(text)

    def _on_close(self, peer: WebSocketPeer) -> None:
        self._counters["clients_closed"] += 1
        self._sessions.pop(peer).close()
        self._publish_client_count()

    def _on_new_connection(self, topic: Topic) -> None:
        if self.zero_on_new_connection and topic.name in {DIRECT_TOPIC, *self.nodes.command_topics}:
            self.nodes.zero_once()

    def _publish_client_count(self) -> None:
        self.graph.publish(self._client_count, {"data": len(self._sessions)}, latch=True)

    def _send(self, peer: WebSocketPeer, text: str) -> None:
        self._counters["sent"] += 1
        now_ns = monotonic_ns()
        due_ns = now_ns + self.lag_ns
        if self.hold_ns:
            due_ns = -(-due_ns // self.hold_ns) * self.hold_ns
        if due_ns <= now_ns and self.server.running and not self._outbox:
            peer.send_text(text)
            return
        self._outbox.append((due_ns, peer, text))
        if self._release_timer is None and self.server.running:
            self._release_timer = self._loop.call_at(self._outbox[0][0], self.release)
