"""The velocity multiplexer of a Ridgeback, pure: of all active inputs, the one with the highest priority drives.

An input is active until its timeout after its last message. A lock whose last message was `true` masks every input
of lower priority; the stock lock never expires. A masked message is dropped: no zero is sent in its place.
Figures: ridgeback_control (twist_mux.yaml).
"""

from __future__ import annotations

from typing import NamedTuple

from robot_io.clock import NS_PER_S


class MuxInput(NamedTuple):
    """A topic that may drive the base."""

    topic: str
    priority: int
    timeout_s: float = 0.5


EXTERNAL = "/cmd_vel"
JOYSTICK = "/joy_teleop/cmd_vel"
LOCK_TOPIC = "/e_stop"
LOCK_PRIORITY = 255
STOCK_INPUTS = (
    MuxInput(JOYSTICK, 10),
    MuxInput("/bluetooth_teleop/cmd_vel", 9),
    MuxInput("/twist_marker_server/cmd_vel", 8),
    MuxInput(EXTERNAL, 1),
)


class TwistMux:
    """Decides for each message whether its input may drive."""

    def __init__(self, inputs: tuple[MuxInput, ...] = STOCK_INPUTS) -> None:
        self._inputs = {entry.topic: entry for entry in inputs}
        self._heard_ns: dict[str, int] = {}
        self.locked = False

    def passes(self, topic: str, now_ns: int) -> bool:
        """Record a message on an input topic; return whether it goes through to the wheels."""
        self._heard_ns[topic] = now_ns
        alive = [
            entry
            for entry in self._inputs.values()
            if entry.topic in self._heard_ns and now_ns - self._heard_ns[entry.topic] <= entry.timeout_s * NS_PER_S
        ]
        winner = max(alive, key=lambda entry: entry.priority)
        return winner.topic == topic and not (self.locked and winner.priority < LOCK_PRIORITY)
