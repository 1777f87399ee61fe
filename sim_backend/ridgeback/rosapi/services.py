"""Answers the services of the `rosapi` node."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from sim_backend.ridgeback.ros_graph import BRIDGE_NODE, RosGraph
from sim_backend.ridgeback.ros_types import DEFINITIONS, RosTime
from sim_backend.ridgeback.rosapi.definitions import TYPEDEF_FIELDS, package, service_type, services
from sim_backend.ridgeback.rosapi.typedefs import TypeDef, TypeDefs

Answer = tuple[bool, Any]
ROSAPI_NODE = "/rosapi"
NO_PARAMETER = {"successful": False, "reason": "the node has no such parameter"}


class _Failed(Exception):
    """The service failed; the text reaches the caller."""


class RosApi:
    """Answers service calls: (True, values) or (False, error text)."""

    def __init__(self, graph: RosGraph, now: Callable[[], RosTime]) -> None:
        self._graph = graph
        self._now = now
        self._version = graph.types.ros_version
        self._known = services(self._version)
        """Fields of request and answer by service."""
        self._names = {service_type(name, self._version): name for name in self._known}
        """The service of each type."""
        self._typedefs = TypeDefs(graph.types, {f"{package(self._version)}/TypeDef": TYPEDEF_FIELDS})
        self._parameters: dict[str, str] = {}

    def call(self, service: str, arguments: object) -> Answer:
        """Call a service with an object of named arguments or an ordered list; missing arguments are empty."""
        name = self._graph.resolve(service)
        if name not in self._known:
            return False, f"Service {name} does not exist"
        fields = [field for field, _ in self._known[name][0]]
        if isinstance(arguments, list):
            arguments = dict(zip(fields, arguments, strict=False))
        if not isinstance(arguments, dict):
            arguments = {}
        wrong = [key for key, value in arguments.items() if key not in fields or not isinstance(value, str)]
        if wrong:
            return False, f"{service}: no such argument, or not a string: {wrong[0]}"
        try:
            values = getattr(self, f"_{name.rpartition('/')[2]}")(*(arguments.get(field, "") for field in fields))
        except _Failed as failed:
            return False, f"service [{name}] responded with an error: error processing request: {failed}"
        return True, values

    # Topics and nodes.

    def _topics(self) -> dict[str, Any]:
        topics = sorted(self._graph.topics.values(), key=lambda topic: topic.name)
        return {"topics": [topic.name for topic in topics], "types": [topic.type_name for topic in topics]}

    def _topics_and_raw_types(self) -> dict[str, Any]:
        listed = self._topics()
        return {**listed, "typedefs_full_text": [self._graph.types.full_text(name) for name in listed["types"]]}

    def _topics_for_type(self, type_name: str) -> dict[str, Any]:
        return {"topics": sorted(topic.name for topic in self._graph.topics.values() if topic.type_name == type_name)}

    def _topic_type(self, name: str) -> dict[str, Any]:
        topic = self._graph.topics.get(name)
        return {"type": topic.type_name if topic else ""}

    def _publishers(self, name: str) -> dict[str, Any]:
        topic = self._graph.topics.get(name)
        return {"publishers": topic.publishers() if topic else []}

    def _subscribers(self, name: str) -> dict[str, Any]:
        topic = self._graph.topics.get(name)
        return {"subscribers": topic.subscribers() if topic else []}

    def _nodes(self) -> dict[str, Any]:
        topics = self._graph.topics.values()
        nodes = {node for topic in topics for node in (*topic.publishers(), *topic.subscribers())}
        return {"nodes": sorted({BRIDGE_NODE, ROSAPI_NODE, *nodes})}

    def _node_details(self, node: str) -> dict[str, Any]:
        topics = sorted(self._graph.topics.values(), key=lambda topic: topic.name)
        return {
            "subscribing": [topic.name for topic in topics if node in topic.subscribers()],
            "publishing": [topic.name for topic in topics if node in topic.publishers()],
            "services": sorted(self._known) if node == ROSAPI_NODE else [],
        }

    def _action_servers(self) -> dict[str, Any]:
        return {"action_servers": []}

    # Services.

    def _services(self) -> dict[str, Any]:
        return {"services": sorted(self._known)}

    def _services_for_type(self, type_name: str) -> dict[str, Any]:
        return {"services": [self._names[type_name]] if type_name in self._names else []}

    def _service_type(self, name: str) -> dict[str, Any]:
        return {"type": service_type(name, self._version) if name in self._known else ""}

    def _service_node(self, name: str) -> dict[str, Any]:
        return {"node": ROSAPI_NODE if name in self._known else ""}

    def _service_host(self, name: str) -> dict[str, Any]:
        return {"host": "localhost" if name in self._known else ""}

    def _service_providers(self, type_name: str) -> dict[str, Any]:
        return {"providers": [ROSAPI_NODE] if type_name in self._names else []}

    # Types.

    def _message_details(self, type_name: str) -> dict[str, Any]:
        found = self._typedefs.of_message(type_name)
        if found is None and self._version == 1:
            raise _Failed(f"Unable to import {type_name}")
        return {"typedefs": found or []}

    def _service_request_details(self, type_name: str) -> dict[str, Any]:
        return {"typedefs": self._details(type_name, 0, "Request")}

    def _service_response_details(self, type_name: str) -> dict[str, Any]:
        return {"typedefs": self._details(type_name, 1, "Response")}

    def _details(self, type_name: str, part: int, suffix: str) -> list[TypeDef]:
        short = type_name.replace("/srv/", "/")
        spelt = short.replace("/", "/srv/") if self._version == 2 else type_name
        if spelt not in self._names:
            raise _Failed(f"Unable to import {type_name}")
        name = f"{short}_{suffix}" if self._version == 2 else f"{short}{suffix}"
        return self._typedefs.of_fields(name, self._known[self._names[spelt]][part])

    def _interfaces(self) -> dict[str, Any]:
        messages = [name.replace("/", "/msg/") for name in DEFINITIONS]
        return {"interfaces": sorted([*messages, *self._names])}

    # Parameters: of ROS 1's server any, of ROS 2's nodes none. Time and version.

    def _get_param_names(self) -> dict[str, Any]:
        return {"names": sorted(self._parameters)}

    def _has_param(self, name: str) -> dict[str, Any]:
        return {"exists": self._graph.resolve(name) in self._parameters}

    def _search_param(self, name: str) -> dict[str, Any]:
        found = self._graph.resolve(name)
        return {"global_name": found if found in self._parameters else ""}

    def _get_param(self, name: str, default: str = "") -> dict[str, Any]:
        if self._version == 2:
            return {"value": "", **NO_PARAMETER}
        return {"value": self._parameters.get(self._graph.resolve(name), default or "null")}

    def _set_param(self, name: str, value: str) -> dict[str, Any]:
        if self._version == 2:
            return dict(NO_PARAMETER)
        self._parameters[self._graph.resolve(name)] = value
        return {}

    def _delete_param(self, name: str) -> dict[str, Any]:
        if self._version == 2:
            return dict(NO_PARAMETER)
        self._parameters.pop(self._graph.resolve(name), None)
        return {}

    def _get_time(self) -> dict[str, Any]:
        return {"time": self._graph.types.time(self._now())}

    def _get_ros_version(self) -> dict[str, Any]:
        return {"version": self._version, "distro": "jazzy"}
