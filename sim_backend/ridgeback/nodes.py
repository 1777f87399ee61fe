"""The nodes of an emulated Ridgeback on the ROS graph: multiplexer, wheels, odometry, microcontroller.

Rates: wheel odometry 25 Hz (the wheel controller's tick), filtered odometry 50 Hz, status 1 Hz and at once on a
change; each on its own absolute time grid. A command topic that is not an input of the multiplexer is treated as
the authors' relay, which bypasses the multiplexer.
"""

from __future__ import annotations

from collections.abc import Callable

from robot_io.clock import NS_PER_S, monotonic_ns
from robot_io.ipc.event_loop import EventLoop, Timer
from robot_io.messages import BaseStatus, BodyTwist
from sim_backend.ridgeback.feeds import FeedWriter, seen_from, twist_of
from sim_backend.ridgeback.noise import FeedNoise
from sim_backend.ridgeback.ros_graph import Message, RosGraph
from sim_backend.ridgeback.settings import RidgebackSettings
from sim_backend.ridgeback.twist_mux import JOYSTICK, LOCK_TOPIC, STOCK_INPUTS, TwistMux
from sim_backend.world.plant import BaseSource

DIRECT_TOPIC = "/ridgeback_velocity_controller/cmd_vel"
WHEEL_ODOMETRY_TOPIC = "/ridgeback_velocity_controller/odom"
WHEEL_NODE = "/ridgeback_node"
MUX_NODE = "/twist_mux"
TICK_RATE_HZ = 25.0
FILTERED_RATE_HZ = 50.0
STATUS_RATE_HZ = 1.0


class RidgebackNodes:
    """Publishes and subscribes on `graph` from `start_ns` (CLOCK_MONOTONIC) until `close`."""

    def __init__(
        self,
        loop: EventLoop,
        graph: RosGraph,
        writer: FeedWriter,
        source: BaseSource,
        settings: RidgebackSettings,
        start_ns: int,
    ) -> None:
        self._graph, self._writer, self._source = graph, writer, source
        self._topics = topics = settings.topics
        self._start_ns = start_ns
        self._origin = source.read_base(start_ns).rolled
        self._noise = FeedNoise(settings, "odometry")
        self._mux = TwistMux()
        self.status = BaseStatus(stop_engaged=False, drivers_active=True, battery_v=settings.battery_v)
        self.commands_forwarded = 0
        self.commands_masked = 0
        self.command_topics = {topics.command, *(entry.topic for entry in STOCK_INPUTS)} - {DIRECT_TOPIC}
        graph.provide(DIRECT_TOPIC, topics.command_type, MUX_NODE)
        for name in sorted(self.command_topics):
            graph.provide(name, topics.command_type)
        graph.provide(LOCK_TOPIC, "std_msgs/Bool").listeners[MUX_NODE] = self._lock
        graph.provide(WHEEL_ODOMETRY_TOPIC, "nav_msgs/Odometry", WHEEL_NODE)
        if topics.odometry and topics.odometry != WHEEL_ODOMETRY_TOPIC:
            graph.provide(topics.odometry, topics.odometry_type, "/ekf_localization")
        if topics.status:
            graph.provide(topics.status, topics.status_type, WHEEL_NODE)
        self.set_listening(True)
        speed_up = 1.0 + settings.base_rate_error
        self._timers: list[Timer] = []
        for rate_hz, phase, tick in (
            (TICK_RATE_HZ, settings.base_phase, self._wheel_tick),
            (FILTERED_RATE_HZ, 0.11, self._filtered_tick),
            (STATUS_RATE_HZ, 0.71, self._status_tick),
        ):
            period_ns = round(NS_PER_S / (rate_hz * speed_up))
            self._timers.append(loop.call_every(period_ns, tick, start_ns + round(phase * period_ns)))

    @property
    def command_topic(self) -> str:
        """Name of the topic that the rig commands."""
        return self._topics.command

    def set_listening(self, on: bool) -> None:
        """Subscribe the nodes behind the command topics, or unsubscribe them."""
        for name in self.command_topics:
            self._listen(name, MUX_NODE, self._listener(name) if on else None)
        self._listen(DIRECT_TOPIC, WHEEL_NODE, self._drive if on else None)

    def set_status(self, status: BaseStatus) -> None:
        """Change stop, motors or battery; a change of the first two is published at once and reaches the wheels."""
        before, self.status = self.status, status
        now_ns = monotonic_ns()
        if status.drivers_active != before.drivers_active:
            self._source.set_drivers(status.drivers_active, now_ns)
        if (status.stop_engaged, status.drivers_active) != (before.stop_engaged, before.drivers_active):
            self._status_tick(now_ns)

    def joystick(self, twist: BodyTwist) -> None:
        """Send one joystick command; it overrides all other inputs for half a second."""
        topic = self._graph.topics[JOYSTICK]
        message: Message = {"linear": {"x": twist.vx, "y": twist.vy}, "angular": {"z": twist.omega}}
        if topic.type_name.endswith("TwistStamped"):
            message = {"header": {}, "twist": message}
        self._graph.publish(topic, self._graph.types.filled(topic.type_name, message))

    def zero_once(self) -> None:
        """Send one zero to the wheels, as observed when a new client connects to the command topic."""
        self._source.command_base(BodyTwist(), monotonic_ns())

    def close(self) -> None:
        """Stop publishing."""
        for timer in self._timers:
            timer.cancel()

    def _listen(self, name: str, node: str, listener: Callable[[Message], None] | None) -> None:
        listeners = self._graph.topics[name].listeners
        if listener is None:
            listeners.pop(node, None)
        else:
            listeners[node] = listener

    def _listener(self, name: str) -> Callable[[Message], None]:
        relayed = name not in {entry.topic for entry in STOCK_INPUTS}

        def listen(message: Message) -> None:
            if relayed or self._mux.passes(name, monotonic_ns()):
                self._graph.publish(self._graph.topics[DIRECT_TOPIC], message)
            else:
                self.commands_masked += 1

        return listen

    def _drive(self, message: Message) -> None:
        self.commands_forwarded += 1
        self._source.command_base(twist_of(message), monotonic_ns())

    def _lock(self, message: Message) -> None:
        self._mux.locked = message["data"]

    def _wheel_tick(self, t_ns: int) -> None:
        self._odometry(WHEEL_ODOMETRY_TOPIC, t_ns)

    def _filtered_tick(self, t_ns: int) -> None:
        if self._topics.odometry != WHEEL_ODOMETRY_TOPIC:
            self._odometry(self._topics.odometry, t_ns)

    def _odometry(self, name: str, t_ns: int) -> None:
        if self._graph.wanted(name):
            truth = self._source.read_base(t_ns)
            pose, twist = seen_from(self._origin, truth.rolled), self._noise.twist(truth.twist)
            message = self._writer.odometry(name, pose, twist, t_ns)
            self._graph.publish(self._graph.topics[name], message)

    def _status_tick(self, t_ns: int) -> None:
        name = self._topics.status
        if self._graph.wanted(name):
            self._graph.publish(self._graph.topics[name], self._writer.status(name, self.status, self._start_ns, t_ns))
