"""One client's side of the emulated bridge: the rosbridge v2 operations, where errors are ignored silently.

A client's errors are counted here and never answered. Parsing follows the real server: the whole buffer as
JSON first, else the first object in it that parses; an object without `op` found that way is discarded but
its text stays in the buffer, so that a truncated message breaks the connection permanently. JSON that breaks the
server's own code (a bare number or boolean, an `op` that cannot be looked up) ends the thread that serves this
client: what it sends later is never read, while its subscriptions continue.
Not modelled: png and cbor compression (plain JSON is sent), outgoing fragments, authentication, services of clients.
Source: rosbridge protocol document, and the behaviour of rosbridge_suite 0.11.17.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Mapping
from typing import Any

from robot_io.clock import NS_PER_S, monotonic_ns
from robot_io.ipc.event_loop import EventLoop
from sim_backend.ridgeback.ros_graph import Message, RosGraph, Topic, message_json
from sim_backend.ridgeback.ros_types import BadMessage
from sim_backend.ridgeback.rosapi.services import Answer
from sim_backend.ridgeback.subscription import ClientSubscription

UNREGISTER_NS = 10 * NS_PER_S
"""A disconnected client still counts as publisher for this long."""
_MAX_BUFFER = 1_000_000


class _Wrong(Exception):
    """A request that the server drops; the text would go to the robot's log."""


class Session:
    """One connected client. `incoming` receives its texts; `send` sends it ours."""

    def __init__(
        self,
        loop: EventLoop,
        graph: RosGraph,
        call_service: Callable[[str, object, Callable[[Answer], None]], None],
        send: Callable[[str], None],
        counters: Counter[str],
        *,
        escape_slashes: bool,
        on_new_connection: Callable[[Topic], None],
    ) -> None:
        self._loop = loop
        self._graph = graph
        self._ask_service = call_service
        self._raw_send = send
        self._counters = counters
        self._escape = escape_slashes
        self._on_new_connection = on_new_connection
        self._buffer = ""
        self._worker_died = False
        self._latches: dict[str, bool] = {}
        self._subscriptions: dict[str, tuple[Topic, ClientSubscription]] = {}
        self._fragments: dict[object, dict[int, str]] = {}
        self._operations: dict[object, Callable[[Message], None]] = {
            "advertise": self._advertise,
            "unadvertise": self._unadvertise,
            "publish": self._publish,
            "subscribe": self._subscribe,
            "unsubscribe": self._unsubscribe,
            "call_service": self._call_service,
            "fragment": self._fragment,
        }
        if graph.types.ros_version == 2:
            self._operations["send_action_goal"] = self._send_action_goal

    def incoming(self, text: str) -> None:
        """Process one text frame."""
        if len(self._buffer) < _MAX_BUFFER:  # a broken buffer never recovers, so it need not grow
            self._buffer += text
        before = None
        while self._buffer and self._buffer != before and not self._worker_died:
            before = self._buffer
            found, message = self._next_object()
            if found:
                self._perform(message)

    def close(self) -> None:
        """Remove the client: its subscriptions at once, its publishers after a while."""
        for topic, subscription in self._subscriptions.values():
            self._drop_subscription(topic, subscription)
        self._subscriptions.clear()
        for name in list(self._latches):
            self._withdraw(name)

    def _next_object(self) -> tuple[bool, Any]:
        try:
            message = json.loads(self._buffer)
        except (ValueError, RecursionError):
            pass
        else:
            self._buffer = ""
            return True, message
        decoder = json.JSONDecoder()
        start = self._buffer.find("{")
        while start >= 0:
            try:
                message, end = decoder.raw_decode(self._buffer, start)
            except (ValueError, RecursionError):
                start = self._buffer.find("{", start + 1)
                continue
            if message.get("op") is None:
                self._counters["poisoned"] += 1
                return False, None
            self._buffer = self._buffer[end:]
            return True, message
        return False, None

    def _perform(self, message: Any) -> None:
        op = message.get("op") if isinstance(message, dict) else None
        if isinstance(message, (int, float)) or isinstance(op, (dict, list)):
            self._worker_died = True
            self._counters["workers_died"] += 1
            return
        try:
            if op not in self._operations:
                raise _Wrong("no such operation")
            self._operations[op](message)
        except (_Wrong, BadMessage):
            self._counters["ignored"] += 1

    def _advertise(self, request: Message) -> None:
        topic = self._graph.declare(_text(request, "topic"), _text(request, "type"))
        if topic is None:
            raise _Wrong("unknown type, or another one than the topic's")
        self._latches[topic.name] = request.get("latch") is True
        topic.advertisers.add(self)
        self._on_new_connection(topic)

    def _unadvertise(self, request: Message) -> None:
        name = self._graph.resolve(_text(request, "topic"))
        if name in self._latches:
            self._withdraw(name)

    def _publish(self, request: Message) -> None:
        topic = self._graph.find(_text(request, "topic"))
        if topic is None:
            raise _Wrong("cannot infer the topic's type")
        message = self._graph.types.filled(topic.type_name, request.get("msg", {}))
        topic.advertisers.add(self)
        topic.bridge_sequence += 1
        if "seq" in message.get("header", ()):  # whatever the client wrote there
            message["header"]["seq"] = topic.bridge_sequence
        self._graph.publish(topic, message, latch=self._latches.setdefault(topic.name, False))

    def _subscribe(self, request: Message) -> None:
        name = _text(request, "topic")
        _check_options(request, {"type": str, "compression": str})
        _check_options(request, dict.fromkeys(("throttle_rate", "queue_length", "fragment_size"), int))
        topic = self._graph.declare(name, request["type"]) if "type" in request else self._graph.find(name)
        if topic is None:
            raise _Wrong("unknown type, or another one than the topic's")
        if name not in self._subscriptions:  # each spelling of a topic's name is a subscription of its own
            head = f'{{"op":"publish","topic":{json.dumps(name)},"msg":'
            self._subscriptions[name] = topic, ClientSubscription(self._loop, self._send, head)
            topic.subscriptions.append(self._subscriptions[name][1])
            self._on_new_connection(topic)
            if topic.latched is not None:
                self._subscriptions[name][1].deliver(message_json(topic.latched))
        self._subscriptions[name][1].add(
            request.get("id"), request.get("throttle_rate", 0), request.get("queue_length", 0)
        )

    def _unsubscribe(self, request: Message) -> None:
        name = _text(request, "topic")
        if name in self._subscriptions and self._subscriptions[name][1].remove(request.get("id")):
            self._drop_subscription(*self._subscriptions.pop(name))

    def _call_service(self, request: Message) -> None:
        service = _text(request, "service")
        _check_options(request, {"compression": str, "fragment_size": (int, type(None))})
        name, _, old_id = service.partition("#")  # an old notation of the id
        call_id = request.get("id")

        def on_answer(answer: Answer) -> None:
            ok, values = answer
            response = {"op": "service_response", "service": service, "values": values, "result": ok}
            if call_id is not None or old_id:
                response["id"] = old_id if call_id is None else call_id
            self._send(json.dumps(response, separators=(",", ":")))

        self._ask_service(name, request.get("args", []), on_answer)

    def _send_action_goal(self, request: Message) -> None:
        action, _, old_id = _text(request, "action").partition("#")
        answer = {"op": "action_result", "action": request["action"], "status": 0, "result": False}
        answer["values"] = f"{_text(request, 'action_type')}: the emulated robot has no action server {action}"
        if request.get("id") is not None or old_id:
            answer["id"] = request.get("id", old_id)
        self._send(json.dumps(answer, separators=(",", ":")))

    def _fragment(self, request: Message) -> None:
        number, total, data = request.get("num"), request.get("total"), _text(request, "data")
        if not isinstance(number, int) or not isinstance(total, int):
            raise _Wrong("num and total must be ints")
        parts = self._fragments.setdefault(str(request.get("id")), {})
        parts[number] = data
        if len(parts) == total:
            del self._fragments[str(request.get("id"))]
            try:
                message = json.loads("".join(parts[key] for key in sorted(parts)))
            except (ValueError, RecursionError) as error:
                raise _Wrong("the fragments together are not JSON") from error
            self._perform(message)

    def _withdraw(self, name: str) -> None:
        del self._latches[name]
        topic = self._graph.topics[name]

        def unregister(_: int) -> None:
            if name not in self._latches:
                topic.advertisers.discard(self)

        self._loop.call_at(monotonic_ns() + UNREGISTER_NS, unregister)

    def _drop_subscription(self, topic: Topic, subscription: ClientSubscription) -> None:
        subscription.close()
        topic.subscriptions.remove(subscription)

    def _send(self, text: str) -> None:
        self._raw_send(text.replace("/", "\\/") if self._escape else text)


def _text(request: Message, key: str) -> str:
    value = request.get(key)
    if not isinstance(value, str) or not value:
        raise _Wrong(f"{key} must be a text")
    return value


def _check_options(request: Message, kinds: Mapping[str, type | tuple[type, ...]]) -> None:
    """Check the types of optional fields: they may be missing, but not null."""
    for key, kind in kinds.items():
        if key in request and not isinstance(request[key], kind):
            raise _Wrong(f"{key} has the wrong type")
