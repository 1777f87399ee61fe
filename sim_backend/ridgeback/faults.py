"""Fault injection for a base behind a bridge: times in s, from now."""

from __future__ import annotations

from collections.abc import Callable

import msgspec

from robot_io.clock import NS_PER_S, monotonic_ns
from robot_io.ipc.event_loop import EventLoop, Timer
from robot_io.messages import BodyTwist, Pose2D
from sim_backend.ridgeback.emulator import RosbridgeEmulator
from sim_backend.ridgeback.ros_graph import Message, Topic
from sim_backend.ridgeback.websocket_server import WebSocketPeer

_JOYSTICK_PERIOD_NS = NS_PER_S // 20
_BURST_OUT_NS = 1_000_000
"""After a freeze the clients' backlog is read first; then the outgoing backlog is sent."""


class BridgeFaults:
    """Faults of one emulated bridge; those with a duration end by themselves."""

    def __init__(self, loop: EventLoop, emulator: RosbridgeEmulator) -> None:
        self._loop = loop
        self._emulator = emulator
        self._timers: list[Timer] = []

    def freeze(self, seconds: float) -> None:
        """Stop the bridge's process; afterwards it processes its backlog, in and out, in one burst."""
        self._emulator.server.set_running(False)
        self._after(seconds, self._thaw)

    def kill(self) -> None:
        """Kill the bridge's process: connections are reset, nothing listens."""
        self._emulator.server.kill()

    def restart(self, after_s: float) -> None:
        """Kill it, and start it again on the same port; clients must reconnect and subscribe again."""
        self.kill()
        self._after(after_s, self._emulator.server.listen)

    def half_open(self) -> None:
        """Drop every packet of the current clients silently, in both directions."""
        for peer in list(self._emulator.server.peers):
            peer.silent = True
            peer.watch(False)

    def stop_reading(self, seconds: float) -> None:
        """Read nothing from the current clients, but continue sending to them."""
        peers = list(self._emulator.server.peers)
        self._set_reading(peers, False)
        self._after(seconds, lambda: self._set_reading(peers, True))

    def lag(self, seconds: float) -> None:
        """Delay everything sent to the clients by this time (0 ends it); stamps age meanwhile."""
        self._emulator.lag_ns = round(seconds * NS_PER_S)

    def hold(self, seconds: float) -> None:
        """Send messages to the clients only at multiples of this time, as Nagle's algorithm may (0 ends it)."""
        self._emulator.hold_ns = round(seconds * NS_PER_S)

    def occlude_base(self, seconds: float) -> None:
        """Hide the base from motion capture."""
        self._emulator.mocap.base_hidden_until_ns = monotonic_ns() + round(seconds * NS_PER_S)

    def occlude_slider(self, seconds: float) -> None:
        """Hide the pushed object from motion capture."""
        self._emulator.mocap.slider_hidden_until_ns = monotonic_ns() + round(seconds * NS_PER_S)

    def jump_pose(self, offset: Pose2D, seconds: float) -> None:
        """Shift the base's pose in motion capture (m, m, rad), as when markers are mislabelled."""
        self._emulator.mocap.offset = offset
        self._after(seconds, lambda: setattr(self._emulator.mocap, "offset", Pose2D()))

    def subscriber_missing(self, missing: bool = True) -> None:
        """Remove the subscribers of the command topics, or restore them."""
        self._emulator.nodes.set_listening(not missing)

    def press_stop(self) -> None:
        """Press a hardware stop: motors off, wheels locked, status published at once."""
        self._status(stop_engaged=True, drivers_active=False)

    def release_stop(self) -> None:
        """Release the stop and press reset: motors on."""
        self._status(stop_engaged=False, drivers_active=True)

    def battery(self, volt: float) -> None:
        """Set the battery's voltage; visible in the next status (1 Hz)."""
        self._status(battery_v=volt)

    def motors_off(self) -> None:
        """Switch the motors off without a stop."""
        self._status(drivers_active=False)

    def other_publisher(self, node: str = "/teleop") -> None:
        """Let another node be a publisher of the command topic; it stays silent."""
        self._command().nodes.add(node)

    def other_client(self) -> None:
        """Let another client of the bridge be a publisher of the command topic; it stays silent."""
        self._command().advertisers.add(self)

    def other_commands(self, twist: BodyTwist) -> None:
        """Let another node command the base at 20 Hz, for good."""
        graph, topic = self._emulator.graph, self._command()
        message = {"linear": {"x": twist.vx, "y": twist.vy}, "angular": {"z": twist.omega}}
        filled = graph.types.filled("geometry_msgs/Twist", message)
        self._timers.append(self._loop.call_every(_JOYSTICK_PERIOD_NS, lambda _: graph.publish(topic, filled)))

    def topic_type(self, topic: str, type_name: str) -> None:
        """Let a topic carry another type."""
        self._emulator.graph.topics[topic].type_name = type_name

    def no_rosapi(self) -> None:
        """Run the bridge without rosapi, for clients that come later."""
        self._emulator.rosapi = None

    def cold(self, seconds: float) -> None:
        """Let rosapi be starting for so long: its services do not exist yet."""
        self._emulator.cold_until_ns = monotonic_ns() + round(seconds * NS_PER_S)

    def slow_answers(self, seconds: float) -> None:
        """Let rosapi take so long over each answer (0 ends it)."""
        self._emulator.answer_delay_ns = round(seconds * NS_PER_S)

    def set_clock(self, ahead_s: float) -> None:
        """Set the robot's clock ahead of what it is."""
        self._emulator.clock_offset_ns += round(ahead_s * NS_PER_S)

    def alter(self, change: Callable[[str, Message], Message | None]) -> None:
        """Change or drop (None) messages by topic before anybody gets them."""
        self._emulator.graph.alter = change

    def joystick(self, twist: BodyTwist, seconds: float) -> None:
        """Drive by joystick at 20 Hz; it overrides all other inputs until half a second afterwards."""
        until_ns = monotonic_ns() + round(seconds * NS_PER_S)

        def press(now_ns: int) -> None:
            if now_ns > until_ns:
                timer.cancel()
            else:
                self._emulator.nodes.joystick(twist)

        timer = self._loop.call_every(_JOYSTICK_PERIOD_NS, press, monotonic_ns())
        self._timers.append(timer)

    def close(self) -> None:
        """Cancel all pending faults."""
        for timer in self._timers:
            timer.cancel()

    def _command(self) -> Topic:
        return self._emulator.graph.topics[self._emulator.nodes.command_topic]

    def _after(self, seconds: float, action: Callable[[], None]) -> None:
        deadline_ns = monotonic_ns() + round(seconds * NS_PER_S)
        self._timers.append(self._loop.call_at(deadline_ns, lambda _: action()))

    def _thaw(self) -> None:
        self._emulator.server.set_running(True)
        self._loop.call_at(monotonic_ns() + _BURST_OUT_NS, self._emulator.release)

    def _set_reading(self, peers: list[WebSocketPeer], reading: bool) -> None:
        for peer in peers:
            peer.reading = reading
            peer.watch(self._emulator.server.running)

    def _status(self, **changes: bool | float) -> None:
        nodes = self._emulator.nodes
        nodes.set_status(msgspec.structs.replace(nodes.status, **changes))
