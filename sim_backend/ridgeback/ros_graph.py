"""The ROS graph behind the emulated bridge: topics with their types, publishers and subscribers.

A message is a plain dict of JSON-compatible values. The robot's nodes subscribe with a function; clients of the bridge
subscribe with a `Subscription`, which gets the message's JSON, encoded once for all of them.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from typing import Any, Protocol

from robot_io.errors import ConfigError
from sim_backend.ridgeback.ros_types import RosTypes

Message = dict[str, Any]
BRIDGE_NODE = "/rosbridge_websocket"


class Subscription(Protocol):
    """A client's subscription to a topic."""

    def deliver(self, message_json: str) -> None:
        """Deliver one message."""
        ...


class Topic:
    """One topic. `nodes` publish on it, and so do the clients in `advertisers`, which count as one node, the bridge."""

    def __init__(self, name: str, type_name: str) -> None:
        self.name = name
        self.type_name = type_name
        self.nodes: set[str] = set()
        self.advertisers: set[object] = set()
        self.listeners: dict[str, Callable[[Message], None]] = {}
        self.subscriptions: list[Subscription] = []
        self.latched: Message | None = None
        self.bridge_sequence = 0
        """How many messages the bridge has published here; ROS 1 writes it into their headers."""

    def publishers(self) -> list[str]:
        """Return the names of the nodes that publish."""
        return sorted([*self.nodes, *([BRIDGE_NODE] if self.advertisers else [])])

    def subscribers(self) -> list[str]:
        """Return the names of the nodes that subscribe."""
        return sorted([*self.listeners, *([BRIDGE_NODE] if self.subscriptions else [])])


class RosGraph:
    """All topics, by full name."""

    def __init__(self, types: RosTypes) -> None:
        self.types = types
        self.topics: dict[str, Topic] = {}
        self._spellings: set[str] = set()
        self.alter: Callable[[str, Message], Message | None] | None = None
        """What becomes of a message on the topic of that name before anybody gets it; None: nobody does."""

    def resolve(self, name: str) -> str:
        """Return a topic's full name."""
        return name if name.startswith("/") else f"/{name}"

    def declare(self, name: str, type_name: str) -> Topic | None:
        """Return the topic of that name and type, created if new; None if its type differs or is unknown."""
        canonical = self.types.canonical(type_name)
        if canonical is None:
            return None
        topic = self.topics.setdefault(self.resolve(name), Topic(self.resolve(name), canonical))
        if topic.type_name != canonical:
            return None
        self._spellings.add(name)
        return topic

    def provide(self, name: str, type_name: str, node: str = "") -> Topic:
        """Declare a topic of the robot itself, on which `node` publishes. Raises ConfigError if that fails."""
        topic = self.declare(name, type_name.replace("/msg/", "/"))  # a rig file may spell it either way
        if topic is None:
            raise ConfigError(
                f"{name}: the emulated robot has no topic of type {type_name}",
                where="base.topics",
                do="Correct the topic's name or type (or ros_version)",
            )
        if node:
            topic.nodes.add(node)
        return topic

    def find(self, name: str) -> Topic | None:
        """Return a topic by name alone: its full name, or another one that was declared with a type before."""
        return self.topics.get(self.resolve(name) if name in self._spellings else name)

    def wanted(self, name: str) -> bool:
        """Return whether the topic has subscribers."""
        topic = self.topics.get(name)
        return topic is not None and bool(topic.subscriptions or topic.listeners)

    def publish(self, topic: Topic, message: Message, *, latch: bool = False) -> None:
        """Deliver a complete message to all subscribers."""
        if self.alter is not None:
            altered = self.alter(topic.name, message)
            if altered is None:
                return
            message = altered
        if latch:
            topic.latched = message
        for listen in list(topic.listeners.values()):
            listen(message)
        if topic.subscriptions:
            text = message_json(message)
            for subscription in list(topic.subscriptions):
                subscription.deliver(text)


def message_json(message: Message) -> str:
    """Return JSON text in which NaN and infinity are null."""
    try:
        return json.dumps(message, separators=(",", ":"), allow_nan=False)
    except ValueError:
        return json.dumps(_without_nan(message), separators=(",", ":"))


def _without_nan(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: _without_nan(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_without_nan(item) for item in value]
    return value
