"""The services of the `rosapi` node that a client of the bridge may call."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from sim_backend.ridgeback.ros_graph import BRIDGE_NODE, RosGraph
from sim_backend.ridgeback.ros_types import RosTime

Answer = tuple[bool, Any]


class RosApi:
    """Answers service calls: (True, values) or (False, error text)."""

    def __init__(self, graph: RosGraph, now: Callable[[], RosTime]) -> None:
        self._graph = graph
        self._now = now
        self._services: dict[str, tuple[tuple[str, ...], Callable[..., dict[str, Any]]]] = {
            "/rosapi/topic_type": (("topic",), self._topic_type),
            "/rosapi/publishers": (("topic",), self._publishers),
            "/rosapi/subscribers": (("topic",), self._subscribers),
            "/rosapi/topics": ((), self._topics),
            "/rosapi/topics_and_raw_types": ((), self._topics_and_raw_types),
            "/rosapi/topics_for_type": (("type",), self._topics_for_type),
            "/rosapi/nodes": ((), self._nodes),
            "/rosapi/services": ((), self._list_services),
            "/rosapi/service_type": (("service",), self._service_type),
            "/rosapi/get_param_names": ((), lambda: {"names": []}),
            "/rosapi/has_param": (("name",), lambda _: {"exists": False}),
            "/rosapi/get_param": (("name", "default"), lambda _, default: {"value": default or "null"}),
            "/rosapi/get_time": ((), self._get_time),
        }

    def call(self, service: str, arguments: object) -> Answer:
        """Call a service with an object of named arguments or an ordered list; missing arguments are empty."""
        name = self._graph.resolve(service)
        if name not in self._services:
            return False, f"Service {name} does not exist"
        fields, function = self._services[name]
        if isinstance(arguments, list):
            arguments = dict(zip(fields, arguments, strict=False))
        if not isinstance(arguments, dict):
            arguments = {}
        wrong = [key for key, value in arguments.items() if key not in fields or not isinstance(value, str)]
        if wrong:
            return False, f"{service}: no such argument, or not a string: {wrong[0]}"
        return True, function(*(arguments.get(field, "") for field in fields))

    def _topic_type(self, name: str) -> dict[str, Any]:
        topic = self._graph.topics.get(name)
        return {"type": topic.type_name if topic else ""}

    def _publishers(self, name: str) -> dict[str, Any]:
        topic = self._graph.topics.get(name)
        return {"publishers": topic.publishers() if topic else []}

    def _subscribers(self, name: str) -> dict[str, Any]:
        topic = self._graph.topics.get(name)
        return {"subscribers": topic.subscribers() if topic else []}

    def _topics(self) -> dict[str, Any]:
        topics = sorted(self._graph.topics.values(), key=lambda topic: topic.name)
        return {"topics": [topic.name for topic in topics], "types": [topic.type_name for topic in topics]}

    def _topics_and_raw_types(self) -> dict[str, Any]:
        listed = self._topics()
        return {**listed, "typedefs_full_text": [self._graph.types.full_text(name) for name in listed["types"]]}

    def _topics_for_type(self, type_name: str) -> dict[str, Any]:
        return {"topics": sorted(topic.name for topic in self._graph.topics.values() if topic.type_name == type_name)}

    def _nodes(self) -> dict[str, Any]:
        topics = self._graph.topics.values()
        nodes = {node for topic in topics for node in (*topic.publishers(), *topic.subscribers())}
        return {"nodes": sorted({BRIDGE_NODE, "/rosapi", *nodes})}

    def _list_services(self) -> dict[str, Any]:
        return {"services": sorted(self._services)}

    def _service_type(self, service: str) -> dict[str, Any]:
        words = service.rpartition("/")[2].split("_") if service in self._services else []
        return {"type": f"rosapi/{''.join(map(str.capitalize, words))}" if words else ""}

    def _get_time(self) -> dict[str, Any]:
        return {"time": self._graph.types.time(self._now())}
